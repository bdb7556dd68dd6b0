// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inversion.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <limits>
#include <utility>

#include "contact_forces.h"
#include "force_balance.h"
#include "stabilize.h"

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;

/// Shares of friction and least normal forces (in mean weights of a vertex) that cones are solved
/// for: with room to spare first, then on their borders.
struct Margin {
  double friction_share, offset;
};
constexpr std::array kMargins{Margin{0.975, 0.02}, Margin{0.9999, 1e-4}};
constexpr int kMaxOuter = 4;
/// Of the load's steps, when all of it at once is too much.
constexpr double kLoadShrink = 0.25, kLoadGrowth = 1.5, kLeastLoadStep = 0.01;
/// Another choice of forces has to be worth this share of the residual.
constexpr double kWorthAnother = 0.7;
/// Far above what an eigenvalue is known to, far below that of any sheet a person can touch.
constexpr double kLambdaFloor_per_s2 = 0.05;

class Inverter {
 public:
  Inverter(const InversionProblem& problem, const InversionOptions& options, InverseShell shell)
      : problem_(problem), options_(options), shell_(std::move(shell)) {}

  Result<InversionResult> run() {
    unknowns_.rest = problem_.target.positions;
    unknowns_.rotations = Eigen::VectorXd::Zero(shell_.rotationCount());
    BalanceSetup setup;
    setup.fixed = problem_.fixed;
    setup.contacts = problem_.contacts;
    ForceBalance balance(shell_, problem_.target.positions, setup);
    if (problem_.fixed.empty())
      out_.proof = findSlidingProof(problem_.contacts, problem_.material.gravity_m_per_s2);
    if (out_.proof) return finish(balance);
    auto contact_forces = ContactForces::create(shell_, problem_.target.positions, setup);
    if (!contact_forces) return contact_forces.error();
    for (const Margin& margin : kMargins) {
      unknowns_.rest = problem_.target.positions;
      unknowns_.rotations.setZero();
      balance.setup().friction_share = margin.friction_share;
      balance.setup().offset = margin.offset;
      raiseLoad(balance, *contact_forces);
      if (balanced_.converged || stopped() || problem_.contacts.empty() || load_ > 0.0) break;
    }
    const bool all_held = problem_.fixed.size() + problem_.contacts.size() ==
                          static_cast<std::size_t>(shell_.vertexCount());
    if (balanced_.converged && !all_held) makeStable(balance);
    return finish(balance);
  }

 private:
  /// Balances all of the weight at once if that can be done, otherwise in steps: without load the
  /// target is its own rest shape, and each solution starts the next. `load_` is what was reached.
  void raiseLoad(ForceBalance& balance, ContactForces& contact_forces) {
    double step = 1.0;
    load_ = 0.0;
    while (!stopped()) {
      const RestUnknowns before = unknowns_;
      balance.setup().load = std::min(1.0, load_ + step);
      say("load %.4g", balance.setup().load);
      balanced_ = {};
      balanceForces(balance, contact_forces);
      if (balanced_.converged) {
        load_ = balance.setup().load;
        if (load_ >= 1.0) break;
        step *= kLoadGrowth;
        continue;
      }
      unknowns_ = before;
      step *= kLoadShrink;
      if (step < kLeastLoadStep) break;
    }
    balance.setup().load = 1.0;
    balanced_.converged = load_ >= 1.0;
  }

