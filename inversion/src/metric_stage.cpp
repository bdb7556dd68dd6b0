// SPDX-License-Identifier: GPL-3.0-or-later
#include "metric_stage.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contact_forces.h"
#include "free_coordinates.h"
#include "metric_barrier.h"
#include "soft_modes.h"

namespace tenter {
namespace {

constexpr int kMaxRounds = 60;
/// Soft motions that the search begins with, that a round adds at most, and that it keeps.
constexpr int kFirstModes = 16, kMoreModes = 10, kKeptModes = 24;
/// The restricted problem asks for this times the floor, or for this share of the elastic Hessian's
/// smallest eigenvalue if that is more: what is barely stable a breath moves to another shape.
constexpr double kOvershoot = 4.0, kComfortable = 0.1;
/// Rounds that are spent on that once something is stable, and what rounding may take of it.
constexpr int kRoundsForComfort = 6;
constexpr double kSlack = 0.99;
/// Modes this far above the lowest one, in its own size, are no danger.
constexpr double kDangerous = 0.9;
constexpr int kBisections = 8;
constexpr double kMostProducts = 5e7;  ///< Numbers of the interior-point method's largest matrix.
constexpr ConeMargin kMargin{0.9, 0.3};

class Search {
 public:
  Search(InverseShell& shell, const RestNewton& problem, const MetricElements& elements,
         const MetricOptions& options)
      : shell_(shell),
        problem_(problem),
        elements_(elements),
        options_(options),
        barrier_(shell, elements, problem.fixed(), problem.contacts()),
        held_(problem.fixed()) {
    for (const Contact& c : problem.contacts()) held_.push_back(c.vertex);
    free_ = freeCoordinates(shell.vertexCount(), held_);
  }

  MetricResult run() {
    const std::optional<Eigen::VectorXd> least = leastEnergy();
    if (least && barrier_.inside(*least) && isStable(*least)) return found(*least, true);
    const auto balanced = barrier_.balance({options_.stop});
    if (balanced == MetricBarrier::Outcome::kInfeasible) return proved();
    if (balanced != MetricBarrier::Outcome::kReached) return counted({});
    say("balanced", 0.0);
    if (free_.empty()) return found(barrier_.z(), true);
    const auto elastic = modesAt(Eigen::VectorXd::Zero(elements_.count()), kFirstModes);
    Eigen::MatrixXd columns = elastic.second;
    if (columns.cols() == 0) return found(barrier_.z(), false);
    const double comfortable =
        std::max(kOvershoot * options_.lambda_floor_per_s2, kComfortable * elastic.first[0]);
    std::optional<Eigen::VectorXd> best;
    double best_lambda = options_.lambda_floor_per_s2;
    int rounds_with_best = 0;
    for (int round = 0; round < kMaxRounds && !stopped(); ++round) {
      if (!affordable(columns.cols())) break;
      const auto outcome = barrier_.stabilize(columns, comfortable, {options_.stop});
      if (outcome == MetricBarrier::Outcome::kInfeasible) return proved();
      say("restricted", barrier_.lambda_per_s2());
      // Neither enough nor provably nothing can be reached.
      if (outcome == MetricBarrier::Outcome::kStalled &&
          (barrier_.lambda_per_s2() < 0.0 ||
           barrier_.boundOnLambda_per_s2() < options_.lambda_floor_per_s2))
        break;
      const auto [values, vectors] = modesAt(barrier_.z(), kMoreModes);
      if (values.size() == 0) break;
      say("stability", values[0]);
      if (values[0] >= best_lambda) {
        best = barrier_.z();
        best_lambda = values[0];
      }
      if (best && (best_lambda >= comfortable || ++rounds_with_best > kRoundsForComfort)) break;
      Eigen::Index more = 0;
      const double danger = values[0] + kDangerous * std::abs(values[0]);
      while (more < values.size() && values[more] < danger) ++more;
      const Eigen::MatrixXd kept = barrier_.softest(columns, kKeptModes);
      columns.resize(vectors.rows(), kept.cols() + more);
      columns << kept, vectors.leftCols(more);
    }
    if (!best) return found(barrier_.z(), false);
    return found(nearer(least, *best, std::min(best_lambda, comfortable)), true);
  }

 private:
  /// The state of least elastic energy, within bounds or not.
  std::optional<Eigen::VectorXd> leastEnergy() {
    auto forces = ContactForces::create(shell_, problem_);
    if (!forces) return std::nullopt;
    const RestUnknowns target{problem_.pose(), Eigen::VectorXd::Zero(shell_.rotationCount())};
    const Eigen::VectorXd wanted = wantedZ();
    Eigen::VectorXd gradient = problem_.gradient(target, 1.0);
    gradient += elements_.forces(wanted);
    const auto solved = forces->solve(gradient, kMargin, 1.0, options_.stop);
    factorizations_ += solved.factorizations;
    if (!solved.converged) return std::nullopt;
    Eigen::VectorXd z = elements_.works(solved.motion);
    for (int i = 0; i < elements_.count(); ++i) z[i] /= elements_.all()[i].stiffness;
    return wanted + z;
  }

