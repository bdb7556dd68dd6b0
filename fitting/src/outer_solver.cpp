// SPDX-License-Identifier: GPL-3.0-or-later
#include "outer_solver.h"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace tenter {
namespace {

/// Below this sum of squares per residual the data are met to rounding; relative progress means
/// nothing any more.
constexpr double kRoundingCost = 1e-18;
/// A first guess may be far off; that is not noise in which a belief would be measured.
constexpr double kLargestMisfit = 100.0;
/// Smallest relative change of z that is worth another set of equilibria.
constexpr double kParameterTolerance = 1e-9;
/// Two steps in a row that gain less than this share of the cost, or one and then a rejection, mean
/// that what is left are jumps between shapes: a smooth sum of squares converges quadratically.
constexpr double kStalledGain = 1e-3;

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Hands over what the evaluator computed for one frame at the point being evaluated.
class FrameCost final : public ceres::CostFunction {
 public:
  FrameCost(const FrameEvaluator& evaluator, int index, const bool& ok)
      : evaluator_(evaluator), index_(index), ok_(ok) {
    mutable_parameter_block_sizes()->push_back(evaluator.space().size());
    set_num_residuals(evaluator.blockRows(index));
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (!ok_) return false;
    const FrameBlock& block = evaluator_.blocks()[index_];
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = block.residuals;
    if (jacobians && jacobians[0])
      Eigen::Map<RowMajor>(jacobians[0], num_residuals(), block.jacobian.cols()) = block.jacobian;
    return true;
  }

 private:
  const FrameEvaluator& evaluator_;
  int index_;
  const bool& ok_;
};

class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(Prior prior) : prior_(std::move(prior)) {
    mutable_parameter_block_sizes()->push_back(static_cast<int>(prior_.matrix.cols()));
    set_num_residuals(static_cast<int>(prior_.matrix.rows()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::VectorXd> z(parameters[0], prior_.matrix.cols());
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = prior_.matrix * z - prior_.offset;
    if (jacobians && jacobians[0])
      Eigen::Map<RowMajor>(jacobians[0], num_residuals(), z.size()) = prior_.matrix;
    return true;
  }

 private:
  Prior prior_;
};

/// Between Ceres and the evaluator: solves the equilibria of a point before its residuals are asked
/// for, and makes them the warm start once the point is accepted.
class Driver final : public ceres::EvaluationCallback, public ceres::IterationCallback {
 public:
  Driver(FrameEvaluator& evaluator, const OuterOptions& options, OuterSummary& summary)
      : evaluator_(evaluator), options_(options), summary_(summary), trial_(summary.z) {}

  double* parameters() { return trial_.data(); }
  const bool& ok() const { return ok_; }

  void PrepareForEvaluation(bool /*evaluate_jacobians*/, bool /*new_point*/) override {
    ok_ = evaluator_.evaluate(trial_);
    if (!ok_) ++summary_.failed_points;
    evaluated_ = trial_;
  }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& iteration) override {
    const bool accepted = iteration.iteration == 0 || iteration.step_is_successful;
    if (accepted) {
      accept(iteration.iteration);
      summary_.radius = iteration.trust_region_radius;
    }
    rejected_ = accepted ? 0 : rejected_ + 1;
    failed_in_a_row_ = ok_ ? 0 : failed_in_a_row_ + 1;
    const bool stalled = rejected_ >= options_.max_rejected_steps ||
                         (!accepted && gain_ < kStalledGain) ||
                         (gain_ < kStalledGain && previous_gain_ < kStalledGain);
    summary_.blocked = rejected_ >= options_.max_rejected_steps && failed_in_a_row_ >= rejected_;
    summary_.iterations = iteration.iteration;
    if (options_.progress) options_.progress(iteration.iteration, summary_.cost);
    if (evaluator_.cancelled()) return ceres::SOLVER_ABORT;
    const bool exact =
        2.0 * summary_.cost < kRoundingCost * static_cast<double>(evaluator_.blocks().size());
    if (exact || stalled) {
      summary_.converged = !summary_.blocked;
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    }
    return ceres::SOLVER_CONTINUE;
  }

