// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fit_space.h"
#include "tenter/fitting/fit_test.h"

namespace tenter {

struct FrameId {
  int test = 0, frame = 0;
};

/// Residuals and derivatives of one frame in z. With more residuals than entries of z they are
/// replaced by the triangular factor of [J r]: the same sum of squares, the same J^T J and J^T r,
/// in at most size + 1 rows.
struct FrameBlock {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  FrameOutcome outcome;
};

/// What equilibrium solves have cost so far.
struct SolveCounts {
  long evaluations = 0, newton_steps = 0, factorizations = 0, failures = 0;
};

/// Evaluates chosen frames of several tests at a point z, in parallel, each point once.
class FrameEvaluator {
 public:
  FrameEvaluator(std::vector<FitTest*> tests, int threads, std::function<bool()> cancelled);

  /// From here on these frames in this space; what was evaluated before is void.
  void configure(std::shared_ptr<const FitSpace> space, std::vector<FrameId> frames);
  const FitSpace& space() const { return *space_; }
  const std::vector<FrameId>& frames() const { return frames_; }
  const std::vector<FitTest*>& tests() const { return tests_; }
  int rawResidualCount(int test) const;  ///< Of the chosen frames of a test, before compression.
  int blockRows(int index) const;

  /// All chosen frames; false if one has no equilibrium there (or the run was cancelled), then the
  /// rest may be missing. Frames that failed last are tried first, and a point that failed is not
  /// tried again from the same warm starts.
  bool evaluate(const Eigen::VectorXd& z, bool stop_at_failure = true);
  /// The point evaluated last becomes the warm start of the next ones.
  void accept();
  /// Frames that have no equilibrium at z even from the measured shape are left out. Returns how
  /// many.
  int dropFailing(const Eigen::VectorXd& z);

  /// Frames that lie nearer to the measurement in another stable shape change over to it. Returns
  /// how many; the point must then be evaluated again.
  int adoptNearerShapes();

  const std::vector<FrameBlock>& blocks() const { return blocks_; }
  double cost() const;  ///< Half the sum of squares at the point evaluated last.
  double cost(int test) const;
  bool cancelled() const { return cancelled_ && cancelled_(); }
  /// From here on another reason to stop, also within an equilibrium; empty: none.
  void cancelWhen(std::function<bool()> cancelled);
  /// Of all tests (FitTest::requireProof).
  void requireProof(bool required);
  const SolveCounts& counts() const { return counts_; }
  int threads() const { return threads_; }

 private:
  void evaluateFrame(int index);

  std::vector<FitTest*> tests_;
  int threads_;
  std::function<bool()> cancelled_;
  std::shared_ptr<const FitSpace> space_;
  std::vector<FrameId> frames_;
  Eigen::MatrixXd ties_;  ///< Parameters by z.
  std::vector<FrameBlock> blocks_;
  std::vector<int> order_;  ///< Of evaluation: frames that failed last come first.
  Eigen::VectorXd point_, failed_point_;
  bool valid_ = false;
  SolveCounts counts_;
};

/// Calls work(0) ... work(count - 1) from `threads` threads; stops handing out work once `stop`
/// says so.
void parallelFor(int count, int threads, const std::function<void(int)>& work,
                 const std::function<bool()>& stop = {});

}  // namespace tenter
