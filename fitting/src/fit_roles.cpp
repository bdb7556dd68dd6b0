// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_roles.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

namespace tenter {
namespace {

/// A strip within this of an axis tests that axis.
constexpr double kAxisTolerance_rad = 2.0 * M_PI / 180.0;
/// Twisting stiffness over bending stiffness of an isotropic plate without Poisson effect: B (k_u^2
/// + k_v^2) + 4 D k_uv^2 turns with the axes when D = B / 2.
constexpr double kTwistOverBend = 0.5;

/// Component along which a strip at this angle lies.
std::string_view alongAngle(double angle_rad, std::string_view weft, std::string_view warp,
                            std::string_view between) {
  if (std::abs(std::sin(angle_rad)) < std::sin(kAxisTolerance_rad)) return weft;
  if (std::abs(std::cos(angle_rad)) < std::sin(kAxisTolerance_rad)) return warp;
  return between;
}

std::string isolatedComponent(const Measurement& m) {
  if (m.tensile)
    return std::string(alongAngle(m.tensile->angle_rad, "stretch_weft", "stretch_warp", "shear"));
  if (m.cantilever)
    return std::string(
        alongAngle(m.cantilever->angle_rad, "bend_weft", "bend_warp", "bend_diagonal"));
  if (m.protocol == "bend-bias") return "bend_diagonal";
  std::string name = m.protocol;
  std::ranges::replace(name, '-', '_');
  return name;
}

bool contains(const std::vector<int>& values, int value) {
  return std::ranges::find(values, value) != values.end();
}

bool isolates(const TestRole& role, const ParameterGroup& group) {
  return role.primary >= 0 && contains(group.members, role.primary);
}

bool sees(const TestRole& role, const ParameterGroup& group) {
  return std::ranges::any_of(group.members, [&](int c) { return contains(role.observed, c); });
}

bool isolated(const FitState& state, int group, const std::vector<TestRole>& roles) {
  return std::ranges::any_of(roles,
                             [&](const TestRole& r) { return isolates(r, state.groups[group]); });
}

/// Seen by a test that was made for something else than `partner`.
bool seenBesides(const FitState& state, int group, int partner,
                 const std::vector<TestRole>& roles) {
  return std::ranges::any_of(roles, [&](const TestRole& r) {
    return sees(r, state.groups[group]) && !isolates(r, state.groups[partner]);
  });
}

void tie(FitState& state, int unseen, int seen, double factor) {
  ParameterGroup& into = state.groups[seen];
  const ParameterGroup& from = state.groups[unseen];
  for (std::size_t i = 0; i < from.members.size(); ++i) {
    into.members.push_back(from.members[i]);
    into.factors.push_back(factor * from.factors[i]);
  }
  state.groups.erase(state.groups.begin() + unseen);
}

void tiePair(FitState& state, const std::vector<TestRole>& roles, std::string_view weft,
             std::string_view warp) {
  const int a = state.groupOf(state.model->componentIndex(weft));
  const int b = state.groupOf(state.model->componentIndex(warp));
  if (a == b || isolated(state, a, roles) == isolated(state, b, roles)) return;
  const int seen = isolated(state, a, roles) ? a : b, unseen = seen == a ? b : a;
  if (!seenBesides(state, unseen, seen, roles)) tie(state, unseen, seen, 1.0);
}

/// Bending of the diagonal follows the others when no test can move it.
void tieDiagonal(FitState& state, const std::vector<TestRole>& roles) {
  const int diagonal = state.groupOf(state.model->componentIndex("bend_diagonal"));
  const int bend = state.groupOf(state.model->componentIndex("bend_weft"));
  const int warp = state.groupOf(state.model->componentIndex("bend_warp"));
  const bool seen = std::ranges::any_of(
      roles, [&](const TestRole& r) { return sees(r, state.groups[diagonal]); });
  if (seen || bend != warp || !isolated(state, bend, roles)) return;
  tie(state, diagonal, bend, state.model->bending == BendingElement::kHinge ? kTwistOverBend : 1.0);
}

}  // namespace

TestRole testRole(const FitTest& test, const ClothModel& model) {
  TestRole role{.primary = model.componentIndex(isolatedComponent(test.measurement())),
                .observed = test.observedComponents(model)};
  if (!contains(role.observed, role.primary)) role.primary = -1;
  return role;
}

std::vector<int> testsOfGroup(const FitState& state, int group,
                              const std::vector<TestRole>& roles) {
  const ParameterGroup& g = state.groups[group];
  std::vector<int> own, family;
  for (int t = 0; t < static_cast<int>(roles.size()); ++t) {
    if (isolates(roles[t], g)) own.push_back(t);
    const bool same_family =
        roles[t].primary >= 0 && state.groups[state.groupOf(roles[t].primary)].bending == g.bending;
    if (same_family && sees(roles[t], g)) family.push_back(t);
  }
  // Springs that bend are pulled in other tests as well: a stiffness that only bend tests chose
  // would spoil those.
  const bool alone = !(g.bending && state.model->bending == BendingElement::kSprings);
  if (alone && !own.empty()) return own;
  if (alone && !family.empty()) return family;
  for (int t = 0; t < static_cast<int>(roles.size()); ++t)
    if (sees(roles[t], g)) family.push_back(t);
  return family;
}

std::vector<int> isolatingTests(const FitState& state, int group,
                                const std::vector<TestRole>& roles) {
  std::vector<int> tests;
  for (int t = 0; t < static_cast<int>(roles.size()); ++t)
    if (isolates(roles[t], state.groups[group])) tests.push_back(t);
  return tests.empty() ? testsOfGroup(state, group, roles) : tests;
}

void tieUnseenDirections(FitState& state, const std::vector<TestRole>& roles) {
  const ClothModel& model = *state.model;
  if (model.componentIndex("stretch_warp") >= 0)
    tiePair(state, roles, "stretch_weft", "stretch_warp");
  if (model.componentIndex("bend_warp") < 0) return;
  tiePair(state, roles, "bend_weft", "bend_warp");
  if (model.componentIndex("bend_diagonal") >= 0) tieDiagonal(state, roles);
}

std::vector<int> stageOrder(const FitState& state, const std::vector<TestRole>& roles) {
  std::vector<int> order;
  for (const bool bending : {false, true})
    for (const bool own : {true, false})
      for (const int g : seenGroups(state, roles))
        if (state.groups[g].bending == bending && isolated(state, g, roles) == own)
          order.push_back(g);
  return order;
}

std::vector<int> seenGroups(const FitState& state, const std::vector<TestRole>& roles) {
  std::vector<int> seen;
  for (int g = 0; g < static_cast<int>(state.groups.size()); ++g)
    if (std::ranges::any_of(roles, [&](const TestRole& r) { return sees(r, state.groups[g]); }))
      seen.push_back(g);
  return seen;
}

std::vector<FitBlock> fitBlocks(const FitState& state, const std::vector<TestRole>& roles) {
  std::vector<FitBlock> blocks;
  std::vector<bool> placed(roles.size(), false);
  for (const int seed : stageOrder(state, roles)) {
    if (std::ranges::any_of(blocks, [&](const FitBlock& b) { return contains(b.groups, seed); }))
      continue;
    FitBlock block{.groups = {seed}, .tests = {}};
    for (bool grown = true; grown;) {
      grown = false;
      for (int t = 0; t < static_cast<int>(roles.size()); ++t) {
        const auto linked = [&](int g) { return sees(roles[t], state.groups[g]); };
        if (placed[t] || std::ranges::none_of(block.groups, linked)) continue;
        placed[t] = grown = true;
        block.tests.push_back(t);
        for (const int g : seenGroups(state, {roles[t]}))
          if (!contains(block.groups, g)) block.groups.push_back(g);
      }
    }
    std::ranges::sort(block.groups);
    std::ranges::sort(block.tests);
    blocks.push_back(std::move(block));
  }
  return blocks;
}

}  // namespace tenter
