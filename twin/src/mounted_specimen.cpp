// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/mounted_specimen.h"

#include <algorithm>
#include <cmath>

#include "hung_sample.h"

namespace tenter {
namespace {

constexpr double kLongestStep_m = 0.002;
constexpr int kMaxHalvings = 6;
constexpr double kProbe_m = 1e-7;  // of differences: a cord is nearly linear over it
constexpr double kSame_m = 1e-12;
constexpr double kHookedCord_m = 1.0;  // of which only changes matter

double longestWay(const MountedSpecimen::Positions& from, const MountedSpecimen::Positions& to) {
  double longest = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i)
    longest = std::max(longest, std::abs(to[i] - from[i]));
  return longest;
}

MountedSpecimen::Positions between(const MountedSpecimen::Positions& from,
                                   const MountedSpecimen::Positions& to, double share) {
  MountedSpecimen::Positions out;
  for (std::size_t i = 0; i < from.size(); ++i) out[i] = from[i] + share * (to[i] - from[i]);
  return out;
}

}  // namespace

struct MountedSpecimen::Impl {
  /// The cord of an actuator.
  struct Line {
    int axis, clip, cord;
    std::string name;
    double home_length_m, stiffness_N;  ///< Without tension; EA.
  };

  MountOptions options;
  std::optional<HungSample> sample;
  std::vector<Line> lines;
  std::array<int, kAxes> line_of{};  ///< -1: no cord.
  Moment moment;
  Statistics statistics;
  Eigen::MatrixXd dofs_by_position;  ///< Along the equilibrium, one column a line; or empty.

  void assignActuators();
  void draw(const Positions& positions_m);
  bool held() const { return options.clips == "held"; }
  bool pushes(int axis) const { return options.clips == "free" && lines.empty() && axis == 0; }
  void feelHeld(const Positions& positions_m);
  bool step(const Positions& positions_m);
  bool settle(const Positions& positions_m, bool foretell);
  void learn(const Positions& positions_m);
  double tension(const ClothState& state, const Line& line) const {
    return sample->system().cordTension_N(state, line.clip, line.cord);
  }
};

void MountedSpecimen::Impl::assignActuators() {
  for (const CordPlace& place : actuatorOrder(sample->rig())) {
    const RigCord& cord = sample->rig().clips[place.clip].cords[place.cord];
    const int axis = static_cast<int>(lines.size());
    require(axis < kAxes, "MountedSpecimen: more cords than actuators");
    line_of[static_cast<std::size_t>(axis)] = axis;
    lines.push_back({axis, place.clip, place.cord, cord.id, cord.cord.rest_length_m + cord.slack_m,
                     cord.cord.stiffness_N});
  }
}

void MountedSpecimen::Impl::draw(const Positions& positions_m) {
  for (const Line& line : lines) {
    const double slack_m =
        line.home_length_m - sample->rig().clips[line.clip].cords[line.cord].cord.rest_length_m;
    sample->draw(line.clip, line.cord, positions_m[line.axis] - slack_m);
  }
}

/// Nothing but the cords gives way.
void MountedSpecimen::Impl::feelHeld(const Positions& positions_m) {
  moment.at_m = positions_m;
  moment.stiffness_N_per_m.setZero();
  for (const Line& line : lines) {
    for (const double sign : {1.0, -1.0}) {
      Positions probe = positions_m;
      probe[line.axis] += sign * kProbe_m;
      draw(probe);
      moment.stiffness_N_per_m(line.axis, line.axis) +=
          sign * tension(sample->state(), line) / (2.0 * kProbe_m);
    }
  }
  draw(positions_m);
  for (const Line& line : lines) moment.tension_N[line.axis] = tension(sample->state(), line);
}

