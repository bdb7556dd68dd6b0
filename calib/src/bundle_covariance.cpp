// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Eigenvalues>
#include <Eigen/Sparse>
#include <cmath>

#include "bundle_problem.h"

namespace tenter {

namespace {

/// Relative eigenvalue of the scaled information below which a direction counts as not seen.
constexpr double kUnseen = 1e-13;

/// d(small rotation on the left)/d(rotation vector): the left Jacobian of SO(3).
Mat3 leftJacobian(const Vec3& w) {
  const double angle = w.norm();
  Mat3 cross;
  cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  if (angle < 1e-8) return Mat3::Identity() + 0.5 * cross;
  const double a2 = angle * angle;
  return Mat3::Identity() + (1.0 - std::cos(angle)) / a2 * cross +
         (angle - std::sin(angle)) / (a2 * angle) * cross * cross;
}

/// Blocks whose covariance is wanted, in the order of BundleCovariance, and how many numbers.
std::vector<double*> wantedBlocks(Bundle& bundle, const BundleOptions& options, int& size) {
  std::vector<double*> blocks;
  size = 0;
  for (std::size_t camera = 0; camera < bundle.lenses.size(); ++camera) {
    blocks.push_back(bundle.lenses[camera].data());
    size += kLensTerms;
    if (camera == 0) continue;
    blocks.push_back(bundle.cameras[camera].data());
    size += 6;
  }
  if (options.fit_warp) {
    blocks.push_back(bundle.warp_m.data());
    size += 2;
  }
  if (options.rig_set >= 0) {
    blocks.push_back(bundle.boards[options.rig_set].data());
    size += 6;
  }
  return blocks;
}

Eigen::MatrixXd information(ceres::Problem& problem, const std::vector<double*>& blocks) {
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = blocks;
  ceres::CRSMatrix crs;
  problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &crs);
  using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  const Eigen::Map<const Rows> jacobian(crs.num_rows, crs.num_cols,
                                        static_cast<Eigen::Index>(crs.values.size()),
                                        crs.rows.data(), crs.cols.data(), crs.values.data());
  const Rows product = Rows(jacobian.transpose()) * jacobian;
  return product.toDense();
}

/// Inverse of a symmetric matrix whose units differ from row to row; empty if it is singular.
Eigen::MatrixXd scaledInverse(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd diagonal = matrix.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return {};
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * matrix *
                                                              scale.asDiagonal());
  const Eigen::VectorXd& values = solver.eigenvalues();
  if (!(values.minCoeff() > kUnseen * values.maxCoeff())) return {};
  const Eigen::MatrixXd& vectors = solver.eigenvectors();
  return scale.asDiagonal() * vectors * values.cwiseInverse().asDiagonal() * vectors.transpose() *
         scale.asDiagonal();
}

/// Poses as small rotations on the left in the place of rotation vectors.
void turnIntoSmallRotations(const Bundle& bundle, const BundleOptions& options,
                            Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd change = Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  for (std::size_t camera = 1; camera < bundle.cameras.size(); ++camera) {
    const auto at =
        static_cast<Eigen::Index>(kLensTerms + (camera - 1) * (kLensTerms + 6) + kLensTerms);
    change.block<3, 3>(at, at) = leftJacobian(bundle.cameras[camera].head<3>());
  }
  if (options.rig_set >= 0) {
    const Eigen::Index at = covariance.rows() - 6;
    change.block<3, 3>(at, at) = leftJacobian(bundle.boards[options.rig_set].head<3>());
  }
  covariance = change * covariance * change.transpose();
}

}  // namespace

BundleCovariance bundleCovariance(Bundle& bundle, const BundleOptions& options) {
  BundleCovariance out;
  const auto problem = bundleProblem(bundle, options);
  int wanted = 0;
  std::vector<double*> blocks = wantedBlocks(bundle, options, wanted);
  for (int set = 0; set < static_cast<int>(bundle.boards.size()); ++set) {
    double* board = bundle.boards[set].data();
    if (set != options.rig_set && problem->HasParameterBlock(board)) blocks.push_back(board);
  }
  const Eigen::MatrixXd inverse = scaledInverse(information(*problem, blocks));
  double squares = 0.0, numbers = 0.0;
  for (const BundleImage& image : bundle.images) {
    squares += bundle.residuals(image).squaredNorm();
    numbers += static_cast<double>(image.corners.pixels.size());
  }
  out.observable = inverse.size() > 0 && numbers > static_cast<double>(inverse.rows());
  if (!out.observable) return out;
  out.noise_px = std::sqrt(squares / (numbers - static_cast<double>(inverse.rows())));
  out.matrix = out.noise_px * out.noise_px * inverse.topLeftCorner(wanted, wanted);
  turnIntoSmallRotations(bundle, options, out.matrix);
  return out;
}

}  // namespace tenter
