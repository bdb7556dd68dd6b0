// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tenter/fitting/fit.h"
#include "tenter/fitting/fit_test.h"

namespace tenter {

/// Components that share one curve up to fixed factors: weft and warp of an isotropic variant, or a
/// direction that no measurement sees and that is assumed to follow another.
struct ParameterGroup {
  std::vector<int> members;  ///< Components; the first one's units are those of the coefficients.
  std::vector<double> factors;  ///< Stiffness of a member over that of the first.
  int assumed_from = 1;         ///< Members from here on are assumed, not seen.
  bool bending = false;
  bool even = false, constant_only = false, may_be_negative = false;
  std::shared_ptr<const SplineBasis> basis = std::make_shared<SplineBasis>(SplineBasis::constant());
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(1);
  double reference = 1.0;  ///< Stiffness that makes the solver's numbers O(1).
  double belief =
      0.0;  ///< Best constant known so far: what a curve is taken for where no data say.
};

/// What a fit knows so far: one curve a group.
struct FitState {
  const ClothModel* model = nullptr;
  std::vector<ParameterGroup> groups;

  int groupOf(int component) const;
  std::string groupName(int group) const;  ///< Of its first member.
  ComponentCurve componentCurve(int component) const;
  void setConstant(int group, double stiffness);
  /// Same curve, other knots (least squares where it does not lie in their space, never below 0
  /// unless allowed).
  void setKnots(int group, const std::vector<double>& knots);
  /// Typical stiffness becomes the scale of the group.
  void updateReference(int group);
};

/// One group a component, or fewer: an isotropic variant ties weft to warp.
FitState makeFitState(const ClothModel& model, FitVariant variant);

/// The coefficients of some groups as one vector z of O(1) numbers: coefficient = reference * z.
class FitSpace {
 public:
  FitSpace(const FitState& state, std::vector<int> active_groups);

  int size() const { return size_; }
  const std::vector<int>& groups() const { return active_; }
  const FitState& state() const { return state_; }
  int offset(int group) const;  ///< First entry of a group; -1 if it is not active.
  Eigen::VectorXd start() const;
  Eigen::VectorXd lowerBounds() const;      ///< 0, or -infinity for couplings.
  Eigen::VectorXd scales() const;           ///< Stiffness of each entry.
  std::vector<std::string> labels() const;  ///< "stretch_weft[3]".
  FitState stateAt(const Eigen::VectorXd& z) const;

  /// Laws at z with parameters for the components of active groups alone, and T: parameters = T z.
  ParameterSet parameters(const Eigen::VectorXd& z) const;
  Eigen::MatrixXd ties() const;

 private:
  bool moves(int component) const { return offsets_[state_.groupOf(component)] >= 0; }

  FitState state_;
  std::vector<int> active_;
  std::vector<int> offsets_;  ///< Of every group; -1 if not active.
  int size_ = 0;
};

}  // namespace tenter
