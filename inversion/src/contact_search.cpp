// SPDX-License-Identifier: GPL-3.0-or-later
#include "contact_search.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tenter {

ContactSearch::ContactSearch(std::vector<MovingObstacle> obstacles, int vertex_count,
                             const std::vector<Contact>& touching)
    : obstacles_(std::move(obstacles)),
      touches_(static_cast<std::size_t>(vertex_count)),
      asked_at_(Points3::Zero(3, vertex_count)),
      gap_then_(Eigen::VectorXd::Constant(vertex_count, -std::numeric_limits<double>::infinity())) {
  for (const Contact& c : touching)
    touches_[static_cast<std::size_t>(c.vertex)] = {c.obstacle, c.distance_m, c.friction};
  all_rest_ = std::none_of(obstacles_.begin(), obstacles_.end(),
                           [](const MovingObstacle& o) { return o.motion.moves(); });
}

double ContactSearch::friction(int vertex, int obstacle) const {
  const Touch& touch = touches_[static_cast<std::size_t>(vertex)];
  return touch.obstacle == obstacle ? touch.friction : obstacles_[obstacle].friction;
}

VertexGap ContactSearch::gap(int vertex, const Vec3& place_m, double time_s) const {
  const Touch& touch = touches_[static_cast<std::size_t>(vertex)];
  VertexGap best;
  best.gap_m = std::numeric_limits<double>::infinity();
  for (std::size_t o = 0; o < obstacles_.size(); ++o) {
    const Obstacle::Nearest near = obstacles_[o].nearest(place_m, time_s);
    const int index = static_cast<int>(o);
    const double gap = near.distance_m - (touch.obstacle == index ? touch.distance_m : 0.0);
    if (gap < best.gap_m) best = {index, gap, near.normal};
  }
  asked_at_.col(vertex) = place_m;
  gap_then_[vertex] = best.gap_m;
  return best;
}

bool ContactSearch::isFar(int vertex, const Vec3& place_m, double reach_m) const {
  // Distances change no faster than the place.
  return all_rest_ && gap_then_[vertex] - (place_m - asked_at_.col(vertex)).norm() > reach_m;
}

}  // namespace tenter
