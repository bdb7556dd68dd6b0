// SPDX-License-Identifier: GPL-3.0-or-later
#include "simulated_test.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tenter {
namespace {

/// Two equilibria of one frame are different shapes beyond this share of the sheet's diagonal.
constexpr double kSameShape = 1e-3;
/// Share of that below which shapes need not be told apart.
constexpr double kNearEnough = 0.05;
/// A warm start that takes longer than this is no better than a cold one.
constexpr int kWarmIterations = 30;
constexpr int kColdIterations = 300;
/// Cloth that snaps into another stable shape takes some hundred to settle there.
constexpr int kRetryIterations = 200;
/// Curves that differ by no more than this share of themselves at any knot lead from the same start
/// to the same shape.
constexpr double kSameCurves = 0.05;

std::shared_ptr<const StrainLaw> noLaw() {
  const StiffnessCurve zero = StiffnessCurve::constant(0.0);
  return std::make_shared<DiagonalLaw>(std::array{zero, zero, zero});
}

bool sameBasis(const std::shared_ptr<const SplineBasis>& a,
               const std::shared_ptr<const SplineBasis>& b) {
  if (!a || !b) return a == b;
  return a->size() == b->size() && a->even() == b->even() && a->knots() == b->knots();
}

/// Further columns are parameters that this simulation does not have, such as bending in a plane.
Eigen::MatrixXd widened(const Eigen::MatrixXd& matrix, Eigen::Index columns) {
  Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(matrix.rows(), columns);
  wide.leftCols(matrix.cols()) = matrix;
  return wide;
}

bool nearlyEqual(const StiffnessCurve& a, const StiffnessCurve& b) {
  for (const StiffnessCurve* knots : {&a, &b})
    for (const double strain : knots->strains()) {
      const double ka = a.evaluate(strain).stiffness, kb = b.evaluate(strain).stiffness;
      if (std::abs(ka - kb) > kSameCurves * std::max(std::abs(ka), std::abs(kb))) return false;
    }
  return true;
}

double diagonalOf(const SheetMesh& sheet) {
  const Points3& x = sheet.rest.positions;
  return (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).norm();
}

}  // namespace

void FitTest::setLaws(const ClothLaws& /*laws*/) {
  require(false, "this kind of test takes parameters only");
}

MultistabilityReport FitTest::crossCheck(int /*frame*/) { return {}; }

SimulatedTest::SimulatedTest(std::shared_ptr<const Measurement> measurement,
                             const ClothModel& model, const FitTestOptions& options)
    : measurement_(std::move(measurement)),
      model_(&model),
      options_(options),
      membrane_law_(std::make_shared<SwitchableLaw>(noLaw())),
      bending_law_(std::make_shared<SwitchableLaw>(noLaw())) {}

int SimulatedTest::addReplica(SheetMesh sheet, SystemSetup setup) {
  auto replica = std::make_unique<Replica>();
  replica->sheet = std::move(sheet);
  replica->setup = std::move(setup);
  replica->pool = std::make_unique<SimulationPool>([this, r = replica.get()] {
    return ClothSystem::create(r->sheet, *model_, {membrane_law_, bending_law_}, r->setup);
  });
  replicas_.push_back(std::move(replica));
  return static_cast<int>(replicas_.size()) - 1;
}

void SimulatedTest::addFrame(int replica, int source) {
  Frame frame;
  frame.replica = replica;
  frame.source = source;
  frames_.push_back(std::move(frame));
}

Result<void> SimulatedTest::tryReplica() {
  const Result<SimulationPool::Lease> lease = replicas_.front()->pool->lease();
  if (!lease.ok()) return lease.error().in(measurement_->name);
  return {};
}

std::vector<int> SimulatedTest::chosenFrames() const {
  const int all = static_cast<int>(measurement_->frames.size());
  const int count = options_.max_frames > 0 ? std::min(options_.max_frames, all) : all;
  std::vector<int> chosen(count);
  for (int i = 0; i < count; ++i)
    chosen[i] =
        count > 1 ? static_cast<int>(std::lround(1.0 * i * (all - 1) / (count - 1))) : all - 1;
  return chosen;
}

void SimulatedTest::exchange(const ClothLaws& laws, Bases bases,
                             const Eigen::VectorXd& parameters) {
  membrane_law_->set(laws.membrane ? laws.membrane : noLaw());
  bending_law_->set(laws.bending ? laws.bending : noLaw());
  parameters_ = parameters;
  if (generation_ > 0 &&
      std::equal(bases.begin(), bases.end(), bases_.begin(), bases_.end(), sameBasis))
    return;
  // Systems count their parameters once, when they are built.
  for (const auto& replica : replicas_) replica->pool->clear();
  bases_ = std::move(bases);
  ++generation_;
}

