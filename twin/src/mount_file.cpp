// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>

#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/twin/mounted_specimen.h"

namespace tenter {
namespace {

constexpr std::size_t kMaxFile_bytes = 65'536, kMaxName = 64;

}  // namespace

nlohmann::json mountToJson(const MountOptions& options) {
  return {{"schema_version", 1},   {"fabric", options.fabric},     {"protocol", options.protocol},
          {"seed", options.seed},  {"specimen", options.specimen}, {"nodes", options.nodes},
          {"clips", options.clips}};
}

Result<MountOptions> readMount(const std::filesystem::path& file) {
  const Result<std::string> text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  const auto json = parseJson(*text, file.string());
  if (!json) return json.error();
  JsonReader in(*json, file.string());
  MountOptions options;
  in.integer("schema_version", 1, 1);
  options.fabric = in.text("fabric", kMaxName);
  options.protocol = in.text("protocol", kMaxName);
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  options.seed = static_cast<std::uint64_t>(in.integer("seed", 0, kMost));
  options.specimen = static_cast<std::uint64_t>(in.integer("specimen", 0, kMost));
  options.nodes = static_cast<int>(in.integer("nodes", 15, 200));
  options.clips = in.textOr("clips", options.clips);
  if (!in.ok()) return in.error();
  return options;
}

}  // namespace tenter
