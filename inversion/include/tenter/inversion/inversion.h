// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tenter/inversion/certificate.h"
#include "tenter/inversion/rest_preference.h"
#include "tenter/inversion/sliding_proof.h"
#include "tenter/inversion/softness_proof.h"

namespace tenter {

/// A target pose, what it is made of and what holds it.
struct InversionProblem {
  TriangleMesh target;
  ShellMaterial material;
  std::vector<MaterialFrame> frames;  ///< As InverseShell::create.
  std::vector<int> fixed;             ///< Vertices that something holds, whatever the force.
  std::vector<Contact> contacts;
};

enum class InversionStatus {
  kCertified,
  kInfeasible,    ///< Proved: no rest shape exists, within the bounds that the proof states.
  kNotConverged,  ///< None was found that the certificate holds for.
  kBudget,        ///< Time ran out first.
};
std::string name(
    InversionStatus status);  ///< "certified", "infeasible", "not_converged", "budget".

enum class InversionMethod {
  kDirect,     ///< Convex choice of contact forces, Newton's method, stability (docs/inversion.md).
  kReference,  ///< The algorithm of [Inv18], for comparison: thousands of drapes, small cases only.
};

/// What is looked for.
enum class RestKind {
  kMesh,    ///< Rest positions: a shape that can be cut and sewn.
  kMetric,  ///< A rest length and a rest angle for every edge, which need not fit together.
};

struct InversionOptions {
  InversionMethod method = InversionMethod::kDirect;
  RestKind rest = RestKind::kMesh;  ///< kMetric: kDirect only.
  /// Its share is halved, and at last left out, where nothing certified is found with it. kDirect
  /// only.
  RestPreference preference;
  double time_budget_s = 0.0;  ///< 0: none.
  std::function<bool()> cancelled;
  std::function<void(const std::string& stage)> progress;
  int redrapes = 20;
  /// Whether to look for a proof, and for the stiffness that would do, where nothing is found: for
  /// up to two minutes more, within the budget.
  bool explain = true;
};

struct InversionResult {
  InversionStatus status = InversionStatus::kNotConverged;
  std::string reason;  ///< One sentence without a full stop; empty if certified.
  Points3 rest;  ///< Of RestKind::kMetric: the target, whose masses and hinge weights it keeps.
  std::optional<ElementRest> element_rest;  ///< Of RestKind::kMetric, if one was found.
  Eigen::VectorXd rotations;
  Points3 contact_forces;  ///< 3 x contacts [N], on the shell.
  Certificate certificate;
  RestPreference preference;  ///< With which this was found; its share may be less than was asked.
  ShapeMeasures target_shape, rest_shape;
  std::optional<SlidingProof> proof;  ///< Of kInfeasible; or the next.
  std::optional<SoftnessProof> softness_proof;
  /// With it: multiples of all stiffness up to which no metric rest state exists, and one at which
  /// one was found, if there was time.
  double stiffness_factor_proved_below = 1.0;
  std::optional<double> stiffness_factor_min;
  /// Of a rest shape that was not found: smallest eigenvalue of a metric rest state that was.
  std::optional<double> metric_lambda_min_per_s2;
  /// Share of gravity that was balanced. Below 1 the rest shape is that of a material 1 / this
  /// times as stiff, whose stability was not looked at.
  double load_balanced = 0.0;
  double seconds = 0.0;  ///< Wall clock, with the certificate.
  double solve_cpu_seconds =
      0.0;  ///< Processor time of the program until the rest shape was there.
  double forces_cpu_seconds = 0.0;  ///< Of those, for the convex choice of contact forces.
  int factorizations = 0;
  int drapes = 0;  ///< Of the reference method.
};

/// Finds a rest shape whose stable equilibrium under gravity and the contacts' friction is the
/// target [Inv18]. Error kBadInput: the mesh is invalid, nothing holds it, the material does not
/// fit.
Result<InversionResult> invert(const InversionProblem& problem, const InversionOptions& options);

}  // namespace tenter
