// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "tenter/core/mesh.h"

namespace tenter {

/// A rigid body that a shell may touch.
class Obstacle {
 public:
  struct Nearest {
    double distance_m = 0.0;  ///< Negative inside.
    Vec3 point = Vec3::Zero();
    Vec3 normal = Vec3::UnitZ();  ///< Unit, out of the body.
  };
  virtual ~Obstacle() = default;
  virtual Nearest nearest(const Vec3& place) const = 0;
};

/// `sphere:x,y,z,r`, `plane:x,y,z,nx,ny,nz` (a point and the normal of a half space),
/// `cylinder:ax,ay,az,bx,by,bz,r` and `cone:ax,ay,az,bx,by,bz,ra,rb` (endless, about the line from
/// a to b; the cone has radius ra at a and rb at b) [m], or a mesh file (OBJ, PLY, VTP) of one or
/// more surfaces that turn outwards. Error with the place and the reason: unreadable numbers, a
/// mesh that is not manifold, has triangles without area, or is closed and turns inwards.
Result<std::unique_ptr<Obstacle>> makeObstacle(const std::string& description);

/// The same of a mesh in memory.
Result<std::unique_ptr<Obstacle>> makeMeshObstacle(const TriangleMesh& mesh);

}  // namespace tenter