void SimulatedTest::setParameters(const ParameterSet& parameters) {
  require(parameters.model == model_, "a test takes parameters of the model that it was made for");
  Bases bases;
  for (const ComponentCurve& component : parameters.components) bases.push_back(component.basis);
  exchange(makeLaws(*model_, parameters.components), std::move(bases), parameters.coefficients());
  curves_ = std::make_shared<const Curves>(parameters.components);
}

void SimulatedTest::setLaws(const ClothLaws& laws) {
  exchange(laws, {}, {});
  curves_ = nullptr;
  for (Frame& frame : frames_) frame.current = {};  // parameters no longer tell laws apart
}

EquilibriumOptions SimulatedTest::solverOptions(int max_iterations) const {
  EquilibriumOptions solver;
  solver.prove_stability = require_proof_;
  solver.max_iterations = max_iterations;
  solver.cancelled = cancelled_;
  solver.force_tolerance_N =
      options_.equilibrium_tolerance_N > 0.0 ? options_.equilibrium_tolerance_N : forceTolerance_N;
  return solver;
}

bool SimulatedTest::isCurrent(const Solution& s) const {
  return !s.outcome.cancelled && s.generation == generation_ &&
         s.parameters.size() == parameters_.size() && s.parameters == parameters_;
}

std::vector<ClothState> SimulatedTest::warmStarts(const Simulation& simulation,
                                                  const Solution& accepted) const {
  if (accepted.generation < 0) return {};
  if (accepted.generation != generation_ || accepted.tangent.size() == 0) return {accepted.state};
  const Eigen::Index count = accepted.tangent.cols();
  const Eigen::VectorXf change = (parameters_ - accepted.parameters).head(count).cast<float>();
  ClothState predicted = accepted.state;
  simulation.system.advance(predicted, (accepted.tangent * change).cast<double>(), 1.0);
  Eigen::VectorXd g;
  simulation.system.gradient(accepted.state, g);
  const double before = g.norm();
  simulation.system.gradient(predicted, g);
  if (g.norm() < before) return {predicted, accepted.state};
  return {accepted.state, predicted};
}

std::vector<ClothState> SimulatedTest::coldStarts(const Simulation& simulation, int frame) const {
  std::vector<ClothState> starts = otherStarts(simulation, frame);
  starts.insert(starts.begin(), startState(simulation, frame));
  return starts;
}

FrameOutcome SimulatedTest::solveFrom(Simulation& simulation, std::vector<ClothState> starts,
                                      int max_iterations, ClothState& state) const {
  FrameOutcome outcome;
  for (ClothState& start : starts) {
    state = std::move(start);
    const EquilibriumSummary summary =
        simulation.solver.solve(state, solverOptions(max_iterations));
    outcome.newton_steps += summary.newton_steps;
    outcome.factorizations += summary.factorizations;
    outcome.converged = summary.converged();
    outcome.stable = summary.converged() && summary.stable;
    outcome.proven = summary.converged() && summary.proven;
    outcome.cancelled = summary.termination == Termination::kCancelled;
    outcome.problem = describe(summary.termination);
    if (outcome.converged || outcome.cancelled) break;
  }
  if (outcome.converged) outcome.problem = outcome.stable ? "" : "unstable equilibrium";
  return outcome;
}

/// One more Newton step with the factors that proved the state stable: the error that the solver's
/// tolerance leaves, which soft bending turns into tenths of a standard deviation, becomes its
/// square.
void SimulatedTest::polish(Simulation& simulation, ClothState& state) {
  Eigen::VectorXd before, after;
  simulation.system.gradient(state, before);
  ClothState polished = state;
  simulation.system.advance(polished, simulation.solver.solveLinear(before), -1.0);
  simulation.system.gradient(polished, after);
  if (after.norm() < before.norm()) state = std::move(polished);
}

void SimulatedTest::rememberStart(Frame& frame, const ClothState& state) const {
  if (curves_) frame.from_start = {state, curves_};
}

