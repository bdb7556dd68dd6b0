// SPDX-License-Identifier: GPL-3.0-or-later
// Feeds a fuzz target its seeds, spoilt in ways drawn from a fixed seed. Where libFuzzer is at hand
// it finds more; this keeps the target alive with any compiler. Usage: NAME_fuzz [inputs]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "fuzz_target.h"

namespace {

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t limit) {
  return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
}

/// One change: a flipped bit, a byte, a piece left out, doubled, or taken from another seed.
void spoil(std::string& input, const std::vector<std::string>& seeds, Random& random) {
  if (input.empty()) input = seeds[below(random, seeds.size())];
  if (input.empty()) return;
  const std::size_t at = below(random, input.size());
  const std::size_t count = 1 + below(random, std::min<std::size_t>(input.size() - at, 64));
  const std::string& other = seeds[below(random, seeds.size())];
  switch (below(random, 5)) {
    case 0:
      input[at] = static_cast<char>(input[at] ^ (1 << below(random, 8)));
      break;
    case 1:
      input[at] = static_cast<char>(below(random, 256));
      break;
    case 2:
      input.erase(at, count);
      break;
    case 3:
      input.insert(at, input.substr(at, count));
      break;
    default:
      input.replace(at, count, other.substr(std::min(at, other.size()), 2 * count));
      break;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const long inputs = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 20'000;
  const std::vector<std::string> seeds = fuzzSeeds();
  Random random(1);
  for (long i = 0; i < inputs; ++i) {
    std::string input = seeds[below(random, seeds.size())];
    for (std::size_t changes = below(random, 6); changes > 0; --changes) {
      spoil(input, seeds, random);
    }
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
  }
  std::printf("%ld inputs\n", inputs);
  return 0;
}
