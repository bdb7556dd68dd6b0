// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/session_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cord_friction.h"
#include "rig_noise.h"
#include "tenter/calib/cord_friction.h"
#include "tenter/session/session_reader.h"

namespace tenter {
namespace {

constexpr int kAxes = MountedSpecimen::kAxes;
/// Way after which a new equilibrium is due; to first order tensions err by 0.01 mN over it, by
/// some tenths where the friction turns round.
constexpr double kDue_m = 5e-5;
constexpr CordFriction kHomed{RigErrors::kCordFriction_N, -RigErrors::kCordFriction_N};

/// Sums over the samples of one cord.
struct Sums {
  std::uint64_t samples = 0;
  double squares = 0.0, by_travel = 0.0, sum = 0.0, largest = 0.0, highest = 0.0;
  double least_m = std::numeric_limits<double>::infinity();
  double most_m = -std::numeric_limits<double>::infinity();
};

class TruthRun {
 public:
  TruthRun(const SessionTruthOptions& options, MountedSpecimen& specimen)
      : options_(options),
        specimen_(specimen),
        by_length_(kAxes, kHomed),
        by_travel_(kAxes, kHomed) {}

  Result<SessionTruth> run() {
    auto reader = SessionReader::open(options_.session);
    if (!reader) return reader.error();
    header_ = (*reader)->header();
    if (header_.actuators.size() != kAxes || header_.cells.size() != kAxes) {
      return badInput(options_.session.string(), "actuators", "are not those of a served rig");
    }
    for (;;) {
      if (options_.cancelled && options_.cancelled()) return notConverged("cancelled");
      auto record = (*reader)->next();
      if (!record) return record.error();
      if (!*record) break;
      const auto* sample = std::get_if<SampleRecord>(&(*record)->body);
      if (sample == nullptr) continue;
      const double time_s = 1e-9 * static_cast<double>((*record)->time_ns);
      if (!take(*sample, time_s)) {
        return notConverged("the specimen found no equilibrium at " + std::to_string(time_s) +
                            " s of the session");
      }
      if (options_.progress) options_.progress(time_s);
    }
    return finished();
  }

 private:
  bool compares(int axis) const { return specimen_.hasCord(axis) || !specimen_.hasCords(); }

  bool take(const SampleRecord& sample, double time_s) {
    MountedSpecimen::Positions at{};
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (i >= sample.positions_m.size() || !sample.positions_m[i]) return true;
      at[i] = *sample.positions_m[i];
    }
    const auto& solved = specimen_.moment().at_m;
    const bool due = !std::equal(at.begin(), at.end(), solved.begin(),
                                 [](double a, double b) { return std::abs(a - b) <= kDue_m; });
    if (due && !specimen_.follow(at)) return false;
    for (int i = 0; i < kAxes; ++i) {
      if (compares(i)) compare(i, at, sample.tensions, time_s);
    }
    return true;
  }

  void compare(int axis, const MountedSpecimen::Positions& at,
               const std::vector<TensionReading>& tensions, double time_s) {
    const auto i = static_cast<std::size_t>(axis);
    const double truth_N =
        specimen_.moment().tensionNear_N(axis, at) + specimen_.hookTension_N(axis, at[i]);
    double friction_N = 0.0, travel_N = 0.0;
    if (specimen_.hasPulley(axis)) {
      by_length_[i].follow(specimen_.cordLength_m(axis, at[i], truth_N));
      by_travel_[i].follow(kFarPulley_m - at[i]);
      // A cell does not feel less than nothing.
      friction_N = std::max(by_length_[i].force_N(), -truth_N);
      travel_N = std::max(by_travel_[i].force_N(), -truth_N);
    }
    if (i >= tensions.size() || tensions[i].status != TensionStatus::kOk || !tensions[i].tension_N)
      return;
    const double measured_N = *tensions[i].tension_N;
    const double error_N = measured_N - friction_N - truth_N;
    const double by_travel_N = measured_N - travel_N - truth_N;
    Sums& sums = sums_[i];
    ++sums.samples;
    sums.sum += error_N;
    sums.squares += error_N * error_N;
    sums.by_travel += by_travel_N * by_travel_N;
    sums.largest = std::max(sums.largest, std::abs(error_N));
    sums.highest = std::max(sums.highest, truth_N);
    sums.least_m = std::min(sums.least_m, at[i]);
    sums.most_m = std::max(sums.most_m, at[i]);
    out_.rows.push_back({time_s, axis, at[i], measured_N, friction_N, truth_N});
    Kept& kept = kept_[i];
    kept.positions_m.push_back(at[i]);
    kept.measured_N.push_back(measured_N);
    kept.truth_N.push_back(truth_N);
  }

  /// Sum of squares with friction as the calibration has it; nothing without one.
  std::optional<double> squaresByCords(std::size_t i) const {
    const CordEntry* cord = options_.cords ? options_.cords->find(header_.actuators[i]) : nullptr;
    if (cord == nullptr || !cord->friction) return std::nullopt;
    const Kept& kept = kept_[i];
    const auto friction_N = frictionAlong(*cord, kept.positions_m, kept.measured_N);
    double squares = 0.0;
    for (std::size_t k = 0; k < friction_N.size(); ++k) {
      const double error_N = kept.measured_N[k] - friction_N[k] - kept.truth_N[k];
      squares += error_N * error_N;
    }
    return squares;
  }

  Result<SessionTruth> finished() {
    double squares = 0.0, by_travel = 0.0, samples = 0.0;
    double by_cords = 0.0, samples_by_cords = 0.0;
    for (int i = 0; i < kAxes; ++i) {
      const Sums& sums = sums_[static_cast<std::size_t>(i)];
      if (sums.samples == 0) continue;
      const auto n = static_cast<double>(sums.samples);
      out_.cords.push_back({header_.actuators[static_cast<std::size_t>(i)], specimen_.cordName(i),
                            sums.samples, std::sqrt(sums.squares / n),
                            std::sqrt(sums.by_travel / n), std::nullopt, sums.sum / n, sums.largest,
                            sums.highest, sums.most_m - sums.least_m});
      if (const auto cord = squaresByCords(static_cast<std::size_t>(i))) {
        out_.cords.back().rms_by_cords_N = std::sqrt(*cord / n);
        by_cords += *cord;
        samples_by_cords += n;
      }
      squares += sums.squares;
      by_travel += sums.by_travel;
      samples += n;
    }
    if (samples == 0.0) return badInput(options_.session.string(), "", "has no samples of cords");
    out_.rms_N = std::sqrt(squares / samples);
    out_.rms_by_travel_N = std::sqrt(by_travel / samples);
    if (samples_by_cords > 0.0) out_.rms_by_cords_N = std::sqrt(by_cords / samples_by_cords);
    out_.solves = specimen_.statistics().solves;
    return std::move(out_);
  }

  /// What a calibration goes by: one entry a sample.
  struct Kept {
    std::vector<double> positions_m, measured_N, truth_N;
  };

  static constexpr double kFarPulley_m = 1.0;  ///< Only changes of a length matter.

  const SessionTruthOptions& options_;
  MountedSpecimen& specimen_;
  SessionHeader header_;
  std::vector<CordFriction> by_length_, by_travel_;
  std::array<Sums, kAxes> sums_{};
  std::array<Kept, kAxes> kept_;
  SessionTruth out_;
};

}  // namespace

Result<SessionTruth> truthOfSession(const SessionTruthOptions& options) {
  auto specimen = MountedSpecimen::hang(options.mount);
  if (!specimen) return specimen.error();
  return TruthRun(options, **specimen).run();
}

}  // namespace tenter