 private:
  void accept(int iteration) {
    evaluator_.accept();
    summary_.z = evaluated_;
    const double cost = evaluator_.cost();
    previous_gain_ = gain_;
    gain_ = iteration == 0 ? 1.0 : (summary_.cost - cost) / summary_.cost;
    summary_.cost = cost;
    if (iteration == 0) summary_.initial_cost = summary_.cost;
    summary_.usable = true;
  }

  FrameEvaluator& evaluator_;
  const OuterOptions& options_;
  OuterSummary& summary_;
  Eigen::VectorXd trial_, evaluated_;
  bool ok_ = false;
  int rejected_ = 0;
  int failed_in_a_row_ = 0;  ///< Of those rejected, for want of an equilibrium.
  /// Of the last two accepted steps, as a share of the cost before each.
  double gain_ = 1.0, previous_gain_ = 1.0;
};

ceres::Solver::Options solverOptions(const OuterOptions& options, int threads, Driver& driver) {
  ceres::Solver::Options ceres_options;
  ceres_options.linear_solver_type = ceres::DENSE_QR;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.function_tolerance = options.relative_tolerance;
  ceres_options.gradient_tolerance = 0.0;
  ceres_options.initial_trust_region_radius = options.first_radius;
  ceres_options.parameter_tolerance = kParameterTolerance;
  // Ceres would search along the projected step and, having found a tenth of it acceptable, make
  // the next one longer: where longer steps lose equilibria every step is searched for anew, at the
  // price of several sets of equilibria. The trust region remembers.
  ceres_options.max_num_line_search_step_size_iterations = 0;
  ceres_options.num_threads = threads;
  ceres_options.logging_type = ceres::SILENT;
  ceres_options.callbacks.push_back(&driver);
  return ceres_options;
}

}  // namespace

Prior weakPrior(const FitSpace& space, double misfit) {
  const int n = space.size();
  Prior prior{Eigen::MatrixXd::Zero(2 * n, n), Eigen::VectorXd::Zero(2 * n)};
  prior.matrix.topRows(n).setIdentity();
  for (const int g : space.groups()) {
    const ParameterGroup& group = space.state().groups[g];
    const int begin = space.offset(g), count = group.basis->size();
    prior.offset.segment(begin, count).setConstant(group.belief / group.reference);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(group.basis->roughness());
    const Eigen::VectorXd root = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    prior.matrix.block(n + begin, begin, count, count) =
        root.asDiagonal() * eigen.eigenvectors().transpose();
  }
  const double weight = std::sqrt(std::min(misfit, kLargestMisfit)) / kPriorRelativeStd;
  prior.matrix *= weight;
  prior.offset *= weight;
  return prior;
}

OuterSummary solveOuter(FrameEvaluator& evaluator, const Eigen::VectorXd& start,
                        const OuterOptions& options) {
  OuterSummary summary;
  summary.z = start;
  Driver driver(evaluator, options, summary);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &driver;
  ceres::Problem problem(problem_options);
  double* z = driver.parameters();
  const int n = static_cast<int>(start.size());
  problem.AddParameterBlock(z, n);
  const Eigen::VectorXd lower = evaluator.space().lowerBounds();
  for (int i = 0; i < n; ++i)
    if (std::isfinite(lower[i])) problem.SetParameterLowerBound(z, i, lower[i]);
  for (int i = 0; i < static_cast<int>(evaluator.frames().size()); ++i)
    problem.AddResidualBlock(new FrameCost(evaluator, i, driver.ok()), nullptr, z);
  problem.AddResidualBlock(new PriorCost(weakPrior(evaluator.space(), options.misfit)), nullptr, z);

  ceres::Solver::Summary report;
  ceres::Solve(solverOptions(options, evaluator.threads(), driver), &problem, &report);
  summary.converged = summary.usable && !summary.blocked && !evaluator.cancelled() &&
                      (summary.converged || report.termination_type == ceres::CONVERGENCE);
  return summary;
}

}  // namespace tenter
