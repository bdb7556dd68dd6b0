// SPDX-License-Identifier: GPL-3.0-or-later
#include "trial_rig.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace tenter::campaign {
namespace {

using rig_system_test::waitFor;

constexpr double kRecovery_s = 60.0;
constexpr double kPullSpeed_m_per_s = 0.002;
constexpr double kJog_m = 0.006, kJogSpeed_m_per_s = 0.002;
constexpr double kHomingWay_m = 0.0015, kFast_m_per_s = 0.004;
constexpr double kUnloadingBegins_s = 0.13;

/// So far that letting out takes longer than naming a fault. The second four are hooked to the
/// frame, soft and after 4 mm of slack.
double pull_m(int device) { return device < 4 ? 0.009 : 0.014; }

/// All four axes of the device's direction draw in, and perhaps hold.
std::string protocolOf(int device, bool hold) {
  std::ostringstream toml;
  const int first = device < 4 ? 1 : 5;
  toml << "schema_version = 1\nname = \"trial\"\ndescription = \"a pull\"\naxes = [\"axis-" << first
       << "\"]\nspeed_m_per_s = " << kPullSpeed_m_per_s << "\ncapture_interval_s = 0.5\n"
       << "[[phase]]\nname = \"pull\"\n[[phase.step]]\nend = \"travel\"\ntargets_m = {";
  for (int i = first; i < first + 4; ++i) {
    toml << (i > first ? ", " : "") << "axis-" << i << " = " << pull_m(device);
  }
  toml << "}\n";
  if (hold) toml << "[[phase.step]]\nend = \"hold\"\nhold_s = 20.0\n";
  return toml.str();
}

bool anyNotHomed(const nlohmann::json& status) {
  const auto& axes = status.at("axes");
  return std::any_of(axes.begin(), axes.end(),
                     [](const auto& axis) { return !axis.at("homed").template get<bool>(); });
}

bool anyCellFails(const nlohmann::json& status) {
  const auto& cells = status.at("cells");
  return std::any_of(cells.begin(), cells.end(),
                     [](const auto& cell) { return cell.at("fault") != ""; });
}

}  // namespace

TrialRig::TrialRig(bool tcp) : running_(tcp), truth_(running_.rig()) { connect(); }

void TrialRig::sleep(double span_s) {
  std::this_thread::sleep_for(std::chrono::duration<double>(span_s));
}

/// The socket is there a moment before somebody listens on it.
void TrialRig::connect() {
  constexpr double kPatience_s = 5.0;
  std::string problem;
  const bool connected = waitFor(kPatience_s, [&] {
    try {
      peer_ = std::make_unique<RpcPeer>(running_.socket());
      return true;
    } catch (const std::runtime_error& error) {
      problem = error.what();
      return false;
    }
  });
  if (!connected) throw std::runtime_error(problem);
}

void TrialRig::order(const std::string& method, const nlohmann::json& params) {
  // On a busy machine a cell is stale now and then, and the rig wants all of them for a beginning.
  constexpr double kPatience_s = 3.0;
  const bool taken = waitFor(kPatience_s, [&] {
    peer_->order("heartbeat");
    if (peer_->order(method, params)) return true;
    sleep(0.05);
    return false;
  });
  if (taken) return;
  throw std::runtime_error(method + " was refused: " + peer_->lastError());
}

void TrialRig::restart() {
  disconnect();
  running_.restartDaemon();
  connect();
}

void TrialRig::recover() {
  nlohmann::json status;
  const bool ready = waitFor(kRecovery_s, [&] {
    if (!peer_) connect();
    peer_->order("lease");
    status = peer_->status();
    const std::string state = status.value("state", "");
    const bool moving = status.value("moving", false);
    if (state == "ready" && !moving && !anyCellFails(status) && !status.value("recording", false)) {
      return true;
    }
    if (state == "off" && status.contains("axes")) peer_->order("enable");
    if (state == "paused") peer_->order("abort");
    if ((state == "fault" || state == "stopped") && !moving) peer_->order("reset");
    if (state == "caution" && !moving && anyNotHomed(status) && !peer_->order("home")) {
      peer_->order("unload");
    }
    sleep(0.02);
    return false;
  });
  if (!ready)
    throw std::runtime_error("the rig does not recover: " + status.value("state", "") + ", " +
                             status.value("reason", "") + ": " + status.dump());
}

void TrialRig::jog(int axis, double distance_m, double speed_m_per_s) {
  order("jog", {{"axis", "axis-" + std::to_string(axis + 1)},
                {"distance_m", distance_m},
                {"speed_m_per_s", speed_m_per_s}});
}

void TrialRig::rest() {
  waitFor(10.0, [&] {
    peer_->order("heartbeat");
    sleep(0.02);
    return !peer_->status().value("moving", true);
  });
}

void TrialRig::run(int device, bool hold) {
  session_ = running_.path("session-" + std::to_string(++sessions_));
  order("run", {{"protocol", protocolOf(device, hold)},
                {"session", session_},
                {"fabric", "knit-12"},
                {"specimen", "1"},
                {"who", "trial"},
                {"operator", "trial"},
                {"areal_density_kg_per_m2", 0.2},
                {"skip_mapping_check", true}});
}

void TrialRig::enter(RigPhase phase, int device) {
  session_.clear();
  switch (phase) {
    case RigPhase::kIdle:
      return;
    case RigPhase::kHoming:
      if (peer_->status().at("axes").at(static_cast<std::size_t>(device)).at("position_m") <
          kHomingWay_m) {
        jog(device, kHomingWay_m, kFast_m_per_s);
        rest();
      }
      order("unload");
      rest();
      return order("home");
    case RigPhase::kJog:
      return jog(device, kJog_m, kJogSpeed_m_per_s);
    case RigPhase::kLoading:
      return run(device, true);
    case RigPhase::kHolding:
    case RigPhase::kUnloading:
      run(device, true);
      stay(pull_m(device) / kPullSpeed_m_per_s + 0.3, true, [](const auto& /*status*/) {});
      if (phase == RigPhase::kHolding) return;
      order("abort");
      return sleep(kUnloadingBegins_s);
  }
}

bool TrialRig::waitForSession(double limit_s) {
  return waitFor(limit_s, [&] {
    peer_->order("heartbeat");
    const nlohmann::json status = peer_->status();
    if (status.contains("session") && status["session"].value("closed", false)) return true;
    sleep(0.02);
    return false;
  });
}

}  // namespace tenter::campaign
