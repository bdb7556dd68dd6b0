// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/cord_friction.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tenter {
namespace {

/// Of the friction, from let out to drawn in: so many that a step of one is below the noise of a
/// soft cord's averaged tension.
constexpr int kLevels = 101;
/// Clips do not fly: cord runs over a pulley hardly faster than so much a sample (a millimetre a
/// second, at fifty of them), or than its axis.
constexpr double kClipWay_m = 1.8e-5;
/// The window over which readings are averaged makes the cord's way known to so much of the
/// presliding, as far as it may grow.
constexpr double kKnownShare = 0.2;
constexpr int kShortestWindow = 5, kLongestWindow = 25;
constexpr double kLeastNoise_N = 1e-4, kLeastWay_m = 5e-7;
constexpr double kLetOutFirst = 0.5;  // a record begins where homing has let the cord out
constexpr double kFelt = 3.0;         // standard deviations above nothing

double levelOf(int index) { return -1.0 + 2.0 * index / (kLevels - 1); }

/// Readings that are not there take over the one before.
std::vector<double> filled(std::span<const double> values) {
  std::vector<double> out(values.begin(), values.end());
  double last = 0.0;
  for (const double value : out) {
    if (!std::isfinite(value)) continue;
    last = value;
    break;
  }
  for (double& value : out) {
    if (std::isfinite(value)) last = value;
    value = last;
  }
  return out;
}

/// Standard deviation of white noise on a smooth curve, from the middle one of second differences.
double noiseOf(const std::vector<double>& values) {
  std::vector<double> bends;
  for (std::size_t i = 2; i < values.size(); ++i) {
    bends.push_back(std::abs(values[i] - 2.0 * values[i - 1] + values[i - 2]));
  }
  if (bends.empty()) return kLeastNoise_N;
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  constexpr double kOfMedian = 1.4826, kOfBend = 2.449489742783178;  // normal; sqrt(6)
  return std::max(kLeastNoise_N, kOfMedian / kOfBend * *middle);
}

/// Mean over `window` samples about each; fewer at the ends.
std::vector<double> averaged(const std::vector<double>& values, int window) {
  std::vector<double> sums(values.size() + 1, 0.0), out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) sums[i + 1] = sums[i] + values[i];
  const auto half = static_cast<std::size_t>(window / 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t reach = std::min({half, i, values.size() - 1 - i});
    out[i] = (sums[i + reach + 1] - sums[i - reach]) / static_cast<double>(2 * reach + 1);
  }
  return out;
}

std::vector<double> byTravel(double presliding_m, std::span<const double> positions_m) {
  PulleyFriction friction(presliding_m, -1.0);
  std::vector<double> shares;
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    shares.push_back(friction.follow(positions_m[i] - positions_m[i > 0 ? i - 1 : 0]));
  }
  return shares;
}

/// The cheapest path of the friction through all samples (Viterbi): a step is as expensive as the
/// cord's way that it takes differs from the one that was measured, and as that one is unlikely. At
/// its ends the friction takes any way further on.
class FrictionPath {
 public:
  FrictionPath(const CordEntry& cord, std::span<const double> positions_m,
               std::span<const double> tensions_N)
      : friction_(*cord.friction), stretch_(*cord.stretch) {
    const std::vector<double> tensions = filled(tensions_N);
    const double noise_N = noiseOf(tensions), k = std::abs(stretch_.stiffness_N_per_m);
    const double wanted = std::sqrt(2.0) * noise_N / (k * kKnownShare * friction_.presliding_m);
    const int half =
        static_cast<int>(std::clamp(0.5 * wanted, 0.5 * kShortestWindow, 0.5 * kLongestWindow));
    const int window = 2 * half + 1;
    positions_m_ = averaged({positions_m.begin(), positions_m.end()}, window);
    tensions_N_ = averaged(tensions, window);
    sigma_m_ = std::hypot(std::sqrt(2.0) * noise_N / (k * window), kLeastWay_m);
  }

  std::vector<double> shares() {
    const std::size_t size = positions_m_.size();
    std::vector<std::array<signed char, kLevels>> came(size);
    Costs costs{};
    for (int level = 0; level < kLevels; ++level) costs[index(level)] = kLetOutFirst * (level > 0);
    for (std::size_t i = 1; i < size; ++i) costs = step(i, costs, came[i]);
    int level = static_cast<int>(std::min_element(costs.begin(), costs.end()) - costs.begin());
    std::vector<double> out(size);
    for (std::size_t i = size; i-- > 0;) {
      out[i] = levelOf(level);
      if (i > 0) level = came[i][index(level)];
    }
    return out;
  }

 private:
  using Costs = std::array<double, kLevels>;
  static std::size_t index(int level) { return static_cast<std::size_t>(level); }

  double costOf(int from, int to, double way_m) const {
    const double taken_m = 0.5 * friction_.presliding_m * (levelOf(to) - levelOf(from));
    double off_m = way_m - taken_m;
    if (to == kLevels - 1) off_m = std::min(off_m, 0.0);
    if (to == 0) off_m = std::max(off_m, 0.0);
    return 0.5 * off_m * off_m / (sigma_m_ * sigma_m_);
  }

  Costs step(std::size_t i, const Costs& before, std::array<signed char, kLevels>& came) const {
    const double dx_m = positions_m_[i] - positions_m_[i - 1];
    const double dt_N = tensions_N_[i] - tensions_N_[i - 1];
    const double k = stretch_.stiffnessAt(positions_m_[i]);
    const double per_spread = 1.0 / (kClipWay_m * kClipWay_m + dx_m * dx_m);
    Costs costs;
    costs.fill(1e300);
    for (int from = 0; from < kLevels; ++from) {
      for (int to = 0; to < kLevels; ++to) {
        const double turned_N = friction_.friction_N * (levelOf(to) - levelOf(from));
        const double way_m = dx_m - (dt_N - turned_N) / k;
        const double unlikely_m = way_m - 0.5 * dx_m;
        const double cost = before[index(from)] + costOf(from, to, way_m) +
                            0.5 * unlikely_m * unlikely_m * per_spread;
        if (cost >= costs[index(to)]) continue;
        costs[index(to)] = cost;
        came[index(to)] = static_cast<signed char>(from);
      }
    }
    return costs;
  }

  CordFrictionFit friction_;
  CordStretchFit stretch_;
  std::vector<double> positions_m_, tensions_N_;
  double sigma_m_ = 0.0;
};

}  // namespace

double PulleyFriction::follow(double drawn_m) {
  share_ = std::clamp(share_ + 2.0 * drawn_m / presliding_m_, -1.0, 1.0);
  return share_;
}

std::vector<double> frictionAlong(const CordEntry& cord, std::span<const double> positions_m,
                                  std::span<const double> tensions_N) {
  require(cord.friction.has_value(), "frictionAlong: a cord whose friction is known");
  require(positions_m.size() == tensions_N.size(), "frictionAlong: one tension for each position");
  if (positions_m.empty()) return {};
  std::vector<double> out = cord.stretch ? FrictionPath(cord, positions_m, tensions_N).shares()
                                         : byTravel(cord.friction->presliding_m, positions_m);
  const std::vector<double> felt_N = filled(tensions_N);
  const double noise_N = noiseOf(felt_N);
  for (std::size_t i = 0; i < out.size(); ++i) {
    // A cell does not feel less than nothing: of a slack cord it does not say how it rubs.
    out[i] = felt_N[i] > kFelt * noise_N ? out[i] * cord.friction->friction_N : 0.0;
  }
  return out;
}

}  // namespace tenter
