// SPDX-License-Identifier: GPL-3.0-or-later
// Protocols in which cords pull free clips.
#include <algorithm>
#include <cmath>

#include "random_numbers.h"
#include "rig_setup.h"
#include "sheet_sampler.h"
#include "virtual_cloth.h"

namespace tenter {
namespace {

constexpr std::int64_t kFrameInterval_ns = 2'000'000'000;  // [Est12] sec. 3.1
constexpr double kDisturbance_m = 1e-6;  // far below any noise; breaks the symmetry of flat sheets
constexpr double kTensionTolerance =
    0.02;  // of a test's range: actuators stop near their target, not on it
constexpr int kMaxCorrections = 4;
constexpr int kMaxSubdivisions = 6;
constexpr double kSameLine_m = 1e-9;

std::vector<Vec2> outlineOf(const Eigen::AlignedBox2d& area, bool on_bias) {
  return {
      materialPoint(area.min(), on_bias), materialPoint({area.max().x(), area.min().y()}, on_bias),
      materialPoint(area.max(), on_bias), materialPoint({area.min().x(), area.max().y()}, on_bias)};
}

std::vector<int> heldBy(const Eigen::AlignedBox2d& area, const Points3& rest) {
  const Eigen::AlignedBox2d reach(area.min() - Vec2::Constant(kSameLine_m),
                                  area.max() + Vec2::Constant(kSameLine_m));
  std::vector<int> ids;
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    if (reach.contains(Vec2(rest.col(i).head<2>()))) ids.push_back(static_cast<int>(i));
  }
  return ids;
}

/// The sample in its clips, the cords' actuators, and the history of its friction.
class CordRun {
 public:
  CordRun(const CaptureOptions& options, const Fabric& specimen, const ClothSource& cloth)
      : options_(options),
        rig_(makeRig(options.protocol, specimen, options.frames)),
        cloth_(cloth) {
    for (int axis = 0; axis < 2; ++axis) {
      for (const RigClip& clip : rig_.clips) {
        stops_[axis].push_back(clip.area_m.min()[axis]);
        stops_[axis].push_back(clip.area_m.max()[axis]);
      }
    }
    lines_ = {linesThrough(0.0, kSampleSide_m, options.nodes, stops_[0]),
              linesThrough(0.0, kSampleSide_m, options.nodes, stops_[1]), options.diagonals};
    run_.rest = trackedMesh(options.tracked, false);
    sampler_.emplace(lines_, run_.rest.positions.topRows<2>(),
                     cloth.own ? Sampling::kLinear : Sampling::kCubic, stops_[0], stops_[1]);
    if (options.friction && !cloth.own) {
      friction_ = std::make_shared<FrictionalLaw>(cloth.membrane, specimen.friction,
                                                  2 * (options.nodes + 8) * (options.nodes + 8));
    }
    areal_density_ = specimen.areal_density_kg_per_m2;
  }

  Result<CaptureRun> run() {
    if (auto built = build(); !built) return built.error();
    for (std::size_t i = 0; i < rig_.steps.size(); ++i) {
      const bool reached = !cancelled() && reach(rig_.steps[i]);
      if (cancelled()) return notConverged("cancelled");
      if (!reached) {
        return notConverged("the virtual cloth found no stable equilibrium in frame " +
                            std::to_string(i));
      }
      commit();
      record(i);
      if (options_.progress)
        options_.progress(static_cast<int>(i) + 1, static_cast<int>(rig_.steps.size()));
    }
    return std::move(run_);
  }

 private:
  Result<void> build() {
    SystemSetup setup;
    setup.areal_density_kg_per_m2 = areal_density_;
    SheetMesh sheet = sampleSheet(lines_, false);
    for (const RigClip& clip : rig_.clips) {
      ClipSetup held;
      held.id = clip.id;
      held.nodes = heldBy(clip.area_m, sheet.rest.positions);
      held.free = true;
      held.mass_kg = clip.mass_kg;
      const Vec2 centre = clip.area_m.center();
      held.centre_of_mass_m = {centre.x(), centre.y(), 0.0};
      for (const RigCord& cord : clip.cords) held.cords.push_back(cord.cord);
      setup.clips.push_back(held);
      run_.clips.push_back({clip.id, clip.mass_kg, clip.shape});
      clamped_.push_back(heldBy(clip.area_m, run_.rest.positions));
    }
    const ClothLaws laws{friction_ ? friction_ : cloth_.membrane, cloth_.bending};
    auto system = ClothSystem::create(std::move(sheet), *cloth_.model, laws, std::move(setup));
    if (!system) return system.error();
    system_.emplace(std::move(*system));
    solver_.emplace(*system_);
    state_ = system_->restState();
    disturb();
    return {};
  }

  void disturb() {
    RandomNumbers random(options_.seed, "disturbance " + options_.protocol);
    std::vector<bool> held(static_cast<std::size_t>(system_->sheet().nodeCount()), false);
    for (const ClipSetup& clip : system_->setup().clips) {
      for (const int n : clip.nodes) held[n] = true;
    }
    for (int n = 0; n < system_->sheet().nodeCount(); ++n) {
      const double z = kDisturbance_m * random.normal();
      if (!held[n]) state_.q[3 * n + 2] += z;
    }
  }

  void setActuator(int channel, double travel_m) {
    for (std::size_t c = 0; c < rig_.clips.size(); ++c) {
      for (std::size_t k = 0; k < rig_.clips[c].cords.size(); ++k) {
        const RigCord& cord = rig_.clips[c].cords[k];
        if (cord.channel != channel) continue;
        system_->setCordRestLength(static_cast<int>(c), static_cast<int>(k),
                                   std::max(cord.cord.rest_length_m - travel_m, kShortestCord_m));
      }
    }
  }

