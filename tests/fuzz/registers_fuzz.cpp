// SPDX-License-Identifier: GPL-3.0-or-later
// Register maps and what amplifiers answer. An input is a map as TOML, a zero, and the bytes of the
// registers that a scan reads, over again if they are too few; without a zero, the map alone.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "fuzz_target.h"
#include "load_cell_plausibility.h"
#include "register_map_decode.h"
#include "tenter/rig/shipped_files.h"

namespace {

constexpr double kCapacity_N = 50.0, kLowest_N = -1.0;
constexpr std::int64_t kScan_ns = 5'000'000;
constexpr int kScans = 16;  // more than a new cell is not trusted for

void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// The next register of an endless repetition of the bytes.
class Words {
 public:
  explicit Words(std::string_view bytes) : bytes_(bytes) {}
  std::uint16_t next() {
    const auto byte = [this] { return static_cast<std::uint8_t>(bytes_[at_++ % bytes_.size()]); };
    const unsigned high = byte();
    return static_cast<std::uint16_t>(high << 8 | byte());
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

void scan(const tenter::RegisterMap& map, tenter::LoadCellPlausibility& plausibility, Words& words,
          int turn) {
  tenter::RegisterImage image;
  for (std::size_t block = 0; block < map.blocks.size(); ++block) {
    const int count = map.countInTurn(static_cast<int>(block), static_cast<std::uint64_t>(turn));
    require(count >= 1 && count <= map.max_registers, "a request is within the amplifier's limit");
    std::vector<std::uint16_t> answer(static_cast<std::size_t>(count));
    for (std::uint16_t& word : answer) word = words.next();
    image.put(map.blocks[block].first, answer);
  }
  for (const int address : map.scaleRegistersToAsk()) {
    const std::uint16_t word = words.next();
    image.put(address, {&word, 1});
  }
  const auto scale = scaleOf(map, image);
  if (!scale) return;
  require(std::isfinite(scale->newtons_per_count), "a scale is a number");
  const tenter::DecodedWeights weights = decodeWeights(map, image, *scale);
  const auto fault = plausibility.judge(weights, kScan_ns * turn);
  if (fault != tenter::LoadCellFault::kNone) return;
  require(weights.gross_N >= kLowest_N && weights.gross_N <= kCapacity_N,
          "what is believed is within the cell's range");
}

}  // namespace

std::vector<std::string> fuzzSeeds() {
  std::vector<std::string> seeds;
  for (const tenter::ShippedFile& file : tenter::shippedRegisterMaps()) {
    seeds.emplace_back(file.text);
    seeds.push_back(std::string(file.text) + '\0' +
                    std::string("\x00\x01\x00\x02\x41\x20\x00\x00", 8));
    seeds.push_back(std::string(file.text) + '\0' + std::string("\x00\x00", 2));
  }
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t end = bytes.find('\0');
  const auto map = tenter::parseRegisterMap(bytes.substr(0, end), "map.toml");
  if (!map) {
    require(!map.error().reason.empty(), "errors have a reason");
    return 0;
  }
  if (end == std::string_view::npos || end + 1 == size) return 0;
  tenter::LoadCellConfig config;
  config.capacity_N = kCapacity_N;
  config.lowest_N = kLowest_N;
  tenter::LoadCellPlausibility plausibility(config);
  Words words(bytes.substr(end + 1));
  for (int turn = 1; turn <= kScans; ++turn) scan(*map, plausibility, words, turn);
  return 0;
}
