// SPDX-License-Identifier: GPL-3.0-or-later
#include "carried_warp.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>

namespace tenter {

namespace {

/// Determinant of what a view makes of the tangents, over their square: below it they are seen from
/// the edge.
constexpr double kLeastArea = 0.05;

}  // namespace

std::vector<std::vector<int>> vertexNeighbours(const TriangleMesh& mesh) {
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(mesh.vertexCount()));
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      neighbours[triangle[k]].push_back(triangle[(k + 1) % 3]);
      neighbours[triangle[k]].push_back(triangle[(k + 2) % 3]);
    }
  }
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return neighbours;
}

CarriedWarp::CarriedWarp(const TriangleMesh& rest)
    : rest_(rest.positions), neighbours_(vertexNeighbours(rest)) {}

bool CarriedWarp::carry(int vertex, const Points3& positions, Eigen::Matrix<double, 3, 2>& tangents,
                        Eigen::Matrix<double, 3, 2>& carried) const {
  Mat3 squares = Mat3::Zero(), products = Mat3::Zero();
  for (const int other : neighbours_[vertex]) {
    const Vec3 edge = rest_.col(other) - rest_.col(vertex);
    squares += edge * edge.transpose();
    products += (positions.col(other) - positions.col(vertex)) * edge.transpose();
  }
  // The two directions in which the neighbours spread are the tangents.
  const Eigen::SelfAdjointEigenSolver<Mat3> spread(squares);
  tangents = spread.eigenvectors().rightCols<2>();
  const Vec2 extents = spread.eigenvalues().tail<2>();
  if (!(extents.minCoeff() > 0.0)) return false;
  carried = products * tangents * extents.cwiseInverse().asDiagonal();
  return true;
}

Mat3 CarriedWarp::gradient(int vertex, const Points3& positions) const {
  Eigen::Matrix<double, 3, 2> tangents, carried;
  if (!carry(vertex, positions, tangents, carried)) return Mat3::Zero();
  return carried * tangents.transpose();
}

SubsetWarp CarriedWarp::of(int vertex, const Points3& positions, const CameraView& view) const {
  const Vec3 before = rest_.col(vertex), after = positions.col(vertex);
  Eigen::Matrix<double, 2, 3> jacobian_before, jacobian_after;
  const auto pixel_before = view.project(before, &jacobian_before);
  const auto pixel_after = view.project(after, &jacobian_after);
  if (!pixel_before || !pixel_after) return {};
  const Vec2 motion = *pixel_after - *pixel_before;
  Eigen::Matrix<double, 3, 2> tangents, carried;
  if (!carry(vertex, positions, tangents, carried)) return SubsetWarp::translation(motion);
  const Mat2 seen_before = jacobian_before * tangents;
  if (std::abs(seen_before.determinant()) < kLeastArea * seen_before.squaredNorm()) {
    return SubsetWarp::translation(motion);
  }
  return SubsetWarp::affine(motion, jacobian_after * carried * seen_before.inverse());
}

}  // namespace tenter