/// Begins where the last equilibrium's tangent leads; if that is no good, where it was.
bool MountedSpecimen::Impl::settle(const Positions& positions_m, bool foretell) {
  draw(positions_m);
  const ClothState before = sample->state();
  if (foretell) {
    Eigen::VectorXd way(lines.size());
    for (const Line& line : lines) way[line.axis] = positions_m[line.axis] - moment.at_m[line.axis];
    sample->system().advance(sample->state(), dofs_by_position * way, 1.0);
  }
  CaptureStatistics cost;
  const bool found = sample->solve(cost);
  statistics.newton_steps += cost.newton_steps;
  if (!found) {
    sample->state() = before;
    draw(moment.at_m);
    return false;
  }
  statistics.largest_residual_N = std::max(statistics.largest_residual_N, cost.largest_residual_N);
  return true;
}

bool MountedSpecimen::Impl::step(const Positions& positions_m) {
  ++statistics.solves;
  const bool known = dofs_by_position.size() > 0;
  if (!(known && settle(positions_m, true)) && !settle(positions_m, false)) return false;
  for (const Line& line : lines) {
    const double error_N =
        tension(sample->state(), line) - moment.tensionNear_N(line.axis, positions_m);
    if (!known) break;
    statistics.largest_error_N = std::max(statistics.largest_error_N, std::abs(error_N));
    statistics.sum_of_squares_N2 += error_N * error_N / static_cast<double>(lines.size());
  }
  learn(positions_m);
  return true;
}

/// Tensions, and by the implicit function theorem how they and the sheet go on from here:
/// H d(dof)/dx = -d(gradient)/dx.
void MountedSpecimen::Impl::learn(const Positions& positions_m) {
  ClothSystem& system = sample->system();
  const ClothState& state = sample->state();
  Eigen::MatrixXd pulls(system.dofCount(), static_cast<Eigen::Index>(lines.size()));
  Eigen::VectorXd behind, ahead;
  for (const Line& line : lines) {
    Positions probe = positions_m;
    probe[line.axis] += kProbe_m;
    draw(probe);
    system.gradient(state, ahead);
    probe[line.axis] -= 2.0 * kProbe_m;
    draw(probe);
    system.gradient(state, behind);
    pulls.col(line.axis) = (behind - ahead) / (2.0 * kProbe_m);
  }
  draw(positions_m);
  sample->commit();
  dofs_by_position.resize(0, 0);
  moment.at_m = positions_m;
  moment.stiffness_N_per_m.setZero();
  for (const Line& line : lines) moment.tension_N[line.axis] = tension(state, line);
  if (!sample->solver().factorize(state)) return;
  dofs_by_position = sample->solver().solveLinear(pulls);
  for (const Line& moved : lines) {
    for (const double sign : {1.0, -1.0}) {
      ClothState near = state;
      system.advance(near, dofs_by_position.col(moved.axis), sign * kProbe_m);
      Positions probe = positions_m;
      probe[moved.axis] += sign * kProbe_m;
      draw(probe);
      for (const Line& felt : lines) {
        moment.stiffness_N_per_m(felt.axis, moved.axis) +=
            sign * tension(near, felt) / (2.0 * kProbe_m);
      }
    }
  }
  draw(positions_m);
}

Result<std::unique_ptr<MountedSpecimen>> MountedSpecimen::hang(const MountOptions& options) {
  const auto fabric = findFabric(options.fabric);
  if (!fabric) return fabric.error();
  const auto protocol = findProtocol(options.protocol);
  if (!protocol) return protocol.error();
  if (options.nodes < 15 || options.nodes > 200) {
    return usageError("the virtual sheet needs 15 to 200 nodes a side");
  }
  if (options.clips != "free" && options.clips != "held" && options.clips != "unhooked") {
    return usageError("clips are free, held or unhooked");
  }
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->line_of.fill(-1);
  if (!(*protocol)->has_cords || options.clips == "unhooked")
    return std::unique_ptr<MountedSpecimen>(new MountedSpecimen(std::move(impl)));
  CaptureOptions capture;
  capture.protocol = options.protocol;
  capture.seed = options.seed;
  capture.nodes = options.nodes;
  const Fabric specimen =
      specimenOf(**fabric, options.specimen != 0 ? options.specimen : options.seed);
  const auto cloth = makeClothSource(specimen, std::nullopt);
  if (!cloth) return cloth.error();
  impl->sample.emplace(capture, specimen, *cloth);
  if (auto built = impl->sample->build(); !built) return built.error();
  impl->assignActuators();
  std::unique_ptr<MountedSpecimen> hung(new MountedSpecimen(std::move(impl)));
  // As an operator hangs it: taut to begin with, then let down to home.
  for (const Impl::Line& line : hung->impl_->lines) {
    hung->impl_->moment.at_m[line.axis] =
        line.home_length_m -
        hung->impl_->sample->rig().clips[line.clip].cords[line.cord].cord.rest_length_m;
  }
  if (hung->impl_->held()) {
    hung->impl_->feelHeld({});
    return hung;
  }
  const bool taut = hung->impl_->step(hung->impl_->moment.at_m);
  if (!taut || !hung->follow({})) {
    return notConverged("the virtual cloth found no stable equilibrium when it was hung");
  }
  hung->impl_->statistics = {};
  return hung;
}

