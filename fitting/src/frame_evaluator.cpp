// SPDX-License-Identifier: GPL-3.0-or-later
#include "frame_evaluator.h"

#include <Eigen/QR>
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <numeric>
#include <set>
#include <thread>
#include <utility>

namespace tenter {
namespace {

/// Rows beyond these carry no information about z.
void compress(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian) {
  const auto columns = jacobian.cols() + 1;
  if (jacobian.rows() <= columns) return;
  Eigen::MatrixXd joined(jacobian.rows(), columns);
  joined << jacobian, residuals;
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(joined);
  const Eigen::MatrixXd upper = joined.topRows(columns).triangularView<Eigen::Upper>();
  jacobian = upper.leftCols(columns - 1);
  residuals = upper.col(columns - 1);
}

/// Solved in vain; frames that did not come to their turn have taken no step.
bool isLost(const FrameOutcome& outcome) { return !outcome.converged && outcome.newton_steps > 0; }

}  // namespace

void parallelFor(int count, int threads, const std::function<void(int)>& work,
                 const std::function<bool()>& stop) {
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run = [&] {
    try {
      for (int i = next++; i < count && !(stop && stop()); i = next++) work(i);
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int t = 1; t < std::min(threads, count); ++t) helpers.emplace_back(run);
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

FrameEvaluator::FrameEvaluator(std::vector<FitTest*> tests, int threads,
                               std::function<bool()> cancelled)
    : tests_(std::move(tests)), threads_(threads) {
  cancelWhen(std::move(cancelled));
}

void FrameEvaluator::cancelWhen(std::function<bool()> cancelled) {
  cancelled_ = std::move(cancelled);
  for (FitTest* test : tests_) test->cancelWhen(cancelled_);
}

void FrameEvaluator::configure(std::shared_ptr<const FitSpace> space, std::vector<FrameId> frames) {
  space_ = std::move(space);
  frames_ = std::move(frames);
  ties_ = space_->ties();
  blocks_.assign(frames_.size(), {});
  order_.resize(frames_.size());
  std::iota(order_.begin(), order_.end(), 0);
  valid_ = false;
  failed_point_.resize(0);
}

int FrameEvaluator::rawResidualCount(int test) const {
  int count = 0;
  for (const FrameId& id : frames_)
    if (id.test == test) count += tests_[test]->residualCount(id.frame);
  return count;
}

int FrameEvaluator::blockRows(int index) const {
  const FrameId& id = frames_[index];
  return std::min(tests_[id.test]->residualCount(id.frame), space_->size() + 1);
}

void FrameEvaluator::evaluateFrame(int index) {
  const FrameId& id = frames_[index];
  FrameBlock& block = blocks_[index];
  Eigen::MatrixXd by_parameter;
  block.outcome = tests_[id.test]->evaluate(id.frame, block.residuals, &by_parameter);
  // A saddle has no derivatives that a fit could follow.
  if (!block.outcome.stable) block.outcome.converged = false;
  if (!block.outcome.converged) return;
  if (!block.residuals.allFinite() || !by_parameter.allFinite()) {
    block.outcome.converged = false;
    block.outcome.problem = "residuals are not finite";
    return;
  }
  block.jacobian.noalias() = by_parameter * ties_;
  compress(block.residuals, block.jacobian);
}

bool FrameEvaluator::evaluate(const Eigen::VectorXd& z, bool stop_at_failure) {
  if (valid_ && z == point_) return true;
  if (stop_at_failure && failed_point_.size() == z.size() && failed_point_ == z) return false;
  valid_ = false;
  std::set<int> used;
  for (const FrameId& id : frames_) used.insert(id.test);
  const ParameterSet parameters = space_->parameters(z);
  for (const int t : used) tests_[t]->setParameters(parameters);
  for (FrameBlock& block : blocks_) block.outcome = {};
  std::atomic<bool> failed{false};
  parallelFor(
      static_cast<int>(frames_.size()), threads_,
      [&](int k) {
        const int i = order_[k];
        evaluateFrame(i);
        if (!blocks_[i].outcome.converged) failed = true;
      },
      [&] { return (failed && stop_at_failure) || cancelled(); });
  for (const FrameBlock& block : blocks_) {
    counts_.evaluations += block.outcome.factorizations > 0 || block.outcome.converged;
    counts_.newton_steps += block.outcome.newton_steps;
    counts_.factorizations += block.outcome.factorizations;
  }
  if (cancelled()) return false;  // what failed may only have been stopped
  if (failed) {
    ++counts_.failures;
    failed_point_ = z;
    // The next trial point, if it fails too, is likely to fail at the same frames.
    std::stable_partition(order_.begin(), order_.end(),
                          [&](int i) { return isLost(blocks_[i].outcome); });
  }
  if (failed) return false;
  point_ = z;
  valid_ = true;
  return true;
}

void FrameEvaluator::requireProof(bool required) {
  for (FitTest* test : tests_) test->requireProof(required);
  valid_ = false;
  failed_point_.resize(0);
}

void FrameEvaluator::accept() {
  failed_point_.resize(0);
  for (FitTest* test : tests_) test->accept();
}

int FrameEvaluator::dropFailing(const Eigen::VectorXd& z) {
  if (evaluate(z, false) || cancelled()) return 0;
  std::vector<FrameId> kept;
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (blocks_[i].outcome.converged) kept.push_back(frames_[i]);
  const int dropped = static_cast<int>(frames_.size() - kept.size());
  configure(space_, std::move(kept));
  return dropped;
}

int FrameEvaluator::adoptNearerShapes() {
  std::atomic<int> adopted{0};
  parallelFor(
      static_cast<int>(frames_.size()), threads_,
      [&](int i) { adopted += tests_[frames_[i].test]->adoptNearerShape(frames_[i].frame); },
      [&] { return cancelled(); });
  if (adopted > 0) valid_ = false;
  return adopted;
}

double FrameEvaluator::cost() const {
  double sum = 0.0;
  for (const FrameBlock& block : blocks_) sum += block.residuals.squaredNorm();
  return 0.5 * sum;
}

double FrameEvaluator::cost(int test) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (frames_[i].test == test) sum += blocks_[i].residuals.squaredNorm();
  return 0.5 * sum;
}

}  // namespace tenter
