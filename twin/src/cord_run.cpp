// SPDX-License-Identifier: GPL-3.0-or-later
// Protocols in which cords pull free clips.
#include <algorithm>
#include <cmath>

#include "hung_sample.h"
#include "sheet_sampler.h"
#include "tenter/twin/mounted_specimen.h"

namespace tenter {
namespace {

constexpr std::int64_t kFrameInterval_ns = 2'000'000'000;  // [Est12] sec. 3.1
constexpr double kTensionTolerance =
    0.02;  // of a test's range: actuators stop near their target, not on it
constexpr int kMaxCorrections = 4;
constexpr int kMaxSubdivisions = 6;

std::vector<Vec2> outlineOf(const Eigen::AlignedBox2d& area, bool on_bias) {
  return {
      materialPoint(area.min(), on_bias), materialPoint({area.max().x(), area.min().y()}, on_bias),
      materialPoint(area.max(), on_bias), materialPoint({area.min().x(), area.max().y()}, on_bias)};
}

/// The sample in its clips, the cords' actuators, and the history of its friction.
class CordRun {
 public:
  CordRun(const CaptureOptions& options, const Fabric& specimen, const ClothSource& cloth)
      : options_(options), sample_(options, specimen, cloth), rig_(sample_.rig()) {
    run_.rest = trackedMesh(options.tracked, false);
    sampler_.emplace(sample_.lines(), run_.rest.positions.topRows<2>(),
                     cloth.own ? Sampling::kLinear : Sampling::kCubic, sample_.stops(0),
                     sample_.stops(1));
    for (const RigClip& clip : rig_.clips) {
      run_.clips.push_back({clip.id, clip.mass_kg, clip.shape});
      clamped_.push_back(heldBy(clip.area_m, run_.rest.positions));
    }
  }

  Result<CaptureRun> run() {
    if (auto built = sample_.build(); !built) return built.error();
    for (std::size_t i = 0; i < rig_.steps.size(); ++i) {
      const bool reached = !cancelled() && reach(rig_.steps[i]);
      if (cancelled()) return notConverged("cancelled");
      if (!reached) {
        return notConverged("the virtual cloth found no stable equilibrium in frame " +
                            std::to_string(i));
      }
      sample_.commit();
      record(i);
      if (options_.progress)
        options_.progress(static_cast<int>(i) + 1, static_cast<int>(rig_.steps.size()));
    }
    return std::move(run_);
  }

 private:
  void setActuator(int channel, double travel_m) {
    for (std::size_t c = 0; c < rig_.clips.size(); ++c) {
      for (std::size_t k = 0; k < rig_.clips[c].cords.size(); ++k) {
        if (rig_.clips[c].cords[k].channel != channel) continue;
        sample_.draw(static_cast<int>(c), static_cast<int>(k), travel_m);
      }
    }
  }

  double meanTension(int channel) const {
    double sum = 0.0;
    int cords = 0;
    for (std::size_t c = 0; c < rig_.clips.size(); ++c) {
      for (std::size_t k = 0; k < rig_.clips[c].cords.size(); ++k) {
        if (rig_.clips[c].cords[k].channel != channel) continue;
        sum += sample_.tension_N(static_cast<int>(c), static_cast<int>(k));
        ++cords;
      }
    }
    return sum / cords;
  }

  bool cancelled() const { return options_.cancelled && options_.cancelled(); }

  bool solve() { return sample_.solve(run_.statistics, options_.cancelled); }

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

  void record(std::size_t index) {
    ExactFrame frame;
    MeasurementFrame& out = frame.reading;
    out.time_ns = static_cast<std::int64_t>(index) * kFrameInterval_ns;
    out.branch = rig_.steps[index].branch;
    const ClothState& state = sample_.state();
    const ClothSystem& system = sample_.system();
    out.positions = sampler_->sample(state.positions(system.sheet().nodeCount()));
    std::size_t cord_number = 0;
    for (std::size_t c = 0; c < rig_.clips.size(); ++c) {
      const Eigen::Isometry3d& pose = state.clips[c];
      out.clips.push_back(
          {rig_.clips[c].id, pose, clamped_[c], outlineOf(rig_.clips[c].area_m, false)});
      for (const int v : clamped_[c])
        out.positions.col(v) = pose * Vec3(run_.rest.positions.col(v));
      for (std::size_t k = 0; k < rig_.clips[c].cords.size(); ++k, ++cord_number) {
        const RigCord& cord = rig_.clips[c].cords[k];
        const int ci = static_cast<int>(c), ki = static_cast<int>(k);
        out.cords.push_back({cord.id, rig_.clips[c].id, cord.cord.attachment_m,
                             system.cordDirection(state, ci, ki),
                             system.cordTension_N(state, ci, ki), 0.0});
        const double length = (pose * cord.cord.attachment_m - cord.cord.pulley_m).norm();
        if (lengths_.size() <= cord_number)
          lengths_.push_back(length + 1.0);  // drawn taut before the test
        frame.cord_motion.push_back(length < lengths_[cord_number] ? 1.0 : -1.0);
        lengths_[cord_number] = length;
      }
    }
    if (options_.keep_moments) frame.moment = moment();
    run_.frames.push_back(std::move(frame));
  }

  RigMoment moment() const {
    const ClothState& state = sample_.state();
    RigMoment out{{sample_.lines(), sample_.stops(0), sample_.stops(1),
                   state.positions(sample_.system().sheet().nodeCount()), state.clips},
                  std::vector<double>(MountedSpecimen::kAxes, 0.0)};
    std::size_t axis = 0;
    for (const CordPlace& place : actuatorOrder(rig_)) {
      const RigCord& cord = rig_.clips[place.clip].cords[place.cord];
      out.positions_m.at(axis++) = cord.slack_m + (cord.channel < 0 ? 0.0 : travel_[cord.channel]);
    }
    return out;
  }

  static constexpr double kLongestStep_m = 0.01;
  static constexpr double kSoftest_N_per_m = 5.0, kStiffest_N_per_m = 500.0;

  const CaptureOptions& options_;
  HungSample sample_;
  const RigSetup& rig_;
  std::optional<SheetSampler> sampler_;
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
