// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Sparse>
#include <memory>
#include <vector>

#include "tenter/core/mesh.h"

namespace tenter {

/// Moves a shell along a displacement that may turn its triangles far without stretching them. Each
/// triangle's displacement gradient is split into a strain and a rotation, the rotation is carried
/// out as one, and the triangles are joined again by least squares (a Poisson problem). To first
/// order this is adding the displacement; the stretch that adding it makes of a rotation, of second
/// order, is left out. The joining weighs triangles as they lie in `mesh`.
class TurningPath {
 public:
  /// @param fixed  vertices that move by the displacement exactly.
  TurningPath(const TriangleMesh& mesh, const std::vector<int>& fixed);

  /// `from` moved by `displacement` (both 3 x vertices).
  Points3 moved(const Points3& from, const Points3& displacement) const;

 private:
  struct Corner {
    double area;
    Eigen::Matrix<double, 2, 3> slopes;  ///< Of the shape functions in the mesh's triangle.
    Mat2 inverse_edges;
  };
  std::vector<Triangle> triangles_;
  std::vector<Corner> corners_;
  std::vector<int> column_of_;  ///< Of each vertex; -1 where it is held.
  int free_count_ = 0;
  std::shared_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> laplacian_;
};

}  // namespace tenter
