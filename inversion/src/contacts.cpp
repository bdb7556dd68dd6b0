// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/contacts.h"

#include <cstdio>
#include <limits>
#include <string>

namespace tenter {
namespace {

constexpr double kDistanceOfSize = 1e-3;

Error penetration(int vertex, double depth_m, int count, double allowed_m) {
  char text[200];
  std::snprintf(text, sizeof text,
                "lies %.3g mm inside the obstacle, %.3g mm are taken for contact; %d vertices do",
                1e3 * depth_m, 1e3 * allowed_m, count);
  return badInput("", "vertex " + std::to_string(vertex), text,
                  "move the target out of the obstacle, or mend it by name");
}

}  // namespace

double sizeOf(const Points3& positions) {
  return (positions.rowwise().maxCoeff() - positions.rowwise().minCoeff()).norm();
}

Result<std::vector<Contact>> findContacts(const TriangleMesh& target,
                                          const std::vector<std::unique_ptr<Obstacle>>& obstacles,
                                          const std::vector<int>& held,
                                          const ContactOptions& options) {
  const double reach =
      options.distance_m > 0.0 ? options.distance_m : kDistanceOfSize * sizeOf(target.positions);
  std::vector<char> skip(static_cast<std::size_t>(target.vertexCount()), 0);
  for (const int v : held) skip[v] = 1;
  std::vector<Contact> contacts;
  double deepest = 0.0;
  int deepest_vertex = -1, inside = 0;
  for (int v = 0; v < target.vertexCount(); ++v) {
    if (skip[v]) continue;
    Contact best;
    best.vertex = v;
    best.friction = options.friction;
    best.distance_m = std::numeric_limits<double>::infinity();
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
      const Obstacle::Nearest near = obstacles[o]->nearest(target.positions.col(v));
      if (!(near.distance_m < best.distance_m)) continue;
      best.distance_m = near.distance_m;
      best.normal = near.normal;
      best.obstacle = static_cast<int>(o);
    }
    if (best.distance_m < -reach) {
      ++inside;
      if (-best.distance_m > deepest) {
        deepest = -best.distance_m;
        deepest_vertex = v;
      }
    }
    if (best.distance_m <= reach) contacts.push_back(best);
  }
  if (inside > 0) return penetration(deepest_vertex, deepest, inside, reach);
  return contacts;
}

}  // namespace tenter