MountedSpecimen::MountedSpecimen(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MountedSpecimen::~MountedSpecimen() = default;

bool MountedSpecimen::follow(const Positions& positions_m) {
  Impl& impl = *impl_;
  if (!impl.sample) {
    impl.moment.at_m = positions_m;
    return true;
  }
  if (impl.held()) {
    impl.feelHeld(positions_m);
    return true;
  }
  for (int halvings = 0;;) {
    const double way_m = longestWay(impl.moment.at_m, positions_m);
    if (way_m <= kSame_m) return true;
    const double share = std::min(1.0, kLongestStep_m / way_m) * std::ldexp(1.0, -halvings);
    const Positions next = between(impl.moment.at_m, positions_m, share);
    if (impl.step(share == 1.0 ? positions_m : next)) continue;
    if (++halvings > kMaxHalvings) {
      ++impl.statistics.failures;
      return false;
    }
  }
}

double MountedSpecimen::Moment::tensionNear_N(int axis, const Positions& positions_m) const {
  double tension = tension_N.at(static_cast<std::size_t>(axis));
  for (int j = 0; j < kAxes; ++j) {
    const auto other = static_cast<std::size_t>(j);
    tension += stiffness_N_per_m(axis, j) * (positions_m[other] - at_m[other]);
  }
  return std::max(0.0, tension);
}

double MountedSpecimen::Statistics::rmsError_N() const {
  return solves > 0 ? std::sqrt(sum_of_squares_N2 / solves) : 0.0;
}

const MountedSpecimen::Moment& MountedSpecimen::moment() const { return impl_->moment; }
const MountedSpecimen::Statistics& MountedSpecimen::statistics() const { return impl_->statistics; }
const MountOptions& MountedSpecimen::options() const { return impl_->options; }

std::optional<SheetShape> MountedSpecimen::shape() const {
  if (!impl_->sample) return std::nullopt;
  const HungSample& sample = *impl_->sample;
  const ClothState& state = sample.state();
  return SheetShape{sample.lines(), sample.stops(0), sample.stops(1),
                    state.positions(sample.system().sheet().nodeCount()), state.clips};
}

bool MountedSpecimen::hasCord(int axis) const {
  return impl_->line_of.at(static_cast<std::size_t>(axis)) >= 0;
}

bool MountedSpecimen::hasCords() const { return !impl_->lines.empty(); }

double MountedSpecimen::hookTension_N(int axis, double position_m) const {
  if (hasCord(axis) || impl_->pushes(axis)) return 0.0;
  return kHook_N_per_m * std::max(0.0, position_m - kHookSlack_m);
}

std::string MountedSpecimen::cordName(int axis) const {
  return hasCord(axis) ? impl_->lines[static_cast<std::size_t>(axis)].name : "";
}

bool MountedSpecimen::hasPulley(int axis) const { return !impl_->pushes(axis); }

double MountedSpecimen::cordLength_m(int axis, double position_m, double tension_N) const {
  if (!hasPulley(axis)) return 0.0;
  if (!hasCord(axis)) return kHookedCord_m - position_m;
  const Impl::Line& line = impl_->lines[static_cast<std::size_t>(axis)];
  return (line.home_length_m - position_m) * (1.0 + tension_N / line.stiffness_N);
}

}  // namespace tenter
