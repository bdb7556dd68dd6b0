// SPDX-License-Identifier: GPL-3.0-or-later
#include "displacement_fill.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "carried_warp.h"

namespace tenter {

DisplacementFill::DisplacementFill(const TriangleMesh& rest)
    : rest_(rest.positions), neighbours_(vertexNeighbours(rest)) {}

double DisplacementFill::complete(ClothFrame& frame, const Points3& last) const {
  std::vector<int> row(frame.states.size(), -1), unknown;
  for (int i = 0; i < static_cast<int>(row.size()); ++i) {
    if (frame.states[i] == PointState::kValid) continue;
    row[i] = static_cast<int>(unknown.size());
    unknown.push_back(i);
  }
  if (unknown.empty()) return 0.0;
  if (unknown.size() == row.size()) {
    frame.positions_m = last;
    return 0.0;
  }
  std::vector<Eigen::Triplet<double>> entries;
  const auto count = static_cast<Eigen::Index>(unknown.size());
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int vertex = unknown[k];
    const auto& around = neighbours_[vertex];
    entries.emplace_back(k, k, static_cast<double>(around.size()));
    for (const int other : around) {
      if (row[other] >= 0) {
        entries.emplace_back(k, row[other], -1.0);
      } else {
        right.row(k) += (frame.positions_m.col(other) - rest_.col(other)).transpose();
      }
    }
  }
  Eigen::SparseMatrix<double> laplacian(count, count);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(laplacian);
  const Eigen::MatrixX3d moved = factor.solve(right);
  double farthest = 0.0;
  for (Eigen::Index k = 0; k < count; ++k) {
    const int vertex = unknown[k];
    frame.positions_m.col(vertex) = rest_.col(vertex) + moved.row(k).transpose();
    farthest = std::max(farthest, (frame.positions_m.col(vertex) - last.col(vertex)).norm());
  }
  return farthest;
}

}  // namespace tenter