  /// Alternates the convex choice of contact forces with rest shapes for these forces, then
  /// polishes with cones that are a little wider, so that no force changes sides any more.
  void balanceForces(ForceBalance& balance, ContactForces& contact_forces) {
    BalanceOptions frozen;
    frozen.stop = [this] { return stopped(); };
    frozen.progress = [this](int k, double r) { say("forces given: %.0f, residual %.3g", k, r); };
    frozen.worthwhile = 0.9;
    frozen.patience = 3;
    BalanceOptions polish = frozen;
    polish.progress = [this](int k, double r) {
      say("forces in cones: %.0f, residual %.3g", k, r);
    };
    polish.patience = 4;
    double last = std::numeric_limits<double>::infinity();
    for (int outer = 0; outer < kMaxOuter && !stopped(); ++outer) {
      const auto f =
          contact_forces.solve(balance.gradient(unknowns_), balance.setup(), frozen.stop);
      out_.factorizations += f.factorizations;
      say("contact forces chosen: %.0f, %.0f factorizations", f.converged ? 1.0 : 0.0,
          f.factorizations);
      if (!f.converged) return;
      const BalanceResult r = balance.solve(unknowns_, &f.forces, frozen);
      out_.factorizations += r.factorizations;
      const RestUnknowns before = unknowns_;
      const BalanceSetup strict = widenCones(balance);
      balanced_ = balance.solve(unknowns_, nullptr, polish);
      out_.factorizations += balanced_.factorizations;
      balance.setup() = strict;
      if (balanced_.converged || r.residual > kWorthAnother * last) return;
      last = r.residual;
      unknowns_ = before;
    }
  }

  static BalanceSetup widenCones(ForceBalance& balance) {
    const BalanceSetup strict = balance.setup();
    balance.setup().friction_share = 0.5 * (1.0 + strict.friction_share);
    balance.setup().offset = 0.5 * strict.offset;
    return strict;
  }

  void makeStable(ForceBalance& balance) {
    const BalanceSetup strict = widenCones(balance);
    StabilizeOptions o;
    o.lambda_floor_per_s2 = kLambdaFloor_per_s2;
    o.stop = [this] { return stopped(); };
    o.progress = [this](int k, double l) { say("stability %.0f lambda_min %.4g", double(k), l); };
    o.balance.stop = o.stop;
    o.balance.max_iterations = 30;
    const StabilizeResult r = stabilize(shell_, balance, unknowns_, o);
    out_.factorizations += r.factorizations;
    balance.setup() = strict;
  }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  bool stopped() const {
    return (options_.cancelled && options_.cancelled()) ||
           (options_.time_budget_s > 0.0 && seconds() > options_.time_budget_s);
  }
  void say(const char* format, double a = 0.0, double b = 0.0) const {
    if (!options_.progress) return;
    char text[120];
    std::snprintf(text, sizeof text, format, a, b);
    options_.progress(text);
  }

  Result<InversionResult> finish(ForceBalance& balance) {
    out_.load_balanced = load_;
    out_.rest = unknowns_.rest;
    out_.rotations = unknowns_.rotations;
    out_.contact_forces = balance.contactForces(balance.gradient(unknowns_));
    say("solved after %.3g s", seconds());
    CertificateOptions c;
    c.redrapes = options_.redrapes;
    c.stop = [this] { return stopped(); };
    auto certificate = certify(shell_, problem_.target.positions, out_.rest, out_.rotations,
                               problem_.fixed, problem_.contacts, c);
    if (!certificate) return certificate.error();
    out_.certificate = std::move(certificate).value();
    out_.seconds = seconds();
    if (out_.certificate.holds()) {
      out_.status = InversionStatus::kCertified;
    } else if (out_.proof) {
      out_.status = InversionStatus::kInfeasible;
      out_.reason = "the shell slides off as a whole, whatever its rest shape";
    } else if (stopped()) {
      out_.status = InversionStatus::kBudget;
      out_.reason = options_.cancelled && options_.cancelled() ? "stopped" : "time ran out";
    } else {
      out_.reason =
          !out_.certificate.balanced() ? "no rest shape was found that balances the forces"
          : !out_.certificate.stable() ? "the equilibrium that was found is not stable"
                                       : "a perturbed shell does not return to the target";
    }
    return out_;
  }

  const InversionProblem& problem_;
  const InversionOptions& options_;
  InverseShell shell_;
  Clock::time_point start_ = Clock::now();
  RestUnknowns unknowns_;
  BalanceResult balanced_;
  double load_ = 0.0;  ///< Share of gravity that is balanced.
  InversionResult out_;
};

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
  return Inverter(problem, options, std::move(shell).value()).run();
}

}  // namespace tenter
