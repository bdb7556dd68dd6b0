// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/shell_dynamics.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "contact_search.h"
#include "free_coordinates.h"
#include "friction_step.h"
#include "tenter/mechanics/equilibrium.h"

namespace tenter {
namespace {

/// Residual that a step has to meet, of a vertex's mean weight.
constexpr double kTolerance = 1e-8;
/// Shortest step, of the longest.
constexpr double kShortest = 1.0 / 4096.0;
/// Steps grow by this after easy ones; second order stays stable below 2.4.
constexpr double kStepGrowth = 1.5;
constexpr int kEasyIterations = 6;
/// Lengths of the shell's size: penetration that sends a step back, and how far beyond what its
/// speed covers a vertex is looked after.
constexpr double kPenetration = 1e-4, kLookout = 2e-3;
constexpr int kMaxRelinearisations = 3;
/// Steps of first order after a vertex has landed or stuck: two, so that no velocity from before
/// is extrapolated.
constexpr int kFirstOrderSteps = 2;

/// Edge rotations in equilibrium at the given pose.
Result<Eigen::VectorXd> settledRotations(const InverseShell& shell, const ShellStart& start) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(shell.rotationCount());
  if (shell.rotationCount() == 0) return zero;
  std::vector<int> all;
  for (int v = 0; v < shell.vertexCount(); ++v) all.push_back(v);
  auto system = shell.system(start.rest, all);
  if (!system) return system.error();
  ClothState state = system->restState();
  state.q = shell.coordinates(start.pose, zero);
  EquilibriumOptions options;
  options.force_tolerance_N = 1e-2 * kTolerance * shell.weight_N(start.rest) / shell.vertexCount();
  EquilibriumSolver(*system).solve(state, options);
  return Eigen::VectorXd(state.q.tail(shell.rotationCount()));
}

}  // namespace

struct ShellDynamics::Impl {
  Impl(ClothSystem cloth, const InverseShell& shell, const ShellStart& start,
       std::vector<MovingObstacle> obstacles, DynamicsOptions dynamics_options)
      : system(std::move(cloth)),
        options(std::move(dynamics_options)),
        triangles(shell.target().triangles),
        state(system.restState()),
        size_m(sizeOf(start.pose)),
        tolerance_N(kTolerance * shell.mass(start.rest).mean() *
                    std::max(shell.material().gravity_m_per_s2.norm(), 1.0)),
        stepper(system, firstDofs(shell.vertexCount(), start.fixed), tolerance_N),
        search(std::move(obstacles), shell.vertexCount(), start.contacts),
        start_pose(start.pose),
        contacts(static_cast<std::size_t>(shell.vertexCount())) {
    if (options.air) air.emplace(*options.air, triangles);
    counts.shortest_step_s = options.step_s;
  }
  Impl(const Impl&) = delete;

  bool step(double length_s);
  StepEquation equationOf(double length_s);
  void addContact(StepEquation& e, int vertex, double length_s, const VertexGap& gap,
                  const Vec3& at) const;
  void findContacts(StepEquation& e, double length_s) const;
  bool mendContacts(StepEquation& e, double length_s, const ClothState& end);
  void accept(const StepEquation& e, const StepOutcome& outcome, double length_s);
  Eigen::Map<const Points3> positions() const {
    return state.positions(static_cast<int>(contacts.size()));
  }
  bool stopped() const { return options.stop && options.stop(); }

  ClothSystem system;
  DynamicsOptions options;
  std::vector<Triangle> triangles;
  ClothState state;
  double size_m, tolerance_N;
  FrictionStep stepper;
  ContactSearch search;
  std::optional<AirDrag> air;
  SparseLower damping;
  Points3 start_pose;
  Eigen::VectorXd x, v, x_before, v_before;  ///< Of this step's start and of the last one's.
  double time_s = 0.0, last_step_s = 0.0, next_step_s = 0.0;
  int first_order_steps = 1;  ///< To come.
  double deepest_now_m = 0.0;
  std::vector<VertexContact> contacts;
  Counts counts;
};

StepEquation ShellDynamics::Impl::equationOf(double length_s) {
  StepEquation e;
  e.mass_damping_per_s = options.mass_damping_per_s;
  if (first_order_steps > 0 || !options.second_order) {
    e.h_s = length_s;
    e.from = x;
    e.v_from = v;
  } else {
    // Variable-step BDF2 for x' = v and v' = a alike.
    const double w = length_s / last_step_s, all = 1.0 + 2.0 * w;
    const double now = (1.0 + w) * (1.0 + w) / all, before = w * w / all;
    e.h_s = length_s * (1.0 + w) / all;
    e.from = now * x - before * x_before;
    e.v_from = now * v - before * v_before;
  }
  if (options.stiffness_damping_s > 0.0) {
    damping = system.hessian(state, Projection::kPositiveSemiDefinite);
    for (double& value : damping.value) value *= options.stiffness_damping_s;
    e.damping = &damping;
  }
  if (air) {
    air->setShape(positions());
    e.air = &*air;
  }
  if (!search.empty()) findContacts(e, length_s);
  return e;
}

