// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_space.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace tenter {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kWeftAndWarp = {
    {{"stretch_weft", "stretch_warp"}, {"bend_weft", "bend_warp"}}};

/// A group's typical stiffness must not vanish, or its scale would.
constexpr double kSmallestReference = 1e-12;

ParameterGroup groupOfComponent(const ClothModel& model, int component) {
  const ComponentInfo& info = model.component(component);
  ParameterGroup group;
  group.members = {component};
  group.factors = {1.0};
  group.bending = component >= static_cast<int>(model.membrane_components.size());
  group.even = info.even;
  group.constant_only = info.constant_only;
  group.may_be_negative = info.may_be_negative;
  group.basis = std::make_shared<SplineBasis>(SplineBasis::constant(info.even));
  return group;
}

}  // namespace

int FitState::groupOf(int component) const {
  for (int g = 0; g < static_cast<int>(groups.size()); ++g)
    if (std::ranges::find(groups[g].members, component) != groups[g].members.end()) return g;
  return -1;
}

std::string FitState::groupName(int group) const {
  return std::string(model->component(groups[group].members.front()).name);
}

ComponentCurve FitState::componentCurve(int component) const {
  const ParameterGroup& group = groups[groupOf(component)];
  const auto place = std::ranges::find(group.members, component) - group.members.begin();
  return {group.basis->curve(group.factors[place] * group.coefficients), group.basis};
}

void FitState::setConstant(int group, double stiffness) {
  ParameterGroup& g = groups[group];
  g.basis = std::make_shared<SplineBasis>(SplineBasis::constant(g.even));
  g.coefficients = Eigen::VectorXd::Constant(1, stiffness);
  g.belief = stiffness;
  updateReference(group);
}

void FitState::setKnots(int group, const std::vector<double>& knots) {
  ParameterGroup& g = groups[group];
  const StiffnessCurve before = g.basis->curve(g.coefficients);
  g.basis = std::make_shared<SplineBasis>(knots.size() < 2 ? SplineBasis::constant(g.even)
                                                           : SplineBasis::onKnots(knots, g.even));
  g.coefficients = g.basis->coefficientsOf(before);
  if (!g.may_be_negative) g.coefficients = g.coefficients.cwiseMax(0.0);
}

void FitState::updateReference(int group) {
  ParameterGroup& g = groups[group];
  const double typical = g.coefficients.cwiseAbs().mean();
  if (typical > kSmallestReference) g.reference = typical;
}

FitState makeFitState(const ClothModel& model, FitVariant variant) {
  FitState state{.model = &model, .groups = {}};
  for (int c = 0; c < model.componentCount(); ++c) {
    int tied_to = -1;
    for (const auto& [weft, warp] : kWeftAndWarp)
      if (variant.isotropic && model.component(c).name == warp)
        tied_to = state.groupOf(model.componentIndex(weft));
    if (tied_to < 0) {
      state.groups.push_back(groupOfComponent(model, c));
      continue;
    }
    state.groups[tied_to].members.push_back(c);
    state.groups[tied_to].factors.push_back(1.0);
    ++state.groups[tied_to].assumed_from;
  }
  return state;
}

FitSpace::FitSpace(const FitState& state, std::vector<int> active_groups)
    : state_(state), active_(std::move(active_groups)), offsets_(state.groups.size(), -1) {
  for (const int g : active_) {
    offsets_[g] = size_;
    size_ += state_.groups[g].basis->size();
  }
}

int FitSpace::offset(int group) const { return offsets_[group]; }

Eigen::VectorXd FitSpace::start() const {
  Eigen::VectorXd z(size_);
  for (const int g : active_) {
    const ParameterGroup& group = state_.groups[g];
    z.segment(offsets_[g], group.basis->size()) = group.coefficients / group.reference;
  }
  return z.cwiseMax(lowerBounds());
}

Eigen::VectorXd FitSpace::lowerBounds() const {
  Eigen::VectorXd lower = Eigen::VectorXd::Zero(size_);
  for (const int g : active_)
    if (state_.groups[g].may_be_negative)
      lower.segment(offsets_[g], state_.groups[g].basis->size())
          .setConstant(-std::numeric_limits<double>::infinity());
  return lower;
}

Eigen::VectorXd FitSpace::scales() const {
  Eigen::VectorXd scales(size_);
  for (const int g : active_)
    scales.segment(offsets_[g], state_.groups[g].basis->size())
        .setConstant(state_.groups[g].reference);
  return scales;
}

std::vector<std::string> FitSpace::labels() const {
  std::vector<std::string> labels;
  for (const int g : active_)
    for (int j = 0; j < state_.groups[g].basis->size(); ++j)
      labels.push_back(state_.groupName(g) + "[" + std::to_string(j) + "]");
  return labels;
}

FitState FitSpace::stateAt(const Eigen::VectorXd& z) const {
  require(z.size() == size_, "a point of the fit has one entry for each coefficient");
  FitState state = state_;
  for (const int g : active_) {
    ParameterGroup& group = state.groups[g];
    group.coefficients = group.reference * z.segment(offsets_[g], group.basis->size());
  }
  return state;
}

ParameterSet FitSpace::parameters(const Eigen::VectorXd& z) const {
  const FitState state = stateAt(z);
  ParameterSet set{.model = state.model, .components = {}};
  for (int c = 0; c < state.model->componentCount(); ++c) {
    set.components.push_back(state.componentCurve(c));
    if (!moves(c)) set.components.back().basis = nullptr;
  }
  return set;
}

Eigen::MatrixXd FitSpace::ties() const {
  std::vector<int> moving;
  int rows = 0;
  for (int c = 0; c < state_.model->componentCount(); ++c) {
    if (!moves(c)) continue;
    moving.push_back(c);
    rows += state_.groups[state_.groupOf(c)].basis->size();
  }
  Eigen::MatrixXd ties = Eigen::MatrixXd::Zero(rows, size_);
  int row = 0;
  for (const int c : moving) {
    const int g = state_.groupOf(c);
    const ParameterGroup& group = state_.groups[g];
    const auto place = std::ranges::find(group.members, c) - group.members.begin();
    for (int j = 0; j < group.basis->size(); ++j)
      ties(row++, offsets_[g] + j) = group.factors[place] * group.reference;
  }
  return ties;
}

}  // namespace tenter
