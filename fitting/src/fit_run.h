// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fit_roles.h"
#include "frame_evaluator.h"
#include "outer_solver.h"
#include "tenter/fitting/fit.h"

namespace tenter {

/// Knots at equal distances over a range; even curves begin at 0.
std::vector<double> equidistantKnots(double begin, double end, int count);

/// Frames spread over a test without a rhythm of their own, so that cycles of a protocol are not
/// sampled at one phase.
std::vector<int> spreadFrames(int frame_count, int wanted);

struct StrainRange {
  double begin = 0.0, end = 0.0;
};
/// Between the 0.5 % and 99.5 % weighted quantiles: the histogram without outliers ([Est12]
/// sec. 5.2).
StrainRange strainRange(const std::vector<FitTest::StrainSamples>& samples, bool even);

/// One fit in progress: [Est12] sec. 5.2, generic in tests and model.
class FitRun {
 public:
  FitRun(const ClothModel& model, std::vector<FitTest*> tests, const FitOptions& options);

  /// Guess, a stage a group, then all together. False when not even a first equilibrium exists (see
  /// `warnings`) or nothing was fitted.
  bool run();
  struct Refit {
    int frames = 0;  ///< Of each test.
    int rounds = 0;  ///< None: the residuals of the start.
    int max_iterations = 0;
    double relative_tolerance = 0.0;
  };
  /// From a given state: no stages, only the groups named, on a few frames of all tests. For
  /// alternatives of the law; false if one of the frames has no stable equilibrium at the start.
  bool refit(FitState start, const std::vector<int>& groups, const Refit& how);

  /// Brings the tests to the best point, with derivatives by everything that was fitted; on a few
  /// frames only if the refinement did not come to its end.
  bool settle();

  const FitState& state() const { return state_; }
  const std::vector<TestRole>& roles() const { return roles_; }
  FrameEvaluator& evaluator() { return evaluator_; }
  const std::vector<int>& refinedGroups() const { return refined_; }
  /// Which groups are fitted to which tests (empty before the refinement).
  const std::vector<FitBlock>& blocks() const { return blocks_; }
  const OuterSummary& last() const { return last_; }
  StrainRange rangeOf(int component, const std::vector<int>& tests) const;

  int outer_iterations = 0;
  bool converged = false;
  std::vector<std::string> warnings;

 private:
  /// @param per_test  0: all.
  /// @param least_residuals  more frames of tests that have fewer residuals.
  std::vector<FrameId> framesOf(const std::vector<int>& tests, int per_test,
                                int least_residuals = 0) const;
  bool solve(const std::vector<int>& groups, const std::vector<int>& tests, int per_test,
             const OuterOptions& outer, const std::string& stage);
  double scanScore(const std::vector<int>& tests, bool mixed) const;
  void scan(int group, const std::vector<int>& tests);
  void fitGroup(int group);
  void addKnots(int group, const std::vector<int>& tests, const OuterOptions& outer);
  const std::vector<double>* givenKnots(int group) const;
  bool refine();
  double negligibleGain() const;
  bool refineBlock(const FitBlock& block, int pass, double& radius);
  void reconsiderShapes(const FitBlock& block);
  void reweigh(const std::vector<int>& tests);
  void noteDropped(int dropped, const std::string& stage);
  std::vector<int> allTests() const;

  FitOptions options_;
  std::vector<FitTest*> tests_;
  std::vector<TestRole> roles_;
  FitState state_;
  FrameEvaluator evaluator_;
  std::vector<int> refined_;
  std::vector<FitBlock> blocks_;
  bool complete_ = false;  ///< All blocks were refined on all frames.
  OuterSummary last_;
};

}  // namespace tenter