/// The gap, known at the place `at`, goes on along its normal: at the end of the step it is
/// gap + n . (from + h v - at).
void ShellDynamics::Impl::addContact(StepEquation& e, int vertex, double length_s,
                                     const VertexGap& gap, const Vec3& at) const {
  StepContact c;
  c.vertex = vertex;
  c.obstacle = gap.obstacle;
  c.normal = gap.normal;
  c.friction = search.friction(vertex, gap.obstacle);
  const Vec3 carried = search.obstacle(gap.obstacle).motion.velocityAt(at, time_s + length_s);
  const Vec3 from = e.from.segment<3>(stepper.firstDof()[vertex]);
  const double normal_speed = -(gap.gap_m + c.normal.dot(from - at)) / e.h_s;
  c.still = carried + (normal_speed - carried.dot(c.normal)) * c.normal;
  const auto same = std::find_if(e.contacts.begin(), e.contacts.end(),
                                 [&](const StepContact& o) { return o.vertex == vertex; });
  if (same != e.contacts.end()) {
    *same = c;
  } else {
    e.contacts.push_back(c);
  }
}

void ShellDynamics::Impl::findContacts(StepEquation& e, double length_s) const {
  const Points3 velocity = stepper.spread(v);
  const double fall = system.setup().gravity_m_per_s2.norm() * length_s * length_s;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (stepper.firstDof()[k] < 0) continue;
    const int vertex = static_cast<int>(k);
    const Vec3 place = positions().col(vertex);
    const double reach = kLookout * size_m + fall + 2.0 * velocity.col(vertex).norm() * length_s;
    if (search.isFar(vertex, place, reach)) continue;
    const VertexGap gap = search.gap(vertex, place, time_s + length_s);
    if (gap.gap_m <= reach) addContact(e, vertex, length_s, gap, place);
  }
}

/// Looks again where the end of the step lies inside an obstacle: curved ones leave their tangent
/// planes, and fast vertices come from afar. False if nothing had to change.
bool ShellDynamics::Impl::mendContacts(StepEquation& e, double length_s, const ClothState& end) {
  deepest_now_m = 0.0;
  bool changed = false;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (stepper.firstDof()[k] < 0) continue;
    const int vertex = static_cast<int>(k);
    const Vec3 place = end.q.segment<3>(3 * static_cast<Eigen::Index>(k));
    if (search.isFar(vertex, place, 0.0)) continue;
    const VertexGap gap = search.gap(vertex, place, time_s + length_s);
    deepest_now_m = std::max(deepest_now_m, -gap.gap_m);
    if (gap.gap_m > -kPenetration * size_m) continue;
    addContact(e, vertex, length_s, gap, place);
    changed = true;
  }
  return changed;
}

bool ShellDynamics::Impl::step(double length_s) {
  StepEquation e = equationOf(length_s);
  ClothState end = state;
  Eigen::VectorXd end_v = v;
  for (int round = 0;; ++round) {
    const StepOutcome outcome = stepper.solve(e, end, end_v, options.stop);
    counts.iterations += outcome.iterations;
    counts.factorizations += outcome.factorizations;
    if (!outcome.converged) return false;
    if (search.empty() || !mendContacts(e, length_s, end)) {
      state = end;
      x_before = std::exchange(x, e.from + e.h_s * end_v);
      v_before = std::exchange(v, end_v);
      accept(e, outcome, length_s);
      return true;
    }
    if (round == kMaxRelinearisations) return false;
  }
}

void ShellDynamics::Impl::accept(const StepEquation& e, const StepOutcome& outcome,
                                 double length_s) {
  std::vector<VertexContact> before(contacts.size());
  before.swap(contacts);
  if (first_order_steps > 0) --first_order_steps;
  for (std::size_t i = 0; i < e.contacts.size(); ++i) {
    const auto vertex = static_cast<std::size_t>(e.contacts[i].vertex);
    contacts[vertex] = outcome.contacts[i];
    const ContactMode then = before[vertex].mode, now = contacts[vertex].mode;
    const bool landed = then == ContactMode::kOff && now != ContactMode::kOff;
    const bool stuck = then == ContactMode::kSliding && now == ContactMode::kStuck;
    if (landed || stuck) first_order_steps = kFirstOrderSteps;
  }
  time_s += length_s;
  last_step_s = length_s;
  ++counts.steps;
  counts.worst_residual_N = std::max(counts.worst_residual_N, outcome.residual_N);
  counts.deepest_m = std::max(counts.deepest_m, deepest_now_m);
  counts.shortest_step_s = std::min(counts.shortest_step_s, length_s);
  counts.largest_displacement_m = std::max(counts.largest_displacement_m,
                                           (positions() - start_pose).colwise().norm().maxCoeff());
}

