// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/mapping_check.h"

#include <algorithm>

namespace tenter {
namespace {

constexpr double kAnswerShare = 0.5;  // of slack_N: less may be a cord that rubs, or noise
constexpr double kRivalShare = 0.8;   // of the highest rise; above it two cells answer alike
constexpr double kReach_m = 0.015;    // a cord that is slacker than that is not hung ready
constexpr double kSpeedShare = 0.25;  // of the cap
constexpr double kSettle_s = 0.2;     // a slow bus has read every cell since the axis stood
constexpr int kRestTicks = 10;
constexpr double kArrived_m = 1e-9;

}  // namespace

std::string mappingText(const MappingFinding& finding, const RigConfig& config) {
  const auto cellName = [&](int cell) { return config.cells[static_cast<std::size_t>(cell)].id; };
  const std::string axis = config.axes[static_cast<std::size_t>(finding.axis)].device.name + ": ";
  if (!finding.answered) return axis + "no cell answers";
  if (*finding.answered != finding.cell) {
    return axis + cellName(*finding.answered) + " answers instead of " + cellName(finding.cell);
  }
  return axis + cellName(finding.cell) + (finding.alone ? " answers" : " answers with another one");
}

MappingCheck::MappingCheck(const RigConfig& config, const std::vector<int>& axes)
    : answer_N_(kAnswerShare * config.limits.slack_N),
      draw_m_per_s_(kSpeedShare * speedCap_m_per_s(config.limits)),
      rest_N_(config.cells.size()) {
  require(!axes.empty(), "MappingCheck: axes to try");
  for (const int index : axes) {
    const RigAxis& axis = config.axes.at(static_cast<std::size_t>(index));
    require(axis.cell.has_value(), "MappingCheck: axes with cells");
    trials_.push_back({index, *axis.cell, axis.device.travel_max_m, axis.device.max_speed_m_per_s});
  }
}

void MappingCheck::begin(Stage stage) {
  stage_ = stage;
  elapsed_s_ = 0.0;
  rest_ticks_ = 0;
}

bool MappingCheck::rest(const std::vector<double>& tensions_N, double setpoint_m) {
  if (elapsed_s_ < kSettle_s) return false;
  if (rest_ticks_ == 0) std::fill(rest_N_.begin(), rest_N_.end(), 0.0);
  for (std::size_t i = 0; i < rest_N_.size(); ++i) rest_N_[i] += tensions_N[i] / kRestTicks;
  rest_m_ = setpoint_m;
  return ++rest_ticks_ == kRestTicks;
}

void MappingCheck::judge(const std::vector<double>& rises_N, double way_m) {
  const Trial& trial = trials_[next_];
  MappingFinding finding{trial.axis, trial.cell, std::nullopt, false, 0.0, way_m};
  const auto highest = std::max_element(rises_N.begin(), rises_N.end());
  if (*highest >= answer_N_) {
    finding.answered = static_cast<int>(highest - rises_N.begin());
    finding.rise_N = *highest;
    finding.alone = std::none_of(rises_N.begin(), rises_N.end(), [&](const double& rise_N) {
      return &rise_N != &*highest && rise_N > kRivalShare * *highest;
    });
  }
  findings_.push_back(finding);
}

std::optional<double> MappingCheck::draw(double dt_s, const std::vector<double>& tensions_N,
                                         double setpoint_m) {
  const Trial& trial = trials_[next_];
  std::vector<double> rises_N = tensions_N;
  for (std::size_t i = 0; i < rises_N.size(); ++i) rises_N[i] -= rest_N_[i];
  const double way_m = setpoint_m - rest_m_;
  const double most_m = std::min(kReach_m, trial.travel_max_m - rest_m_);
  const bool answered = *std::max_element(rises_N.begin(), rises_N.end()) >= answer_N_;
  if (!answered && way_m < most_m - kArrived_m) {
    elapsed_s_ = 0.0;
    const double speed_m_per_s = std::min(draw_m_per_s_, trial.max_speed_m_per_s);
    return dt_s > 0.0 ? std::min(speed_m_per_s, (most_m - way_m) / dt_s) : 0.0;
  }
  // At the end of its way a slow bus may still have something to say.
  if (!answered && elapsed_s_ < kSettle_s) return 0.0;
  judge(rises_N, way_m);
  return std::nullopt;
}

MappingCheck::Move MappingCheck::step(double dt_s, const std::vector<double>& setpoints_m,
                                      const std::vector<std::optional<double>>& tensions_N) {
  require(!done(), "MappingCheck: there is an axis left");
  const int axis = trials_[next_].axis;
  const double setpoint_m = setpoints_m.at(static_cast<std::size_t>(axis));
  std::vector<double> known_N;
  for (const auto& tension_N : tensions_N) {
    if (tension_N) known_N.push_back(*tension_N);
  }
  if (known_N.size() != rest_N_.size()) return {axis, 0.0, std::nullopt};
  elapsed_s_ += dt_s;
  switch (stage_) {
    case Stage::kRest:
      if (rest(known_N, setpoint_m)) begin(Stage::kDraw);
      return {axis, 0.0, std::nullopt};
    case Stage::kDraw:
      if (const auto speed = draw(dt_s, known_N, setpoint_m)) return {axis, *speed, std::nullopt};
      begin(Stage::kReturn);
      return {axis, 0.0, std::nullopt};
    case Stage::kReturn:
      break;
  }
  const double left_m = setpoint_m - rest_m_;
  if (left_m <= kArrived_m) {
    ++next_;
    begin(Stage::kRest);
    return {axis, 0.0, std::nullopt};
  }
  const double most_m_per_s = trials_[next_].max_speed_m_per_s;
  return {axis, dt_s > 0.0 ? -std::min(most_m_per_s, left_m / dt_s) : 0.0, rest_m_};
}

}  // namespace tenter
