// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/spline_basis.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

namespace tenter {
namespace {

constexpr int kDegree = 3;
/// Points per interval at which coefficientsOf compares: four would settle a curve of the space.
constexpr int kSamplesPerInterval = 8;

}  // namespace

SplineBasis SplineBasis::constant(bool even) { return SplineBasis({0.0}, even); }

SplineBasis SplineBasis::onKnots(std::vector<double> knots, bool even) {
  return SplineBasis(std::move(knots), even);
}

SplineBasis::SplineBasis(std::vector<double> knots, bool even)
    : knots_(std::move(knots)), even_(even) {
  require(!knots_.empty(), "a spline basis needs a knot");
  require(std::all_of(knots_.begin(), knots_.end(), [](double x) { return std::isfinite(x); }),
          "knots of a spline basis must be finite");
  require(std::adjacent_find(knots_.begin(), knots_.end(), std::greater_equal<>()) == knots_.end(),
          "knots of a spline basis must increase");
  require(!even_ || knots_.front() == 0.0, "the knots of an even spline basis begin at 0");
  const int n = static_cast<int>(knots_.size());
  if (n == 1) return;
  extended_.assign(kDegree, knots_.front());
  extended_.insert(extended_.end(), knots_.begin(), knots_.end());
  extended_.insert(extended_.end(), kDegree, knots_.back());
  size_ = even_ ? n + 1 : n + 2;
}

/// The four functions that do not vanish at a strain, before the first two are merged; returns the
/// first one's index. De Boor's recurrence: each degree's functions are blends of two of the degree
/// below.
int SplineBasis::unmerged(double strain, std::array<double, 4>& values) const {
  const double e = std::clamp(strain, knots_.front(), knots_.back());
  int span = 0;
  const int last_span = static_cast<int>(knots_.size()) - 2;
  while (span < last_span && e >= knots_[span + 1]) ++span;

  const double* t = extended_.data() + span + kDegree;  // t[0] <= e <= t[1].
  values = {1.0, 0.0, 0.0, 0.0};
  for (int degree = 1; degree <= kDegree; ++degree) {
    double carried = 0.0;
    for (int j = 0; j < degree; ++j) {
      const double right = t[j + 1], left = t[j + 1 - degree];
      const double share = values[j] / (right - left);
      values[j] = carried + (right - e) * share;
      carried = (e - left) * share;
    }
    values[degree] = carried;
  }
  return span;
}

SplineBasis::Local SplineBasis::local(double strain) const {
  Local local;
  if (size_ == 1) {
    local.count = 1;
    local.values[0] = 1.0;
    return local;
  }
  local.count = kDegree + 1;
  local.first = unmerged(even_ ? std::abs(strain) : strain, local.values);
  if (!even_) return local;
  if (local.first > 0) {
    --local.first;
    return local;
  }
  local.count = kDegree;
  local.values = {local.values[0] + local.values[1], local.values[2], local.values[3], 0.0};
  return local;
}

void SplineBasis::evaluate(double strain, Eigen::Ref<Eigen::VectorXd> values) const {
  const Local part = local(strain);
  values.setZero();
  for (int j = 0; j < part.count; ++j) values[part.first + j] = part.values[j];
}

/// (n + 2) x size(): coefficients of the plain B-splines from those of this basis.
Eigen::MatrixXd SplineBasis::merging() const {
  const int plain = static_cast<int>(knots_.size()) + 2;
  Eigen::MatrixXd merging = Eigen::MatrixXd::Zero(plain, size_);
  for (int i = 0; i < plain; ++i) merging(i, even_ ? std::max(i - 1, 0) : i) = 1.0;
  return merging;
}

StiffnessCurve SplineBasis::curve(const Eigen::VectorXd& coefficients) const {
  require(coefficients.size() == size_, "a curve takes as many coefficients as its basis has");
  if (size_ == 1 && knots_.front() == 0.0) return StiffnessCurve::constant(coefficients[0], even_);
  const std::size_t n = knots_.size();
  std::vector<double> stiffness(n, coefficients[0]), tangent(n, 0.0);
  if (size_ > 1) {
    const Eigen::VectorXd plain = merging() * coefficients;
    // Slope of a cubic B-spline: a quadratic one whose coefficients are the first differences.
    Eigen::VectorXd slope(plain.size() - 1);
    for (int j = 0; j < slope.size(); ++j)
      slope[j] = kDegree * (plain[j + 1] - plain[j]) / (extended_[j + 4] - extended_[j + 1]);
    for (std::size_t i = 0; i < n; ++i) {
      const Local part = local(knots_[i]);
      stiffness[i] = 0.0;
      for (int j = 0; j < part.count; ++j)
        stiffness[i] += part.values[j] * coefficients[part.first + j];
      // At a knot two quadratics are left, weighted by the distances to the neighbours.
      const double before = knots_[i] - extended_[i + 2], after = extended_[i + 4] - knots_[i];
      tangent[i] = (slope[static_cast<int>(i)] * after + slope[static_cast<int>(i) + 1] * before) /
                   (before + after);
    }
  }
  Result<StiffnessCurve> curve =
      StiffnessCurve::fromKnots(knots_, std::move(stiffness), std::move(tangent), even_);
  require(curve.ok(), "coefficients of a spline basis must be finite");
  return std::move(curve).value();
}

Eigen::MatrixXd SplineBasis::knotValueMap() const {
  Eigen::MatrixXd map(static_cast<int>(knots_.size()), size_);
  Eigen::VectorXd row(size_);
  for (int i = 0; i < map.rows(); ++i) {
    evaluate(knots_[i], row);
    map.row(i) = row;
  }
  return map;
}

Eigen::VectorXd SplineBasis::coefficientsOf(const StiffnessCurve& curve) const {
  if (size_ == 1) return Eigen::VectorXd::Constant(1, curve.evaluate(knots_.front()).stiffness);
  const int intervals = static_cast<int>(knots_.size()) - 1;
  const int samples = intervals * kSamplesPerInterval + 1;
  Eigen::MatrixXd basis(samples, size_);
  Eigen::VectorXd target(samples), row(size_);
  for (int s = 0; s < samples; ++s) {
    const int i = std::min(s / kSamplesPerInterval, intervals - 1);
    const double part = static_cast<double>(s - i * kSamplesPerInterval) / kSamplesPerInterval;
    const double strain = knots_[i] + part * (knots_[i + 1] - knots_[i]);
    evaluate(strain, row);
    basis.row(s) = row;
    target[s] = curve.evaluate(strain).stiffness;
  }
  return basis.colPivHouseholderQr().solve(target);
}

Eigen::MatrixXd SplineBasis::roughness() const {
  if (size_ == 1) return Eigen::MatrixXd::Zero(1, 1);
  const Eigen::MatrixXd plain = merging();
  const int n = static_cast<int>(plain.rows());
  const double range = knots_.back() - knots_.front();
  Eigen::VectorXd greville(n);
  for (int j = 0; j < n; ++j)
    greville[j] = (extended_[j + 1] + extended_[j + 2] + extended_[j + 3]) / (kDegree * range);
  Eigen::MatrixXd second = Eigen::MatrixXd::Zero(n - 2, n);
  for (int j = 0; j + 2 < n; ++j) {
    const double before = greville[j + 1] - greville[j], after = greville[j + 2] - greville[j + 1];
    const double middle = 0.5 * (before + after), weight = std::sqrt(middle);
    second(j, j) = weight / (before * middle);
    second(j, j + 2) = weight / (after * middle);
    second(j, j + 1) = -second(j, j) - second(j, j + 2);
  }
  const Eigen::MatrixXd merged = second * plain;
  return merged.transpose() * merged;
}

}  // namespace tenter
