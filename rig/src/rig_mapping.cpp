// SPDX-License-Identifier: GPL-3.0-or-later
// The machine's check of which cell each axis pulls.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "tenter/rig/rig_machine.h"

namespace tenter {

/// Those whose force the protocol goes by, and that were not seen to pull their own cell yet.
std::vector<int> RigMachine::axesToMap(const CaptureProtocol& protocol) const {
  std::vector<int> axes;
  for (std::size_t i = 0; i < config_.axes.size(); ++i) {
    const std::string& name = config_.axes[i].device.name;
    const auto goesByIt = [&](const ProtocolStep& step) {
      return step.end == StepEnd::kForce &&
             std::find(step.axes.begin(), step.axes.end(), name) != step.axes.end();
    };
    const bool wanted = std::any_of(
        protocol.phases.begin(), protocol.phases.end(), [&](const ProtocolPhase& phase) {
          return std::any_of(phase.steps.begin(), phase.steps.end(), goesByIt);
        });
    if (wanted && !mapped_[i]) axes.push_back(static_cast<int>(i));
  }
  return axes;
}

void RigMachine::startMapping(const std::vector<int>& axes) {
  std::vector<int> tried = axes;
  for (std::size_t i = 0; i < config_.axes.size() && axes.empty(); ++i) {
    if (config_.axes[i].cell) tried.push_back(static_cast<int>(i));
  }
  mapping_.emplace(config_, tried);
  findings_.clear();
  changeState(RigState::kRunning, "checking which cell each axis pulls");
  begin(Activity::kMap);
  if (protocol_) keepOrigins();
  loading_ = true;
}

void RigMachine::actMap() {
  std::vector<std::optional<double>> tensions_N;
  for (const CellInput& cell : tick_->cells) tensions_N.push_back(cell.gross_N);
  const MappingCheck::Move wanted = mapping_->step(dt_s_, setpoints_m_, tensions_N);
  for (std::size_t i = findings_.size(); i < mapping_->findings().size(); ++i) {
    const MappingFinding& finding = mapping_->findings()[i];
    nlohmann::json answered;
    if (finding.answered) answered = config_.cells[static_cast<std::size_t>(*finding.answered)].id;
    const RigAxis& axis = config_.axes[static_cast<std::size_t>(finding.axis)];
    decide("mapping",
           nlohmann::json{{"axis", axis.device.name},
                          {"cell", config_.cells[static_cast<std::size_t>(*axis.cell)].id},
                          {"answered", answered},
                          {"confirmed", finding.confirmed()},
                          {"rise_N", finding.rise_N},
                          {"way_m", finding.way_m}}
               .dump());
    mapped_[static_cast<std::size_t>(finding.axis)] = finding.confirmed();
    findings_.push_back(finding);
  }
  if (mapping_->done()) return mappingDone();
  std::vector<double> velocities(config_.axes.size(), 0.0);
  velocities[static_cast<std::size_t>(wanted.axis)] = wanted.velocity_m_per_s;
  goals_m_[static_cast<std::size_t>(wanted.axis)] = wanted.goal_m;
  move(velocities);
}

void RigMachine::mappingDone() {
  mapping_.reset();
  std::string wrong;
  for (const MappingFinding& finding : findings_) {
    if (!finding.confirmed()) wrong += (wrong.empty() ? "" : "; ") + mappingText(finding, config_);
  }
  if (!wrong.empty()) return trip("rig", "mapping", wrong);
  if (protocol_) return startProtocol();
  loading_ = false;
  activity_ = Activity::kNone;
  conclude("done", "");
}

}  // namespace tenter
