// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/turning_path.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <cmath>

namespace tenter {
namespace {

/// Of a triangle's corner: below this its normal is rounding.
constexpr double kLeastSine = 1e-12;

/// The triangle's edges after the rotation and strain that the displacement of its edges means; one
/// without an area is only displaced.
Eigen::Matrix<double, 3, 2> turnedEdges(const Eigen::Matrix<double, 3, 2>& edges,
                                        const Eigen::Matrix<double, 3, 2>& change) {
  const double doubled_area = edges.col(0).cross(edges.col(1)).norm();
  if (!(doubled_area > kLeastSine * edges.col(0).norm() * edges.col(1).norm()))
    return edges + change;
  Mat3 frame;
  frame.col(0) = edges.col(0).normalized();
  frame.col(2) = edges.col(0).cross(edges.col(1)).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  const Eigen::Matrix<double, 3, 2> local = frame.transpose() * edges;
  // The gradient in the triangle's axes; its normal turns with it.
  Mat3 gradient = Mat3::Zero();
  gradient.leftCols<2>() = frame.transpose() * change * local.topRows<2>().inverse();
  gradient(0, 2) = -gradient(2, 0);
  gradient(1, 2) = -gradient(2, 1);
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  const Vec3 turn(0.5 * (gradient(2, 1) - gradient(1, 2)), 0.5 * (gradient(0, 2) - gradient(2, 0)),
                  0.5 * (gradient(1, 0) - gradient(0, 1)));
  const double angle = turn.norm();
  Eigen::Matrix<double, 3, 2> out = local + strain * local;
  if (angle > 0.0) out = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * out;
  return frame * out;
}

}  // namespace

TurningPath::TurningPath(const TriangleMesh& mesh, const std::vector<int>& fixed)
    : triangles_(mesh.triangles),
      column_of_(static_cast<std::size_t>(mesh.vertexCount()), 0),
      laplacian_(std::make_shared<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>()) {
  for (const int v : fixed) column_of_[static_cast<std::size_t>(v)] = -1;
  if (fixed.empty()) column_of_[0] = -1;
  for (int& column : column_of_)
    if (column >= 0) column = free_count_++;
  std::vector<Eigen::Triplet<double>> entries;
  for (const Triangle& t : triangles_) {
    const Vec3 a = mesh.positions.col(t[1]) - mesh.positions.col(t[0]);
    const Vec3 b = mesh.positions.col(t[2]) - mesh.positions.col(t[0]);
    const double length = a.norm(), along = b.dot(a) / length;
    Mat2 edges;
    edges << length, along, 0.0, a.cross(b).norm() / length;
    Corner c;
    c.area = 0.5 * edges.determinant();
    c.inverse_edges = edges.inverse();
    c.slopes.col(1) = c.inverse_edges.row(0);
    c.slopes.col(2) = c.inverse_edges.row(1);
    c.slopes.col(0) = -c.slopes.col(1) - c.slopes.col(2);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const int row = column_of_[static_cast<std::size_t>(t[i])];
        const int column = column_of_[static_cast<std::size_t>(t[j])];
        if (row >= 0 && column >= 0)
          entries.emplace_back(row, column, c.area * c.slopes.col(i).dot(c.slopes.col(j)));
      }
    }
    corners_.push_back(c);
  }
  Eigen::SparseMatrix<double> matrix(free_count_, free_count_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  laplacian_->compute(matrix);
  if (laplacian_->info() != Eigen::Success) free_count_ = 0;  // a piece that nothing holds
}

Points3 TurningPath::moved(const Points3& from, const Points3& displacement) const {
  Points3 out = from + displacement;
  if (free_count_ == 0) return out;
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(free_count_, 3);
  for (std::size_t k = 0; k < triangles_.size(); ++k) {
    const Triangle& t = triangles_[k];
    const Corner& c = corners_[k];
    Eigen::Matrix<double, 3, 2> edges, change;
    for (int e = 0; e < 2; ++e) {
      edges.col(e) = from.col(t[e + 1]) - from.col(t[0]);
      change.col(e) = displacement.col(t[e + 1]) - displacement.col(t[0]);
    }
    // What the joined triangles' gradient misses where displaced vertices only are given.
    const Eigen::Matrix<double, 3, 2> wanted =
        (turnedEdges(edges, change) - edges - change) * c.inverse_edges;
    for (int i = 0; i < 3; ++i) {
      const int row = column_of_[static_cast<std::size_t>(t[i])];
      if (row >= 0) rhs.row(row) += c.area * (wanted * c.slopes.col(i)).transpose();
    }
  }
  const Eigen::MatrixXd correction = laplacian_->solve(rhs);
  for (std::size_t v = 0; v < column_of_.size(); ++v)
    if (column_of_[v] >= 0)
      out.col(static_cast<Eigen::Index>(v)) += correction.row(column_of_[v]).transpose();
  return out;
}

}  // namespace tenter