  double meanTension(int channel) const {
    double sum = 0.0;
    int cords = 0;
    for (std::size_t c = 0; c < rig_.clips.size(); ++c) {
      for (std::size_t k = 0; k < rig_.clips[c].cords.size(); ++k) {
        if (rig_.clips[c].cords[k].channel != channel) continue;
        sum += system_->cordTension_N(state_, static_cast<int>(c), static_cast<int>(k));
        ++cords;
      }
    }
    return sum / cords;
  }

  bool cancelled() const { return options_.cancelled && options_.cancelled(); }

  bool solve() { return findStableShape(*solver_, state_, run_.statistics, options_.cancelled); }

  /// Moves one channel's actuators to `travel_m`, in smaller steps where one step fails.
  bool moveTo(int channel, double travel_m) {
    double at = travel_[channel];
    double step = travel_m - at;
    for (int halvings = 0; halvings <= kMaxSubdivisions;) {
      setActuator(channel, at + step);
      if (!solve()) {
        if (cancelled()) return false;
        step *= 0.5;
        ++halvings;
        ++run_.statistics.subdivisions;
        continue;
      }
      at += step;
      travel_[channel] = at;
      if (std::abs(travel_m - at) <= 1e-12) return true;
      step = travel_m - at;
      if (halvings > 0) step *= 0.5;
    }
    return false;
  }

  /// Secant search for the travel that gives the wanted tension; what it tries is not history for
  /// the friction.
  bool reach(const RigStep& step) {
    const double range = tensionRange();
    if (!started_) {
      started_ = true;
      if (!moveTo(step.channel, 0.0)) return false;
    }
    double& stiffness = stiffness_[step.channel];
    double tension = meanTension(step.channel);
    for (int k = 0;
         k < kMaxCorrections && std::abs(step.tension_N - tension) > kTensionTolerance * range;
         ++k) {
      const double before = travel_[step.channel];
      const double wanted = (step.tension_N - tension) / stiffness;
      const double target = before + std::clamp(wanted, -kLongestStep_m, kLongestStep_m);
      if (!moveTo(step.channel, target)) return false;
      const double now = meanTension(step.channel);
      const double seen = (now - tension) / (target - before);
      if (seen > 0.0 && std::isfinite(seen))
        stiffness = std::clamp(seen, kSoftest_N_per_m, kStiffest_N_per_m);
      tension = now;
    }
    return true;
  }

  double tensionRange() const {
    const auto [low, high] =
        std::minmax_element(rig_.steps.begin(), rig_.steps.end(),
                            [](auto& a, auto& b) { return a.tension_N < b.tension_N; });
    return high->tension_N - low->tension_N;
  }

  void commit() {
    if (!friction_) return;
    const Eigen::Matrix3Xd strains =
        greenStrains(system_->sheet(), state_.positions(system_->sheet().nodeCount()));
    for (Eigen::Index t = 0; t < strains.cols(); ++t)
      friction_->commit(strains.col(t), static_cast<int>(t));
  }

  void record(std::size_t index) {
    ExactFrame frame;
    MeasurementFrame& out = frame.reading;
    out.time_ns = static_cast<std::int64_t>(index) * kFrameInterval_ns;
    out.branch = rig_.steps[index].branch;
    out.positions = sampler_->sample(state_.positions(system_->sheet().nodeCount()));
    std::size_t cord_number = 0;
    for (std::size_t c = 0; c < rig_.clips.size(); ++c) {
      const Eigen::Isometry3d& pose = state_.clips[c];
      out.clips.push_back(
          {rig_.clips[c].id, pose, clamped_[c], outlineOf(rig_.clips[c].area_m, false)});
      for (const int v : clamped_[c])
        out.positions.col(v) = pose * Vec3(run_.rest.positions.col(v));
      for (std::size_t k = 0; k < rig_.clips[c].cords.size(); ++k, ++cord_number) {
        const RigCord& cord = rig_.clips[c].cords[k];
        const int ci = static_cast<int>(c), ki = static_cast<int>(k);
        out.cords.push_back({cord.id, rig_.clips[c].id, cord.cord.attachment_m,
                             system_->cordDirection(state_, ci, ki),
                             system_->cordTension_N(state_, ci, ki), 0.0});
        const double length = (pose * cord.cord.attachment_m - cord.cord.pulley_m).norm();
        if (lengths_.size() <= cord_number)
          lengths_.push_back(length + 1.0);  // drawn taut before the test
        frame.cord_motion.push_back(length < lengths_[cord_number] ? 1.0 : -1.0);
        lengths_[cord_number] = length;
      }
    }
    run_.frames.push_back(std::move(frame));
  }

  static constexpr double kShortestCord_m = 1e-3;
  static constexpr double kLongestStep_m = 0.01;
  static constexpr double kSoftest_N_per_m = 5.0, kStiffest_N_per_m = 500.0;

  const CaptureOptions& options_;
  RigSetup rig_;
  const ClothSource& cloth_;
  double areal_density_ = 0.0;
  std::vector<double> stops_[2];
  GridLines lines_;
  std::optional<SheetSampler> sampler_;
  std::shared_ptr<FrictionalLaw> friction_;
  std::optional<ClothSystem> system_;
  std::optional<EquilibriumSolver> solver_;
  ClothState state_;
  std::vector<std::vector<int>> clamped_;
  std::vector<double> lengths_;
  double travel_[2] = {0.0, 0.0};
  double stiffness_[2] = {250.0, 250.0};
  bool started_ = false;
  CaptureRun run_;
};

}  // namespace

Result<CaptureRun> runCords(const CaptureOptions& options, const Fabric& specimen,
                            const ClothSource& cloth) {
  return CordRun(options, specimen, cloth).run();
}

}  // namespace tenter