  /// Of the wanted rest angles, and the target's lengths.
  Eigen::VectorXd wantedZ() const {
    Eigen::VectorXd z = Eigen::VectorXd::Zero(elements_.count());
    if (options_.wanted_angle_rad.size() == 0) return z;
    for (int i = 0; i < elements_.count(); ++i) {
      const MetricElement& e = elements_.all()[i];
      if (e.hinge) z[i] = e.value - options_.wanted_angle_rad[e.edge];
    }
    return z;
  }

  std::pair<Eigen::VectorXd, Eigen::MatrixXd> modesAt(const Eigen::VectorXd& z, int count) {
    shell_.setElementRest(elements_.restOf(z));
    auto system = shell_.system(problem_.pose(), held_);
    shell_.setElementRest(std::nullopt);
    if (!system) return {};
    ClothState state = system->restState();
    const SparseLower& h = system->hessian(state, Projection::kNone);
    if (!cholesky_) cholesky_.emplace(h);
    const SoftModes modes = softModes(h, system->dofMass(), *cholesky_, count);
    factorizations_ += modes.factorizations;
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(3 * shell_.vertexCount(), modes.vectors.cols());
    for (std::size_t k = 0; k < free_.size(); ++k)
      full.row(free_[k]) = modes.vectors.row(static_cast<Eigen::Index>(k));
    return {modes.values, full};
  }

  bool isStable(const Eigen::VectorXd& z) {
    return free_.empty() || lambdaAt(z) >= options_.lambda_floor_per_s2;
  }

  /// Whether the products of that many motions, one row an element, are no burden on memory.
  bool affordable(Eigen::Index motions) const {
    return static_cast<double>(elements_.count()) * 0.5 * static_cast<double>(motions) *
               static_cast<double>(motions + 1) <=
           kMostProducts;
  }

  double lambdaAt(const Eigen::VectorXd& z) {
    const auto values = modesAt(z, 1).first;
    return values.size() > 0 ? values[0] : -1.0;
  }

  /// As near the state of least energy as stays as stable: on the way there H changes linearly, and
  /// bounds and cones are convex.
  Eigen::VectorXd nearer(const std::optional<Eigen::VectorXd>& least, const Eigen::VectorXd& stable,
                         double lambda) {
    if (!least) return stable;
    double good = 1.0, bad = 0.0;
    for (int k = 0; k < kBisections && !stopped(); ++k) {
      const double middle = 0.5 * (good + bad);
      const Eigen::VectorXd z = *least + middle * (stable - *least);
      (barrier_.inside(z) && lambdaAt(z) >= kSlack * lambda ? good : bad) = middle;
    }
    return *least + good * (stable - *least);
  }

  MetricResult found(const Eigen::VectorXd& z, bool stable) {
    barrier_.set(z);
    MetricResult out;
    out.rest = elements_.restOf(barrier_.z());
    out.stable = stable;
    if (!free_.empty()) out.lambda_min_per_s2 = lambdaAt(barrier_.z());
    return counted(std::move(out));
  }

  MetricResult proved() {
    MetricResult out;
    out.proof = barrier_.proof();
    return counted(std::move(out));
  }

  MetricResult counted(MetricResult out) const {
    out.factorizations = factorizations_ + barrier_.factorizations();
    return out;
  }

  bool stopped() const { return options_.stop && options_.stop(); }
  void say(const char* stage, double lambda) const {
    if (options_.progress) options_.progress(stage, lambda);
  }

  InverseShell& shell_;
  const RestNewton& problem_;
  const MetricElements& elements_;
  const MetricOptions& options_;
  MetricBarrier barrier_;
  std::vector<int> held_, free_;
  std::optional<SparseCholesky> cholesky_;
  int factorizations_ = 0;
};

}  // namespace

Result<void> checkMetricRest(const InverseShell& shell) {
  const auto elements = MetricElements::create(shell);
  if (!elements) return elements.error();
  return {};
}

Result<MetricResult> findMetricRest(InverseShell& shell, const RestNewton& problem,
                                    const MetricOptions& options) {
  const auto elements = MetricElements::create(shell);
  if (!elements) return elements.error();
  if (auto free = shell.system(problem.pose(), problem.fixed()); !free) return free.error();
  return Search(shell, problem, *elements, options).run();
}

}  // namespace tenter
