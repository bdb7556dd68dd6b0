// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/inversion/contacts.h"
#include "tenter/inversion/moving_obstacle.h"

namespace tenter {

/// Gap of a vertex to the obstacle that is nearest to it.
struct VertexGap {
  int obstacle = -1;
  double gap_m = 0.0;  ///< Distance less the one at which the vertex touches.
  Vec3 normal = Vec3::UnitZ();
};

/// Distances of vertices to obstacles. Vertices that touch at the start do so at their distance of
/// then, others at none. Far vertices are not asked again until they may have come near.
class ContactSearch {
 public:
  ContactSearch(std::vector<MovingObstacle> obstacles, int vertex_count,
                const std::vector<Contact>& touching);

  bool empty() const { return obstacles_.empty(); }
  const MovingObstacle& obstacle(int index) const { return obstacles_[index]; }
  double friction(int vertex, int obstacle) const;

  /// With obstacles where they are at `time_s`. Precondition: not empty().
  VertexGap gap(int vertex, const Vec3& place_m, double time_s) const;
  /// Whether the gap is surely larger than `reach_m`.
  bool isFar(int vertex, const Vec3& place_m, double reach_m) const;

 private:
  struct Touch {
    int obstacle = -1;
    double distance_m = 0.0, friction = 0.0;
  };
  std::vector<MovingObstacle> obstacles_;
  std::vector<Touch> touches_;  ///< One a vertex.
  bool all_rest_ = true;
  mutable Points3 asked_at_;
  mutable Eigen::VectorXd gap_then_;  ///< Infinity below zero: never asked.
};

}  // namespace tenter
