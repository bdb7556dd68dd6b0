// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inversion.h"

#include <chrono>
#include <cstdio>

#include "contact_load.h"
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
    Points3 forces;
    if (auto done = chooseForces(&forces); !done) return done.error();
    BalanceSetup setup;
    setup.fixed = problem_.fixed;
    setup.contacts = problem_.contacts;
    ForceBalance balance(shell_, problem_.target.positions, setup);
    BalanceOptions o;
    o.stop = [this] { return stopped(); };
    o.progress = [this](int k, double r) { say("balance %.0f residual %.3g", double(k), r); };
    balanced_ = balance.solve(unknowns_, &forces, o);
    out_.factorizations += balanced_.factorizations;
    if (!balanced_.converged && !problem_.contacts.empty()) {
      balanced_ = balance.solve(unknowns_, nullptr, o);
      out_.factorizations += balanced_.factorizations;
    }
    return finish(balance);
  }

 private:
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

  Result<void> chooseForces(Points3* forces) {
    auto system = shell_.system(problem_.target.positions, problem_.fixed);
    if (!system) return system.error();
    const SparseLower& h = system->hessian(system->restState(), Projection::kNone);
    Eigen::VectorXd gradient;
    system->gradient(system->restState(), gradient);
    std::vector<char> fixed(static_cast<std::size_t>(shell_.vertexCount()), 0);
    for (const int v : problem_.fixed) fixed[v] = 1;
    std::vector<int> dof(fixed.size(), -1);
    int next = 0;
    for (std::size_t v = 0; v < fixed.size(); ++v) {
      if (fixed[v]) continue;
      dof[v] = next;
      next += 3;
    }
    std::vector<LoadCone> cones;
    Eigen::VectorXd load = -gradient;
    const double offset = 0.02 * shell_.weight_N(problem_.target.positions) / shell_.vertexCount();
    for (const Contact& c : problem_.contacts) {
      cones.push_back({dof[c.vertex], c.normal, 0.975 * c.friction});
      load.segment<3>(dof[c.vertex]) += offset * c.normal;
    }
    SparseCholesky cholesky(h);
    const ContactLoadResult r =
        solveContactLoad(h, load, cones, cholesky, [this] { return stopped(); });
    out_.factorizations += r.factorizations;
    say("contact load: converged %.0f after %.0f factorizations", r.converged ? 1.0 : 0.0, r.factorizations);
    *forces = r.forces;
    for (std::size_t i = 0; i < cones.size(); ++i)
      forces->col(static_cast<Eigen::Index>(i)) += offset * problem_.contacts[i].normal;
    return {};
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
