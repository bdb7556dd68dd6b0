// SPDX-License-Identifier: GPL-3.0-or-later
#include "height_filter.h"

#include <algorithm>
#include <cmath>

#include "sheet_heights.h"

namespace tenter {

namespace {

constexpr int kSamples = 128;  ///< Across a subset, for integrals of what is piecewise smooth.

/// Weight, over its mean, that a place in a quadratic subset has in the value at the middle, along
/// one axis; s from -1 to 1.
double quadraticWeight(double s) { return 2.25 - 3.75 * s * s; }

/// Of the node at a distance in cells (Catmull-Rom).
double nodeWeight(double cells) {
  const double t = std::abs(cells);
  if (t < 1.0) return (1.5 * t - 2.5) * t * t + 1.0;
  if (t < 2.0) return ((-0.5 * t + 2.5) * t - 4.0) * t + 2.0;
  return 0.0;
}

/// Weights on a square lattice of nodes.
class Stencil {
 public:
  explicit Stencil(int half) : half_(half), side_(2 * half + 1) {
    weights_.resize(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_));
  }
  static Stencil one() {
    Stencil stencil(0);
    stencil.at(0, 0) = 1.0;
    return stencil;
  }
  static Stencil product(const std::vector<double>& x, const std::vector<double>& y) {
    Stencil stencil(static_cast<int>(x.size() / 2));
    for (int j = 0; j < stencil.side_; ++j)
      for (int i = 0; i < stencil.side_; ++i)
        stencil.at(i - stencil.half_, j - stencil.half_) = x[i] * y[j];
    return stencil;
  }

  int half() const { return half_; }
  double& at(int i, int j) { return weights_[(j + half_) * side_ + i + half_]; }
  double of(int i, int j) const {
    if (std::max(std::abs(i), std::abs(j)) > half_) return 0.0;
    return weights_[(j + half_) * side_ + i + half_];
  }
  Stencil plus(double factor, const Stencil& other) const {
    Stencil sum(std::max(half_, other.half_));
    for (int j = -sum.half_; j <= sum.half_; ++j)
      for (int i = -sum.half_; i <= sum.half_; ++i)
        sum.at(i, j) = of(i, j) + factor * other.of(i, j);
    return sum;
  }
  Stencil after(const Stencil& other) const {
    Stencil product(half_ + other.half_);
    for (int j = -half_; j <= half_; ++j)
      for (int i = -half_; i <= half_; ++i)
        for (int l = -other.half_; l <= other.half_; ++l)
          for (int k = -other.half_; k <= other.half_; ++k)
            product.at(i + k, j + l) += of(i, j) * other.of(k, l);
    return product;
  }

 private:
  int half_, side_;
  std::vector<double> weights_;
};

/// Integral of the product of two subsets' weights along an axis, one moved against the other, for
/// subsets whose mean weight is 1 over a side of 1.
struct Overlap {
  double mean_mean = 0.0, mean_quadratic = 0.0, quadratic_quadratic = 0.0;

  explicit Overlap(double moved) {
    if (!(std::abs(moved) < 1.0)) return;
    const double length = 1.0 - std::abs(moved);
    for (int n = 0; n < kSamples; ++n) {
      const double s = 2.0 * std::abs(moved) - 1.0 + 2.0 * length * (n + 0.5) / kSamples;
      const double here = quadraticWeight(s);
      const double there = quadraticWeight(s - 2.0 * std::abs(moved));
      mean_mean += length / kSamples;
      mean_quadratic += 0.5 * length / kSamples * (here + there);
      quadratic_quadratic += length / kSamples * here * there;
    }
  }
};

/// Covariances of what two subsets see at two places, in that of affine ones at one place. In two
/// dimensions a quadratic subset's weights are q(x) + q(y) - 1.
struct Covariance {
  double mean_mean, mean_quadratic, quadratic_quadratic;