ShellDynamics::ShellDynamics(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ShellDynamics::ShellDynamics(ShellDynamics&&) noexcept = default;
ShellDynamics::~ShellDynamics() = default;

Result<ShellDynamics> ShellDynamics::create(const InverseShell& shell, ShellStart start,
                                            std::vector<MovingObstacle> obstacles,
                                            DynamicsOptions options) {
  require(options.step_s > 0.0, "ShellDynamics: the step must be positive");
  for (const Contact& c : start.contacts) {
    if (c.obstacle < 0 || c.obstacle >= static_cast<int>(obstacles.size())) {
      return badInput("", "contact of vertex " + std::to_string(c.vertex),
                      "is with obstacle " + std::to_string(c.obstacle) + " of " +
                          std::to_string(obstacles.size()));
    }
  }
  auto system = shell.system(start.rest, start.fixed);
  if (!system) return system.error();
  if (static_cast<int>(start.fixed.size()) >= shell.vertexCount())
    return badInput("", "fixed", "holds every vertex: nothing can move");
  auto rotations = settledRotations(shell, start);
  if (!rotations) return rotations.error();
  auto impl = std::make_unique<Impl>(std::move(system).value(), shell, start, std::move(obstacles),
                                     std::move(options));
  impl->state.q = shell.coordinates(start.pose, *rotations);
  impl->x = impl->x_before = impl->stepper.dofsOf(impl->state);
  impl->v = impl->v_before = Eigen::VectorXd::Zero(impl->x.size());
  impl->next_step_s = impl->options.step_s;
  for (const Contact& c : start.contacts) {
    VertexContact& contact = impl->contacts[static_cast<std::size_t>(c.vertex)];
    contact.mode = ContactMode::kStuck;
    contact.obstacle = c.obstacle;
    contact.gap_m = 0.0;
  }
  return ShellDynamics(std::move(impl));
}

AdvanceEnd ShellDynamics::advanceTo(double until_s) {
  Impl& s = *impl_;
  const double slack = 1e-9 * s.options.step_s;
  while (s.time_s < until_s - slack) {
    if (s.stopped()) return AdvanceEnd::kStopped;
    // Equal steps to the end, so that none is a remnant.
    const double left = until_s - s.time_s;
    const double length = left / std::ceil(left / s.next_step_s - 1e-9);
    const int iterations = s.counts.iterations;
    if (s.step(length)) {
      if (s.counts.iterations - iterations <= kEasyIterations)
        s.next_step_s = std::min(s.options.step_s, kStepGrowth * s.next_step_s);
      continue;
    }
    if (s.stopped()) return AdvanceEnd::kStopped;
    ++s.counts.rejected;
    s.next_step_s = 0.5 * length;
    if (s.next_step_s < kShortest * s.options.step_s) return AdvanceEnd::kStuckInTime;
  }
  return AdvanceEnd::kReached;
}

double ShellDynamics::time_s() const { return impl_->time_s; }
Points3 ShellDynamics::positions() const { return impl_->positions(); }
Eigen::VectorXd ShellDynamics::coordinates() const { return impl_->state.q; }
Points3 ShellDynamics::velocities() const { return impl_->stepper.spread(impl_->v); }
const std::vector<VertexContact>& ShellDynamics::contacts() const { return impl_->contacts; }
const ShellDynamics::Counts& ShellDynamics::counts() const { return impl_->counts; }
double ShellDynamics::tolerance_N() const { return impl_->tolerance_N; }

void ShellDynamics::displace(const Points3& displacement_m) {
  require(impl_->counts.steps == 0, "ShellDynamics: displaced after it has moved");
  for (std::size_t v = 0; v < impl_->contacts.size(); ++v) {
    const int dof = impl_->stepper.firstDof()[v];
    if (dof >= 0) impl_->x.segment<3>(dof) += displacement_m.col(static_cast<Eigen::Index>(v));
  }
  impl_->x_before = impl_->x;
  impl_->stepper.place(impl_->x, impl_->state);
}

void ShellDynamics::setVelocities(const Points3& velocities_m_per_s) {
  for (std::size_t v = 0; v < impl_->contacts.size(); ++v) {
    const int dof = impl_->stepper.firstDof()[v];
    if (dof >= 0) impl_->v.segment<3>(dof) = velocities_m_per_s.col(static_cast<Eigen::Index>(v));
  }
  impl_->first_order_steps = 1;
}

double ShellDynamics::kineticEnergy_J() const {
  const Eigen::VectorXd mass = impl_->system.dofMass();
  return 0.5 * (mass.array() * impl_->v.array().square()).sum();
}

double ShellDynamics::energy_J() const {
  return kineticEnergy_J() + impl_->system.energy(impl_->state);
}

}  // namespace tenter
