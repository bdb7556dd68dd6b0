// SPDX-License-Identifier: GPL-3.0-or-later
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "tenter/core/files.h"

namespace tenter {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxFiles = 1'000'000;

class Hasher {
 public:
  Hasher() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1) {
      throw std::runtime_error("the SHA-256 of OpenSSL is not available");
    }
  }
  void add(std::string_view bytes) { EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()); }
  std::string hexadecimal() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &size);
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (unsigned i = 0; i < size; ++i) {
      text += kDigits[digest[i] >> 4U];
      text += kDigits[digest[i] & 15U];
    }
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

/// Regular files below a folder, relative and sorted. Links to folders are not followed, so loops
/// end.
Result<std::vector<std::string>> filesBelow(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  const fs::recursive_directory_iterator end;
  while (!error && entry != end) {
    std::error_code ignored;
    if (entry->is_regular_file(ignored)) {
      names.push_back(entry->path().lexically_relative(folder).generic_string());
    }
    if (names.size() > kMaxFiles) return badInput(folder.string(), "", "holds too many files");
    entry.increment(error);
  }
  if (error) return badInput(folder.string(), "", "cannot be listed: " + error.message());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::string sha256(std::string_view bytes) {
  Hasher hasher;
  hasher.add(bytes);
  return hasher.hexadecimal();
}

Result<std::string> sha256OfPath(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    auto content = readFile(path);
    if (!content) return content.error();
    return sha256(*content);
  }
  const auto names = filesBelow(path);
  if (!names) return names.error();
  Hasher hasher;
  for (const std::string& name : *names) {
    const auto content = readFile(path / name);
    if (!content) return content.error();
    // Lengths keep ("ab", "c") and ("a", "bc") apart.
    hasher.add(std::to_string(name.size()) + ":" + name + ":" + std::to_string(content->size()) +
               ":");
    hasher.add(*content);
  }
  return hasher.hexadecimal();
}

}  // namespace tenter
