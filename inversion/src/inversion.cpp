// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inversion.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <utility>

#include "contact_forces.h"
#include "metric_stage.h"
#include "reference_method.h"
#include "rest_newton.h"
#include "stabilize.h"
#include "tenter/inversion/feasible_range.h"

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;

/// With room for what may come first, then as [Inv18] sec. 7.2, then on the cones' borders.
constexpr std::array kMargins{ConeMargin{0.9, 0.3}, ConeMargin{0.975, 0.02},
                              ConeMargin{0.9999, 1e-4}};
/// Of the load's steps, when all of it at once is too much.
constexpr double kLoadShrink = 0.25, kLoadGrowth = 1.5, kLeastLoadStep = 0.01;
constexpr int kMaxChoices = 5;
/// Most for a proof where no rest mesh is found; and for the stiffness at which a metric rest state
/// exists.
constexpr double kExplanation_s = 120.0;
constexpr double kStiffnessSearch_s = 20.0;
/// Of a preference for the rest shape, before it is left out.
constexpr int kHalvings = 4;
constexpr double kLeastBudget_s = 1e-3;
/// Far above what an eigenvalue is known to, far below that of any sheet a person can touch.
constexpr double kLambdaFloor_per_s2 = 0.05;

double cpuSecondsSince(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

class Inverter {
 public:
  Inverter(const InversionProblem& problem, const InversionOptions& options, InverseShell shell)
      : problem_(problem), options_(options), shell_(std::move(shell)) {}

  Result<InversionResult> run() {
    forgetRest();
    if (options_.rest == RestKind::kMetric)
      if (const auto possible = checkMetricRest(shell_); !possible) return possible.error();
    if (problem_.fixed.empty())
      out_.proof = findSlidingProof(problem_.contacts, problem_.material.gravity_m_per_s2);
    if (out_.proof) return finish();
    if (options_.method == InversionMethod::kReference) return reference();
    if (options_.preference.kind != RestShapeKind::kNearTarget) {
      wanted_angle_ = wantedAngles(shell_, options_.preference);
      wish_ = bendingGradient(shell_, wanted_angle_);
    }
    if (options_.rest == RestKind::kMetric) return metric();
    const std::clock_t before = std::clock();
    auto contact_forces = ContactForces::create(shell_, newton_);
    out_.forces_cpu_seconds += cpuSecondsSince(before);
    if (!contact_forces) return contact_forces.error();
    for (const ConeMargin& margin : kMargins) {
      forgetRest();
      margin_ = margin;
      raiseLoad(*contact_forces);
      const bool stable = load_ >= 1.0 && makeStable();
      if (stable || stopped() || problem_.contacts.empty()) break;
      // Room is given up for stability and for more load, the last of it only to balance at all.
      if (&margin != &kMargins.front() && load_ > 0.0) break;
    }
    return finish();
  }

 private:
  void forgetRest() {
    unknowns_.rest = problem_.target.positions;
    unknowns_.rotations = Eigen::VectorXd::Zero(shell_.rotationCount());
  }

  /// Balances all of the weight at once if that can be done, otherwise in steps: without load the
  /// target is its own rest shape, and each solution starts the next. `load_` is what was reached.
  void raiseLoad(ContactForces& contact_forces) {
    double step = 1.0;
    load_ = 0.0;
    while (!stopped()) {
      const RestUnknowns before = unknowns_;
      const double load = std::min(1.0, load_ + step);
      say("load %.4g", load);
      if (balance(contact_forces, load)) {
        load_ = load;
        if (load_ >= 1.0) break;
        step *= kLoadGrowth;
        continue;
      }
      unknowns_ = before;
      step *= kLoadShrink;
      if (step < kLeastLoadStep) break;
    }
  }

  /// The convex choice of contact forces, and the rest shape for them; again where its other weight
  /// has moved them too far.
  bool balance(ContactForces& contact_forces, double load) {
    for (int k = 0; k < kMaxChoices && !stopped(); ++k) {
      const std::clock_t before = std::clock();
      Eigen::VectorXd gradient = newton_.gradient(unknowns_, load);
      // What was balanced before has had its wish.
      if (k == 0 && wish_.size() > 0) gradient += (load - load_) * wish_;
      auto f = contact_forces.solve(gradient, margin_, load, [this] { return stopped(); });
      out_.forces_cpu_seconds += cpuSecondsSince(before);
      out_.factorizations += f.factorizations;
      say("contact forces chosen: %.0f, %.0f factorizations", f.converged ? 1.0 : 0.0,
          f.factorizations);
      if (!f.converged) return false;
      const RestNewtonResult r = newton_.solve(unknowns_, f.forces, load, newtonOptions());
      out_.factorizations += r.factorizations;
      if (!r.converged) return false;
      forces_ = std::move(f.forces);
      if (insideCones(newton_, shell_.vertexCount(), forces_, margin_.halved(), load)) return true;
    }
    return false;
  }

  Result<InversionResult> reference() {
    ReferenceOptions o;
    o.stop = [this] { return stopped(); };
    o.progress = [this](double lambda, int drapes, double cost) {
      say("lambda %.4g, %.0f drapes, cost of the cones %.3g", lambda, drapes, cost);
    };
    const ReferenceResult r =
        invertByReference(shell_, newton_, margin_.friction_share, unknowns_, o);
    out_.drapes = r.drapes;
    load_ = 1.0;
    return finish();
  }

  Result<InversionResult> metric() {
    auto found = metricRest(shell_, newton_, [this] { return stopped(); });
    if (!found) return found.error();
    out_.factorizations += found->factorizations;
    out_.softness_proof = std::move(found->proof);
    out_.element_rest = std::move(found->rest);
    if (out_.element_rest) load_ = 1.0;
    shell_.setElementRest(out_.element_rest);
    return finish();
  }

  /// True once that time is over, or the user or the budget ends it all.
  std::function<bool()> until(double seconds_from_now) const {
    return [this, end = seconds() + seconds_from_now] { return stopped() || seconds() > end; };
  }

  Result<MetricResult> metricRest(InverseShell& shell, const RestNewton& newton,
                                  const std::function<bool()>& stop) {
    MetricOptions o;
    o.lambda_floor_per_s2 = kLambdaFloor_per_s2;
    o.wanted_angle_rad = wanted_angle_;
    o.stop = stop;
    o.progress = [this](const char* stage, double lambda) {
      say((std::string("metric rest state: ") + stage + ", lambda_min %.4g").c_str(), lambda);
    };
    return findMetricRest(shell, newton, o);
  }

  /// No rest shape was found: perhaps not even a metric rest state exists.
  void explainFailure() {
    if (!options_.explain || !hasElementRest(shell_.material()) ||
        options_.method == InversionMethod::kReference)
      return;
    if (options_.rest == RestKind::kMesh) {
      // A stable equilibrium that only re-draping leaves needs another reason.
      if (out_.certificate.balanced() && out_.certificate.stable()) return;
      const auto found = metricRest(shell_, newton_, until(kExplanation_s));
      if (!found) return;
      out_.softness_proof = found->proof;
      if (found->stable) out_.metric_lambda_min_per_s2 = found->lambda_min_per_s2;
    }
    if (out_.softness_proof) searchStiffness();
  }

  /// Between the stiffness that is proved too small and one that is found to do: doubled, then
  /// halved in the logarithm.
  void searchStiffness() {
    double& low = out_.stiffness_factor_proved_below;
    std::optional<double>& high = out_.stiffness_factor_min;
    const std::function<bool()> stop = until(kStiffnessSearch_s);
    for (double factor = 2.0; !high && factor <= kStiffestFactor; factor *= 2.0)
      if (!narrow(factor, stop)) return;
    while (high && *high / low > kRangeRatio)
      if (!narrow(std::sqrt(low * *high), stop)) return;
  }

  /// False where neither a state nor a proof is found.
  bool narrow(double factor, const std::function<bool()>& stop) {
    auto shell =
        InverseShell::create(problem_.target, scaled(problem_.material, factor), problem_.frames);
    if (!shell) return false;
    const RestNewton newton(*shell, problem_.target.positions, problem_.fixed, problem_.contacts);
    const auto found = metricRest(*shell, newton, stop);
    if (!found || (!found->stable && !found->proof)) return false;
    if (found->stable)
      out_.stiffness_factor_min = factor;
    else
      out_.stiffness_factor_proved_below = factor;
    return true;
  }

  RestNewtonOptions newtonOptions() const {
    RestNewtonOptions o;
    o.stop = [this] { return stopped(); };
    o.progress = [this](int k, double r, double t) {
      say("rest shape: %.0f, residual %.3g, step %.3g", k, r, t);
    };
    return o;
  }

  bool makeStable() {
    const std::size_t held = problem_.fixed.size() + problem_.contacts.size();
    if (held == static_cast<std::size_t>(shell_.vertexCount())) return true;
    StabilizeOptions o;
    o.lambda_floor_per_s2 = kLambdaFloor_per_s2;
    o.margin = margin_;
    o.newton = newtonOptions();
    o.stop = o.newton.stop;
    o.progress = [this](int k, double l) { say("stability %.0f lambda_min %.4g", double(k), l); };
    const StabilizeResult r = stabilize(shell_, newton_, unknowns_, forces_, o);
    out_.factorizations += r.factorizations;
    return r.stable;
  }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  bool stopped() const {
    return (options_.cancelled && options_.cancelled()) ||
           (options_.time_budget_s > 0.0 && seconds() > options_.time_budget_s);
  }
  void say(const char* format, double a = 0.0, double b = 0.0, double c = 0.0) const {
    if (!options_.progress) return;
    char text[120];
    std::snprintf(text, sizeof text, format, a, b, c);
    options_.progress(text);
  }

  Result<InversionResult> finish() {
    out_.load_balanced = load_;
    out_.rest = unknowns_.rest;
    out_.rotations = unknowns_.rotations;
    out_.contact_forces = newton_.contactForces(gradient());
    out_.solve_cpu_seconds = cpuSecondsSince(start_cpu_);
    say("solved after %.3g s", seconds());
    CertificateOptions c;
    c.redrapes = options_.redrapes;
    c.stop = [this] { return stopped(); };
    auto certificate = certify(shell_, problem_.target.positions, out_.rest, out_.rotations,
                               problem_.fixed, problem_.contacts, c);
    if (!certificate) return certificate.error();
    out_.certificate = std::move(certificate).value();
    out_.status = out_.certificate.holds() ? InversionStatus::kCertified
                  : out_.proof             ? InversionStatus::kInfeasible
                  : stopped()              ? InversionStatus::kBudget
                                           : InversionStatus::kNotConverged;
    if (out_.status == InversionStatus::kNotConverged) explainFailure();
    if (out_.softness_proof && out_.status != InversionStatus::kCertified)
      out_.status = InversionStatus::kInfeasible;
    out_.reason = reason();
    out_.preference = options_.preference;
    measureShapes();
    out_.seconds = seconds();
    return out_;
  }

  void measureShapes() {
    const Eigen::VectorXd smooth = fairedAngles(shell_, options_.preference.smoothing_length_m);
    const auto of = [&](const Points3& x) { return elementsOf(shell_.topology(), x); };
    out_.target_shape = measureShape(shell_, of(problem_.target.positions), smooth);
    out_.rest_shape =
        measureShape(shell_, out_.element_rest ? *out_.element_rest : of(out_.rest), smooth);
  }

  std::string reason() const {
    switch (out_.status) {
      case InversionStatus::kCertified:
        return "";
      case InversionStatus::kBudget:
        return options_.cancelled && options_.cancelled() ? "stopped" : "time ran out";
      case InversionStatus::kInfeasible:
        return out_.softness_proof ? softnessReason(*out_.softness_proof)
                                   : "the shell slides off as a whole, whatever its rest shape";
      case InversionStatus::kNotConverged:
        break;
    }
    std::string text =
        !out_.certificate.balanced() ? "no rest shape was found that balances the forces"
        : !out_.certificate.stable() ? "the equilibrium that was found is not stable"
                                     : "a perturbed shell does not return to the target";
    if (out_.metric_lambda_min_per_s2)
      text += "; rest lengths and angles that fit no mesh would hold it (--rest metric)";
    return text;
  }

  /// With what the proof leaves out.
  std::string softnessReason(const SoftnessProof& proof) const {
    char text[400];
    std::snprintf(
        text, sizeof text,
        "the material is too soft: no rest lengths from half to twice the target's and no "
        "rest angles %s, with hinge weights and masses within %.2g %% of the target's",
        proof.modes.empty() ? "balance the weight" : "are stable", 100.0 * proof.weight_change);
    std::string out = text;
    if (out_.stiffness_factor_min) {
      std::snprintf(text, sizeof text, "; %.3g times as stiff a metric rest state exists",
                    *out_.stiffness_factor_min);
      out += text;
    }
    return out;
  }

  /// dE/dq at the target [N].
  Eigen::VectorXd gradient() const {
    if (!out_.element_rest) return newton_.gradient(unknowns_, 1.0);
    const auto system = shell_.system(unknowns_.rest, problem_.fixed);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(shell_.coordinateCount());
    const Eigen::VectorXd q = shell_.coordinates(problem_.target.positions, unknowns_.rotations);
    for (const auto& term : system.value().terms()) term->addGradient(q, sum);
    return sum;
  }

  const InversionProblem& problem_;
  const InversionOptions& options_;
  InverseShell shell_;
  Clock::time_point start_ = Clock::now();
  std::clock_t start_cpu_ = std::clock();
  RestNewton newton_{shell_, problem_.target.positions, problem_.fixed, problem_.contacts};
  ConeMargin margin_;
  RestUnknowns unknowns_;
  /// Of RestPreference: rest angles, and the moments that hold a shell with them in the target's
  /// shape; empty without.
  Eigen::VectorXd wanted_angle_, wish_;
  Points3 forces_;     ///< Of the contacts that unknowns_ balances.
  double load_ = 0.0;  ///< Share of gravity that is balanced.
  InversionResult out_;
};

/// With ever less of the preference until the certificate holds. Counts and times are sums.
Result<InversionResult> invertWithPreference(const InversionProblem& problem,
                                             const InversionOptions& options,
                                             const InverseShell& shell) {
  InversionOptions now = options;
  InversionResult before;
  for (int k = 0;; ++k) {
    const bool last = k == kHalvings;
    if (last) now.preference = {};
    now.explain = options.explain && last;
    auto result = Inverter(problem, now, shell).run();
    if (!result) return result;
    result->seconds += before.seconds;
    result->solve_cpu_seconds += before.solve_cpu_seconds;
    result->forces_cpu_seconds += before.forces_cpu_seconds;
    result->factorizations += before.factorizations;
    if (last || result->status != InversionStatus::kNotConverged) return result;
    before = std::move(result).value();
    now.preference.share *= 0.5;
    if (options.time_budget_s > 0.0)
      now.time_budget_s = std::max(options.time_budget_s - before.seconds, kLeastBudget_s);
  }
}

}  // namespace

std::string name(InversionStatus status) {
  switch (status) {
    case InversionStatus::kCertified:
      return "certified";
    case InversionStatus::kInfeasible:
      return "infeasible";
    case InversionStatus::kNotConverged:
      return "not_converged";
    case InversionStatus::kBudget:
      return "budget";
  }
  return "unknown";
}

Result<InversionResult> invert(const InversionProblem& problem, const InversionOptions& options) {
  auto shell = InverseShell::create(problem.target, problem.material, problem.frames);
  if (!shell) return shell.error();
  if (problem.fixed.empty() && problem.contacts.empty()) {
    return badInput("", "", "nothing holds the target: it falls",
                    "give an obstacle that it touches, or hold vertices");
  }
  if (options.preference.kind == RestShapeKind::kNearTarget)
    return Inverter(problem, options, std::move(shell).value()).run();
  return invertWithPreference(problem, options, *shell);
}

}  // namespace tenter
