// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "tenter/inversion/obstacle.h"

namespace tenter {

/// A vertex that touches an obstacle.
struct Contact {
  int vertex = 0;
  Vec3 normal = Vec3::UnitZ();  ///< Unit, from the obstacle to the shell.
  double friction = 0.0;        ///< Coulomb's mu.
  double distance_m = 0.0;
  int obstacle = 0;
};

struct ContactOptions {
  double friction = 0.4;
  double distance_m = 0.0;  ///< Vertices up to this far touch; 0: 1e-3 of the target's size.
};

/// Diagonal of the box around a mesh [m].
double sizeOf(const Points3& positions);

/// Contacts of all vertices but those that are held, in order of vertices; of the nearest obstacle.
/// Error kBadInput that names the deepest vertex when one lies further inside than the distance.
Result<std::vector<Contact>> findContacts(const TriangleMesh& target,
                                          const std::vector<std::unique_ptr<Obstacle>>& obstacles,
                                          const std::vector<int>& held,
                                          const ContactOptions& options);

}  // namespace tenter