  Covariance(const Overlap& x, const Overlap& y)
      : mean_mean(x.mean_mean * y.mean_mean),
        mean_quadratic(x.mean_quadratic * y.mean_mean + x.mean_mean * y.mean_quadratic -
                       x.mean_mean * y.mean_mean),
        quadratic_quadratic(
            x.quadratic_quadratic * y.mean_mean + x.mean_mean * y.quadratic_quadratic +
            x.mean_mean * y.mean_mean + 2.0 * x.mean_quadratic * y.mean_quadratic -
            2.0 * x.mean_quadratic * y.mean_mean - 2.0 * x.mean_mean * y.mean_quadratic) {}
};

/// Covariances for all distances between nodes at which subsets share pixels.
class Covariances {
 public:
  explicit Covariances(double half_cells) : far_(static_cast<int>(2.0 * half_cells)) {
    for (int k = 0; k <= far_; ++k) overlaps_.emplace_back(k / (2.0 * half_cells));
  }
  /// Covariance of a sum over one stencil with one over another; `which` a member of Covariance.
  double of(const Stencil& a, const Stencil& b, double Covariance::*which) const {
    double sum = 0.0;
    for (int l = -far_; l <= far_; ++l) {
      for (int k = -far_; k <= far_; ++k) {
        double products = 0.0;
        for (int j = -a.half(); j <= a.half(); ++j)
          for (int i = -a.half(); i <= a.half(); ++i) products += a.of(i, j) * b.of(i + k, j + l);
        sum += products * (Covariance(overlaps_[std::abs(k)], overlaps_[std::abs(l)]).*which);
      }
    }
    return sum;
  }

 private:
  int far_;
  std::vector<Overlap> overlaps_;
};

Stencil smoothing(int reach) {
  if (reach < 1) return Stencil::one();
  Stencil stencil(reach);
  const Eigen::MatrixXd weights = quadricWeights(reach);
  for (int j = -reach; j <= reach; ++j)
    for (int i = -reach; i <= reach; ++i) stencil.at(i, j) = weights(i + reach, j + reach);
  return stencil;
}

}  // namespace

SubsetWeights::SubsetWeights(double half_cells)
    : half(static_cast<int>(std::ceil(half_cells)) + 1),
      mean(static_cast<std::size_t>(2 * half + 1)),
      quadratic(mean.size()) {
  for (int n = 0; n < kSamples; ++n) {
    const double s = 2.0 * (n + 0.5) / kSamples - 1.0;
    for (int node = -half; node <= half; ++node) {
      const double weight = nodeWeight(s * half_cells - node) / kSamples;
      mean[static_cast<std::size_t>(node + half)] += weight;
      quadratic[static_cast<std::size_t>(node + half)] += quadraticWeight(s) * weight;
    }
  }
}

HeightFilter heightFilter(int order, double half_cells, int reach, int passes) {
  const SubsetWeights subset(half_cells);
  const Stencil smooth = smoothing(reach);
  const Stencil mean = Stencil::product(subset.mean, subset.mean);
  // A pass makes S h + K (h' - S h) of heights h, h' what the images show: what of h is left is ...
  const Stencil left = smooth.plus(-1.0, mean.after(smooth));
  // ... so that after all passes affine matches have come in by `affine`, the first ones by
  // `first`.
  Stencil affine(0), first = Stencil::one();
  for (int pass = 0; pass < passes; ++pass) {
    affine = affine.plus(1.0, first);
    first = left.after(first);
  }
  const auto which_first = order == 1 ? &Covariance::mean_mean : &Covariance::quadratic_quadratic;
  const auto which_both = order == 1 ? &Covariance::mean_mean : &Covariance::mean_quadratic;
  const Covariances covariances(half_cells);
  const auto variance = [&](const Stencil& by_first) {
    return covariances.of(affine, affine, &Covariance::mean_mean) +
           2.0 * covariances.of(affine, by_first, which_both) +
           covariances.of(by_first, by_first, which_first);
  };
  HeightFilter filter;
  const Stencil one = Stencil::one();
  filter.noise.own = variance(first);
  filter.noise.with_match =
      covariances.of(affine, one, &Covariance::mean_mean) + covariances.of(first, one, which_both);
  filter.noise.with_tracking =
      covariances.of(affine, one, which_both) + covariances.of(first, one, which_first);
  filter.difference = variance(first.plus(-1.0, one));
  filter.leak = covariances.of(first, first, which_first) / covariances.of(one, one, which_first);
  return filter;
}

}  // namespace tenter
