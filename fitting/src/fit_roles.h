// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit_space.h"

namespace tenter {

/// What one test is for in the schedule of [Est12] sec. 5.2.
struct TestRole {
  int primary = -1;  ///< Component that the test isolates; -1: it joins the refinement only.
  std::vector<int> observed;  ///< Components that it can see at all.
};
TestRole testRole(const FitTest& test, const ClothModel& model);

/// Tests that isolate a member of the group; if there are none, tests of the same family (membrane,
/// bending) that see one.
std::vector<int> testsOfGroup(const FitState& state, int group, const std::vector<TestRole>& roles);

/// Tests whose strains say where the group's knots belong: those that isolate it, if there are any.
std::vector<int> isolatingTests(const FitState& state, int group,
                                const std::vector<TestRole>& roles);

/// Ties a direction that no test sees to its partner (weft to warp, bending of the diagonal to the
/// others), as an assumption.
void tieUnseenDirections(FitState& state, const std::vector<TestRole>& roles);

/// Order of the stages: groups with tests of their own in the registry's order, then those that
/// other groups' tests see. Groups that nothing sees are left out.
std::vector<int> stageOrder(const FitState& state, const std::vector<TestRole>& roles);

/// Groups that some test sees.
std::vector<int> seenGroups(const FitState& state, const std::vector<TestRole>& roles);

/// Groups and tests that belong together: connected by "this test sees that group".
struct FitBlock {
  std::vector<int> groups, tests;
};

/// Membrane before bending. A test that was made for one component shifts a little with others too
/// (a sheet that bends under its weight is also stretched by it), but its residuals must not decide
/// on them ([Est12] sec. 5.1 compares clip-parallel forces for that reason): each block is fitted
/// to its own tests with the others' curves given, in turn.
std::vector<FitBlock> fitBlocks(const FitState& state, const std::vector<TestRole>& roles);

}  // namespace tenter