FrameOutcome SimulatedTest::solveFromStart(Simulation& simulation, int index, int max_iterations,
                                           ClothState& state) {
  Frame& frame = frames_[index];
  if (curves_ && frame.from_start &&
      std::ranges::equal(*curves_, *frame.from_start->curves,
                         [](const ComponentCurve& a, const ComponentCurve& b) {
                           return nearlyEqual(a.curve, b.curve);
                         })) {
    FrameOutcome outcome = solveFrom(simulation, {frame.from_start->state}, kWarmIterations, state);
    if (outcome.stable || outcome.cancelled) return outcome;
  }
  FrameOutcome outcome =
      solveFrom(simulation, coldStarts(simulation, index), max_iterations, state);
  if (outcome.stable) rememberStart(frame, state);
  return outcome;
}

Eigen::MatrixXd SimulatedTest::solve(Simulation& simulation, int index, bool with_derivatives,
                                     FrameOutcome& outcome) {
  Frame& frame = frames_[index];
  Solution& current = frame.current;
  if (isCurrent(current)) {
    outcome = current.outcome;
    outcome.newton_steps = outcome.factorizations = 0;
    const bool proof_missing = require_proof_ && !outcome.proven;
    if (outcome.stable && (with_derivatives || proof_missing)) {
      outcome.stable = simulation.solver.factorize(current.state);
      outcome.proven = true;
      outcome.factorizations = 1;
      current.outcome.stable = outcome.stable;
      current.outcome.proven = true;
    }
  } else {
    Solution fresh{generation_, {}, parameters_, {}, {}};
    outcome =
        solveFrom(simulation, warmStarts(simulation, frame.accepted), kWarmIterations, fresh.state);
    if (!outcome.converged && !outcome.cancelled) {
      const FrameOutcome warm = outcome;
      // A frame that had a state and loses it says that the point is bad: the outer loop steps back
      // from it, so it is tried again once and not from everywhere.
      const bool had_state = frame.accepted.generation >= 0;
      std::vector<ClothState> starts = coldStarts(simulation, index);
      if (had_state) starts.resize(1);
      outcome = solveFrom(simulation, std::move(starts),
                          had_state ? kRetryIterations : kColdIterations, fresh.state);
      if (outcome.stable) rememberStart(frame, fresh.state);
      outcome.newton_steps += warm.newton_steps;
      outcome.factorizations += warm.factorizations;
    }
    if (outcome.stable) polish(simulation, fresh.state);
    fresh.outcome = outcome;
    current = std::move(fresh);
  }
  if (!outcome.stable) return {};
  if (!frame.weighed) {
    if (!with_derivatives && outcome.factorizations == 0)
      simulation.solver.factorize(current.state);
    weigh({simulation, current.state, index, nullptr});
    frame.weighed = true;
  }
  if (!with_derivatives) return {};
  Eigen::MatrixXd derivative;
  simulation.system.gradientByParameter(current.state, derivative);
  derivative = -simulation.solver.solveLinear(derivative);
  current.tangent = derivative.cast<float>();
  if (isCurrent(frame.accepted)) frame.accepted = current;
  return derivative;
}

FrameOutcome SimulatedTest::evaluate(int frame, Eigen::VectorXd& residuals,
                                     Eigen::MatrixXd* jacobian) {
  FrameOutcome outcome;
  const Result<SimulationPool::Lease> lease = replicaOf(frame).pool->lease();
  if (!lease) {
    outcome.problem = lease.error().message();
    residuals.setZero(residualCount(frame));
    if (jacobian) jacobian->setZero(residuals.size(), parameters_.size());
    return outcome;
  }
  Simulation& simulation = **lease;
  const Eigen::MatrixXd derivative = solve(simulation, frame, jacobian != nullptr, outcome);
  const bool differentiable = jacobian && outcome.stable;
  Eigen::MatrixXd by_parameter;
  residualsOf(
      {simulation, frames_[frame].current.state, frame, differentiable ? &derivative : nullptr},
      residuals, differentiable ? &by_parameter : nullptr);
  if (!jacobian) return outcome;
  if (differentiable)
    *jacobian = widened(by_parameter, parameters_.size());
  else
    jacobian->setZero(residuals.size(), parameters_.size());
  return outcome;
}

void SimulatedTest::accept() {
  for (Frame& frame : frames_)
    if (frame.current.generation >= 0 && frame.current.outcome.converged)
      frame.accepted = frame.current;
}

void SimulatedTest::restart() {
  for (Frame& frame : frames_) {
    frame.accepted = frame.current = {};
    frame.from_start.reset();
  }
  reweigh();
}

void SimulatedTest::reweigh() {
  for (Frame& frame : frames_) frame.weighed = false;
}

