// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/core/mesh.h"
#include "tenter/reconstruction/camera_view.h"
#include "tenter/reconstruction/subset_warp.h"

namespace tenter {

/// How pieces of an image move with a mesh: the motion of a vertex and its neighbours in space, as
/// one view sees it.
class CarriedWarp {
 public:
  explicit CarriedWarp(const TriangleMesh& rest);

  /// Warp of the view's image around a vertex from rest to `positions`; the identity where the view
  /// cannot see it.
  SubsetWarp of(int vertex, const Points3& positions, const CameraView& view) const;

  /// What vectors along the mesh at rest become; vectors across it become zero.
  Mat3 gradient(int vertex, const Points3& positions) const;

 private:
  /// The tangents at rest, orthonormal, and what they become; false where the mesh has no area.
  bool carry(int vertex, const Points3& positions, Eigen::Matrix<double, 3, 2>& tangents,
             Eigen::Matrix<double, 3, 2>& carried) const;

  Points3 rest_;
  std::vector<std::vector<int>> neighbours_;
};

/// For each vertex those that share a triangle with it, ascending.
std::vector<std::vector<int>> vertexNeighbours(const TriangleMesh& mesh);

}  // namespace tenter
