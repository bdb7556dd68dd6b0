// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstring>

#include "tenter/twin/image_source.h"

namespace tenter {
namespace {

/// Stands at the image's beginning; its last member is the sum of all pixels behind it.
struct Header {
  std::uint64_t magic = 0, camera = 0, frame = 0, sum = 0;
};
constexpr std::uint64_t kMagic = 0x54656e7465723031;

/// Of bytes, eight at a time; finds pieces that are missing, of another image, or out of order.
std::uint64_t sumOf(std::span<const std::uint8_t> bytes) {
  std::uint64_t sum = 0;
  for (std::size_t at = 0; at < bytes.size(); at += sizeof sum) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min(sizeof word, bytes.size() - at));
    sum = sum * 0x5851f42d4c957f2dULL + word + 1;
  }
  return sum;
}

}  // namespace

void TestPatternSource::fill(const ImageRequest& request, std::span<std::uint8_t> pixels) {
  std::uint64_t state = (static_cast<std::uint64_t>(request.camera) << 48) ^ (request.frame + 1);
  for (std::size_t at = 0; at < pixels.size(); at += sizeof state) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    std::memcpy(pixels.data() + at, &state, std::min(sizeof state, pixels.size() - at));
  }
  // Half the range: nothing of it is over-exposed.
  for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(64 + pixel / 2);
  if (pixels.size() <= sizeof(Header)) return;
  Header header{kMagic, static_cast<std::uint64_t>(request.camera), request.frame,
                sumOf(pixels.subspan(sizeof(Header)))};
  std::memcpy(pixels.data(), &header, sizeof header);
}

std::optional<TestPatternMark> readTestPattern(std::span<const std::uint8_t> pixels) {
  Header header;
  if (pixels.size() <= sizeof header) return std::nullopt;
  std::memcpy(&header, pixels.data(), sizeof header);
  if (header.magic != kMagic || header.sum != sumOf(pixels.subspan(sizeof header))) {
    return std::nullopt;
  }
  return TestPatternMark{static_cast<int>(header.camera), header.frame};
}

}  // namespace tenter
