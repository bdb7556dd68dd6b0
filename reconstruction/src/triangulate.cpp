// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/triangulate.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace tenter {

namespace {

constexpr int kMaxIterations = 12;
/// A step below this is none [m].
constexpr double kSmallStep_m = 1e-10;
/// Pivot, over the largest, below which the rays say nothing about a direction.
constexpr double kLeastPivot = 1e-9;

/// The point with the least sum of squared distances from the rays.
std::optional<Vec3> betweenRays(std::span<const CameraView> views,
                                std::span<const Sighting> sightings) {
  Mat3 sum = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Sighting& sighting : sightings) {
    const CameraView& view = views[sighting.view];
    const auto direction = view.direction(sighting.pixel);
    if (!direction) return std::nullopt;
    const Mat3 across = Mat3::Identity() - *direction * direction->transpose();
    sum += across;
    right += across * view.centre();
  }
  const Eigen::LDLT<Mat3> factor(sum);
  const Vec3 pivots = factor.vectorD();
  if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return std::nullopt;
  return Vec3(factor.solve(right));
}

struct Normal {
  Mat3 matrix = Mat3::Zero();
  Vec3 gradient = Vec3::Zero();
  double chi2 = 0.0, squares_px2 = 0.0, worst = -1.0;
  int worst_sighting = 0;
};

std::optional<Normal> normalAt(const Vec3& point, std::span<const CameraView> views,
                               std::span<const Sighting> sightings) {
  Normal normal;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const Sighting& sighting = sightings[i];
    Eigen::Matrix<double, 2, 3> jacobian;
    const auto pixel = views[sighting.view].project(point, &jacobian);
    if (!pixel) return std::nullopt;
    const Vec2 residual = sighting.pixel - *pixel;
    const Mat2 weight = sighting.covariance_px2.inverse();
    normal.matrix += jacobian.transpose() * weight * jacobian;
    normal.gradient += jacobian.transpose() * weight * residual;
    const double chi2 = residual.dot(weight * residual);
    normal.chi2 += chi2;
    normal.squares_px2 += residual.squaredNorm();
    if (chi2 > normal.worst) {
      normal.worst = chi2;
      normal.worst_sighting = static_cast<int>(i);
    }
  }
  return normal;
}

}  // namespace

std::optional<SpacePoint> triangulate(std::span<const CameraView> views,
                                      std::span<const Sighting> sightings, const Vec3* guess) {
  if (sightings.size() < 2) return std::nullopt;
  SpacePoint point;
  if (guess) {
    point.position_m = *guess;
  } else {
    const auto start = betweenRays(views, sightings);
    if (!start) return std::nullopt;
    point.position_m = *start;
  }
  for (int i = 0; i < kMaxIterations; ++i) {
    const auto normal = normalAt(point.position_m, views, sightings);
    if (!normal) return std::nullopt;
    const Eigen::LDLT<Mat3> factor(normal->matrix);
    const Vec3 pivots = factor.vectorD();
    if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return std::nullopt;
    const Vec3 step = factor.solve(normal->gradient);
    point.position_m += step;
    if (step.norm() > kSmallStep_m) continue;
    point.covariance_m2 = factor.solve(Mat3::Identity());
    point.chi2 = normal->chi2;
    point.residual_px = std::sqrt(normal->squares_px2 / static_cast<double>(sightings.size()));
    point.worst = normal->worst_sighting;
    return point;
  }
  return std::nullopt;
}

}  // namespace tenter