MultistabilityReport SimulatedTest::crossCheck(int frame) {
  MultistabilityReport report;
  const Solution& current = frames_[frame].current;
  const Result<SimulationPool::Lease> lease = replicaOf(frame).pool->lease();
  if (!lease || !isCurrent(current) || !current.outcome.converged) return report;
  Simulation& simulation = **lease;
  ClothState again;
  if (!solveFromStart(simulation, frame, kColdIterations, again).converged) return report;
  const int nodes = replicaOf(frame).sheet.nodeCount();
  const Points3 difference = again.positions(nodes) - current.state.positions(nodes);
  report.checked = true;
  report.position_rms_m = std::sqrt(difference.squaredNorm() / nodes);
  report.disagrees = report.position_rms_m > kSameShape * diagonalOf(replicaOf(frame).sheet);
  report.energy_accepted_J = simulation.system.energy(current.state);
  report.energy_restarted_J = simulation.system.energy(again);
  return report;
}

bool SimulatedTest::adoptNearerShape(int index) {
  if (!startIsMeasured()) return false;
  Frame& frame = frames_[index];
  const Result<SimulationPool::Lease> lease = replicaOf(index).pool->lease();
  if (!lease || !isCurrent(frame.current) || !frame.current.outcome.stable) return false;
  Simulation& simulation = **lease;
  const int nodes = replicaOf(index).sheet.nodeCount();
  const double same = kSameShape * diagonalOf(replicaOf(index).sheet);
  const ClothState measured_shape = startState(simulation, index);
  const auto distance = [&](const ClothState& a, const ClothState& b) {
    return std::sqrt((a.positions(nodes) - b.positions(nodes)).squaredNorm() / nodes);
  };
  const double before = distance(frame.current.state, measured_shape);
  if (before < kNearEnough * same) return false;
  Solution again{generation_, {}, parameters_, {}, {}};
  again.outcome = solveFromStart(simulation, index, kRetryIterations, again.state);
  if (!again.outcome.stable || distance(again.state, frame.current.state) < kNearEnough * same ||
      distance(again.state, measured_shape) >= before)
    return false;
  frame.current = frame.accepted = std::move(again);
  return true;
}

FramePrediction SimulatedTest::predict(int frame, bool with_derivatives) {
  FramePrediction prediction;
  prediction.time_s = 1e-9 * static_cast<double>(measured(frame).time_ns);
  prediction.branch = measured(frame).branch;
  const Result<SimulationPool::Lease> lease = replicaOf(frame).pool->lease();
  if (!lease) {
    prediction.outcome.problem = lease.error().message();
    return prediction;
  }
  Simulation& simulation = **lease;
  const Eigen::MatrixXd derivative = solve(simulation, frame, with_derivatives, prediction.outcome);
  const ClothState& state = frames_[frame].current.state;
  const bool differentiable = with_derivatives && prediction.outcome.stable;
  fill({simulation, state, frame, differentiable ? &derivative : nullptr}, prediction);
  prediction.predicted_positions = state.positions(replicaOf(frame).sheet.nodeCount());
  if (prediction.force_by_parameter.size() > 0)
    prediction.force_by_parameter = widened(prediction.force_by_parameter, parameters_.size());
  if (prediction.summary_by_parameter.size() > 0)
    prediction.summary_by_parameter =
        widened(prediction.summary_by_parameter.transpose(), parameters_.size()).transpose();
  return prediction;
}

FitTest::StrainSamples SimulatedTest::strainSamples(int component) const {
  StrainSamples samples;
  const int membrane = static_cast<int>(model_->membrane_components.size());
  const int term = component < membrane ? 0 : 1;
  const int row = component < membrane ? component : component - membrane;
  if (row > 2) return samples;  // couplings have no strain of their own
  for (int f = 0; f < frameCount(); ++f) {
    const Solution& s =
        frames_[f].current.generation >= 0 ? frames_[f].current : frames_[f].accepted;
    const Result<SimulationPool::Lease> lease = replicaOf(f).pool->lease();
    if (s.generation < 0 || !s.outcome.converged || !lease) continue;
    const auto& terms = (*lease)->system.terms();
    if (term + 1 >= static_cast<int>(terms.size())) continue;  // the last one is gravity
    Eigen::Matrix3Xd strains;
    terms[term]->strains(s.state.q, strains);
    const Eigen::VectorXd areas = terms[term]->elementAreas();
    for (Eigen::Index e = 0; e < strains.cols(); ++e) {
      // A spring has one strain; the others read zero.
      if (model_->needs_grid && strains(row, e) == 0.0) continue;
      samples.strain.push_back(strains(row, e));
      samples.weight.push_back(areas[e]);
    }
  }
  return samples;
}

}  // namespace tenter
