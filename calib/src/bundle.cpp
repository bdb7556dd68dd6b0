// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundle.h"

#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bundle_problem.h"
#include "lens_equations.h"

namespace tenter {

namespace {

/// Rows: x [m], y [m], and the two shapes of the warp there.
using CornerData = Eigen::Vector4d;

CornerData cornerData(const Points3& board_m, int id) {
  const Vec2 half =
      0.5 * (board_m.topRows<2>().rowwise().maxCoeff() + board_m.topRows<2>().rowwise().minCoeff());
  const Vec2 point = board_m.col(id).head<2>();
  const Vec2 relative = (point - half).cwiseQuotient(half.cwiseMax(1e-12));
  return {point.x(), point.y(), 1.0 - relative.x() * relative.x(),
          1.0 - relative.y() * relative.y()};
}

template <class T>
bool projectCorner(const CornerData& corner, const T* lens, const T* camera, const T* board,
                   const T* warp, T* pixel) {
  const T point[3] = {T(corner[0]), T(corner[1]), warp[0] * corner[2] + warp[1] * corner[3]};
  T world[3], seen[3];
  ceres::AngleAxisRotatePoint(board, point, world);
  for (int i = 0; i < 3; ++i) world[i] += board[3 + i];
  ceres::AngleAxisRotatePoint(camera, world, seen);
  for (int i = 0; i < 3; ++i) seen[i] += camera[3 + i];
  if (!(seen[2] > T(1e-6))) return false;
  T x, y;
  lens_equations::distort<false>(lens + 4, T(seen[0] / seen[2]), T(seen[1] / seen[2]), x, y);
  pixel[0] = lens[0] * x + lens[2];
  pixel[1] = lens[1] * y + lens[3];
  return true;
}

struct CornerError {
  CornerData corner;
  Vec2 seen;
  template <class T>
  bool operator()(const T* lens, const T* camera, const T* board, const T* warp,
                  T* residual) const {
    if (!projectCorner(corner, lens, camera, board, warp, residual)) return false;
    residual[0] -= seen.x();
    residual[1] -= seen.y();
    return true;
  }
};

ceres::LossFunction* lossOf(const BundleOptions& options) {
  if (options.loss_px <= 0.0) return nullptr;
  if (options.heavy) return new ceres::CauchyLoss(options.loss_px);
  return new ceres::HuberLoss(options.loss_px);
}

/// Standard deviation of Gaussian noise that has this median of absolute residuals.
double medianNoise(const Bundle& bundle) {
  std::vector<double> sizes;
  for (const BundleImage& image : bundle.images) {
    const Points2 residuals = bundle.residuals(image);
    for (const double value : residuals.reshaped()) {
      if (std::isfinite(value)) sizes.push_back(std::abs(value));
    }
  }
  if (sizes.empty()) return 0.0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  constexpr double kGaussian = 1.4826;
  return kGaussian * *middle;
}

}  // namespace

PoseVector poseVector(const Eigen::Isometry3d& pose) {
  const Mat3 rotation = pose.linear();
  PoseVector vector;
  ceres::RotationMatrixToAngleAxis(rotation.data(), vector.data());
  vector.tail<3>() = pose.translation();
  return vector;
}

Eigen::Isometry3d poseOf(const PoseVector& vector) {
  Mat3 rotation;
  ceres::AngleAxisToRotationMatrix(vector.data(), rotation.data());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation;
  pose.translation() = vector.tail<3>();
  return pose;
}

Lens lensOf(const LensVector& vector) {
  Lens lens{vector[0], vector[1], vector[2], vector[3], {}};
  for (int i = 0; i < kLensTerms - 4; ++i) lens.distortion[i] = vector[4 + i];
  return lens;
}

Points3 Bundle::warpedBoard() const {
  Points3 warped = board_m;
  for (int i = 0; i < board_m.cols(); ++i) {
    warped(2, i) = warp_m.dot(cornerData(board_m, i).tail<2>());
  }
  return warped;
}

Points2 Bundle::residuals(const BundleImage& image) const {
  Points2 out(2, image.corners.pixels.cols());
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    Vec2 pixel;
    const bool before = projectCorner(cornerData(board_m, image.corners.ids[i]),
                                      lenses[image.camera].data(), cameras[image.camera].data(),
                                      boards[image.set].data(), warp_m.data(), pixel.data());
    if (!before) pixel.setConstant(std::numeric_limits<double>::quiet_NaN());
    out.col(i) = pixel - image.corners.pixels.col(i);
  }
  return out;
}

std::unique_ptr<ceres::Problem> bundleProblem(Bundle& bundle, const BundleOptions& options) {
  auto problem = std::make_unique<ceres::Problem>();
  ceres::LossFunction* loss = lossOf(options);
  for (const BundleImage& image : bundle.images) {
    for (Eigen::Index i = 0; i < image.corners.pixels.cols(); ++i) {
      auto* cost =
          new ceres::AutoDiffCostFunction<CornerError, 2, kLensTerms, 6, 6, 2>(new CornerError{
              cornerData(bundle.board_m, image.corners.ids[i]), image.corners.pixels.col(i)});
      problem->AddResidualBlock(cost, loss, bundle.lenses[image.camera].data(),
                                bundle.cameras[image.camera].data(),
                                bundle.boards[image.set].data(), bundle.warp_m.data());
    }
  }
  const auto hold = [&](double* block, bool held) {
    if (held && problem->HasParameterBlock(block)) problem->SetParameterBlockConstant(block);
  };
  for (std::size_t camera = 0; camera < bundle.lenses.size(); ++camera) {
    hold(bundle.lenses[camera].data(), !options.fit_lenses);
    hold(bundle.cameras[camera].data(), camera == 0 || !options.fit_cameras);
  }
  hold(bundle.warp_m.data(), !options.fit_warp);
  return problem;
}

bool solveBundle(Bundle& bundle, const BundleOptions& options) {
  if (bundle.images.empty()) return false;
  const auto problem = bundleProblem(bundle, options);
  ceres::Solver::Options solver;
  solver.logging_type = ceres::SILENT;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-12;
  solver.parameter_tolerance = 1e-12;
  solver.gradient_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, problem.get(), &summary);
  return summary.termination_type == ceres::CONVERGENCE;
}

double solveRobustly(Bundle& bundle, const BundleOptions& options, double first_loss_px) {
  constexpr double kSigmas = 3.0, kLeastNoise_px = 0.01;
  BundleOptions stage = options;
  stage.heavy = true;
  stage.loss_px = first_loss_px;
  solveBundle(bundle, stage);
  double noise = medianNoise(bundle);
  for (int pass = 0; pass < 2; ++pass) {
    stage.loss_px = std::min(first_loss_px, kSigmas * std::max(noise, kLeastNoise_px));
    solveBundle(bundle, stage);
    noise = medianNoise(bundle);
  }
  return noise;
}

double rmsOf(const Bundle& bundle, const BundleImage& image) {
  const double mean = bundle.residuals(image).colwise().squaredNorm().mean();
  return std::isfinite(mean) ? std::sqrt(mean) : std::numeric_limits<double>::infinity();
}

double rmsOf(const Bundle& bundle, const std::function<bool(const BundleImage&)>& wanted) {
  double sum = 0.0;
  Eigen::Index corners = 0;
  for (const BundleImage& image : bundle.images) {
    if (!wanted(image)) continue;
    sum += bundle.residuals(image).squaredNorm();
    corners += image.corners.pixels.cols();
  }
  return corners > 0 ? std::sqrt(sum / static_cast<double>(corners)) : 0.0;
}

}  // namespace tenter
