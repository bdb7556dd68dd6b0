// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inversion.h"

#include <chrono>
#include <cstdio>

#include "contact_forces.h"
#include "force_balance.h"

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;

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
    auto contact_forces = ContactForces::create(shell_, problem_.target.positions, setup);
    if (!contact_forces) return contact_forces.error();
    balanceForces(balance, *contact_forces);
    return finish(balance);
  }

 private:
  void balanceForces(ForceBalance& balance, ContactForces& contact_forces) {
    BalanceOptions o;
    o.stop = [this] { return stopped(); };
    o.progress = [this](int k, double r) { say("balance %.0f residual %.3g", double(k), r); };
    BalanceOptions frozen = o;
    frozen.worthwhile = 0.3;
    frozen.patience = 2;
    for (int outer = 0; outer < 12 && !stopped(); ++outer) {
      const auto f = contact_forces.solve(balance.gradient(unknowns_), balance.setup(), o.stop);
      out_.factorizations += f.factorizations;
      say("contact load: converged %.0f after %.0f factorizations", f.converged ? 1.0 : 0.0, f.factorizations);
      balanced_ = balance.solve(unknowns_, &f.forces, frozen);
      out_.factorizations += balanced_.factorizations;
      const RestUnknowns before = unknowns_;
      const BalanceSetup strict = balance.setup();
      balance.setup().friction_share = 0.5 * (1.0 + strict.friction_share);
      balance.setup().offset = 0.5 * strict.offset;
      BalanceOptions polish = o;
      polish.worthwhile = 0.5;
      polish.patience = 3;
      balanced_ = balance.solve(unknowns_, nullptr, polish);
      out_.factorizations += balanced_.factorizations;
      balance.setup() = strict;
      if (balanced_.converged) return;
      unknowns_ = before;
    }
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
    } else if (stopped()) {
      out_.status = InversionStatus::kBudget;
      out_.reason = "time ran out";
    } else {
      out_.reason = out_.certificate.balanced() ? "the equilibrium that was found is not stable"
                                                : "forces could not be balanced";
    }
    return out_;
  }

  const InversionProblem& problem_;
  const InversionOptions& options_;
  InverseShell shell_;
  Clock::time_point start_ = Clock::now();
  RestUnknowns unknowns_;
  BalanceResult balanced_;
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
