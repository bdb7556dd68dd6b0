// SPDX-License-Identifier: GPL-3.0-or-later
#include "view_offsets.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace tenter {

namespace {

/// Sightings that a view needs before anything is said of it.
constexpr int kLeastSightings = 50;

}  // namespace

Eigen::Vector3d ViewOffsets::placeOf(const Sighting& sighting) const {
  const CameraModel& model = views_[sighting.view].model;
  const Vec2 half(0.5 * model.widthPx(), 0.5 * model.heightPx());
  const Vec2 scaled = (sighting.pixel - half) / half.x();
  return {1.0, scaled.x(), scaled.y()};
}

std::optional<Vec2> ViewOffsets::residualOf(const RestVertex& vertex,
                                            const Sighting& sighting) const {
  const auto projected = views_[sighting.view].project(vertex.point.position_m);
  if (!projected) return std::nullopt;
  return Vec2(sighting.pixel - *projected);
}

ViewOffsets::ViewOffsets(const std::vector<CameraView>& views,
                         const std::vector<RestVertex>& vertices)
    : views_(views), linear_(views.size(), Linear::Zero()) {
  std::vector<Eigen::Matrix3d> normal(views.size(), Eigen::Matrix3d::Zero());
  std::vector<Linear> right(views.size(), Linear::Zero());
  std::vector<int> counts(views.size(), 0);
  const auto each = [&](auto&& action) {
    for (const RestVertex& vertex : vertices) {
      if (vertex.state != PointState::kValid) continue;
      for (const VertexSighting& s : vertex.sightings)
        if (const auto residual = residualOf(vertex, s.sighting)) action(s.sighting, *residual);
    }
  };
  each([&](const Sighting& sighting, const Vec2& residual) {
    const Eigen::Vector3d place = placeOf(sighting);
    normal[sighting.view] += place * place.transpose();
    right[sighting.view] += place * residual.transpose();
    ++counts[sighting.view];
  });
  for (std::size_t v = 0; v < views.size(); ++v)
    if (counts[v] >= kLeastSightings) linear_[v] = normal[v].ldlt().solve(right[v]);
  double squares = 0.0, freedom = 0.0;
  each([&](const Sighting& sighting, const Vec2&) {
    squares += (linear_[sighting.view].transpose() * placeOf(sighting)).squaredNorm();
  });
  for (const RestVertex& vertex : vertices)
    if (vertex.state == PointState::kValid)
      freedom += 2.0 * static_cast<double>(vertex.sightings.size()) - 3.0;
  if (freedom > 0.0) offset_px_ = std::sqrt(squares / freedom);
}

double ViewOffsets::chi2(const RestVertex& vertex) const {
  double sum = 0.0;
  for (const VertexSighting& s : vertex.sightings) {
    const auto residual = residualOf(vertex, s.sighting);
    if (!residual) continue;
    const Vec2 left = *residual - linear_[s.sighting.view].transpose() * placeOf(s.sighting);
    sum += left.dot(s.sighting.covariance_px2.inverse() * left);
  }
  return sum;
}

}  // namespace tenter
