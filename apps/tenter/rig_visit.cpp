// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_visit.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "interrupt.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;

constexpr auto kPoll = std::chrono::milliseconds(200);
constexpr int kInterlock = static_cast<int>(ErrorKind::kInterlock);

bool allRead(const Json& now) {
  const Json cells = now.value("cells", Json::array());
  return std::all_of(cells.begin(), cells.end(),
                     [](const Json& cell) { return cell.value("fault", "") == ""; });
}

std::string forces(const Json& now) {
  std::string text;
  for (const Json& cell : now.value("cells", Json::array())) {
    const Json force = cell.value("net_N", Json());
    char number[16] = "     -";
    if (force.is_number()) std::snprintf(number, sizeof number, " %5.2f", force.get<double>());
    text += number;
  }
  return text + " N";
}

/// Reason and faults of a status, for an error.
std::string amiss(const Json& status) {
  std::string text = status.value("reason", "");
  for (const char* kind : {"axes", "cells", "cameras"}) {
    for (const Json& device : status.value(kind, Json::array())) {
      const std::string fault = device.value("fault", "");
      if (!fault.empty()) text += "; " + device.value("name", "") + ": " + fault;
    }
  }
  return text.empty() ? text : ": " + text;
}

std::uint64_t numberOf(const Json& last) { return last.value("number", std::uint64_t{0}); }

bool sessionClosed(const Json& status) {
  return status.value("session", Json::object()).value("closed", false);
}

}  // namespace

RigVisit::RigVisit(std::unique_ptr<RigClient> client, Console& console)
    : client_(std::move(client)), console_(console), progress_(console) {}

Result<std::unique_ptr<RigVisit>> RigVisit::begin(const std::string& socket, Console& console) {
  auto client = RigClient::connect(socket);
  if (!client) return client.error();
  if (auto lease = (*client)->call("lease"); !lease) return lease.error();
  return std::unique_ptr<RigVisit>(new RigVisit(*std::move(client), console));
}

Result<Json> RigVisit::call(const std::string& method, const Json& params) {
  return client_->call(method, params);
}

Result<Json> RigVisit::wait(const std::string& what) {
  for (bool aborted = false;;) {
    std::this_thread::sleep_for(kPoll);
    if (auto alive = call("heartbeat"); !alive) return alive.error();
    auto now = call("status");
    if (!now) return now.error();
    if (interrupted() && !aborted) {
      aborted = true;
      (void)call("abort");  // refused where there is nothing to abort
    }
    progress_.show(-1.0, what + ", " + now->value("state", "") + forces(*now));
    if (!now->value("moving", false) && now->value("state", "") != "paused") return now;
  }
}

Result<void> RigVisit::enable() {
  auto now = call("status");
  if (!now) return now.error();
  const bool was_off = now->value("state", "") == "off";
  if (was_off) {
    if (auto done = call("enable"); !done) return done.error();
  }
  constexpr int kPatience = 20;
  for (int i = 0; i < kPatience; ++i) {
    if (now->value("state", "") != "off" && allRead(*now)) return {};
    std::this_thread::sleep_for(kPoll);
    if (auto alive = call("heartbeat"); !alive) return alive.error();
    now = call("status");
    if (!now) return now.error();
  }
  if (now->value("state", "") != "off") return {};
  return Error{ErrorKind::kHardware, "", "", "the rig does not come up" + amiss(*now),
               "see `tenter rig status`"};
}

Result<void> RigVisit::homeIfLost() {
  const auto now = call("status");
  if (!now) return now.error();
  bool lost = false;
  for (const Json& axis : now->value("axes", Json::array())) {
    lost = lost || !axis.value("homed", false);
  }
  if (!lost) return {};
  if (auto done = call("home"); !done) return done.error();
  const auto after = wait("homing");
  if (!after) return after.error();
  return {};
}

Result<int> RigVisit::run(const RigRun& run) {
  if (auto up = enable(); !up) return up.error();
  if (auto homed = homeIfLost(); !homed) return homed.error();
  if (interrupted()) {
    return Error{ErrorKind::kInterlock, "", "", "stopped before the protocol began", ""};
  }
  Json asked{{"protocol", run.protocol_text},
             {"session", std::filesystem::absolute(run.session).lexically_normal().string()},
             {"fabric", run.fabric},
             {"specimen", run.specimen},
             {"who", run.who},
             {"operator", run.operator_name},
             {"areal_density_kg_per_m2", run.areal_density_kg_per_m2},
             {"skip_mapping_check", run.skip_mapping_check}};
  if (run.temperature_degC) asked["temperature_degC"] = *run.temperature_degC;
  if (run.relative_humidity) asked["relative_humidity"] = *run.relative_humidity;
  const auto before = call("status");
  if (!before) return before.error();
  if (const auto started = call("run", asked); !started) return started.error();
  auto status = wait(run.protocol_name);
  if (!status) return status.error();
  constexpr int kPatience = 150;
  for (int i = 0; i < kPatience && !sessionClosed(*status); ++i) {
    std::this_thread::sleep_for(kPoll);
    status = call("status");
    if (!status) return status.error();
  }
  console_.answer["session"] = run.session;
  const std::string fault = status->value("session", Json::object()).value("fault", "");
  if (!fault.empty()) return Error{ErrorKind::kHardware, run.session, "", fault, ""};
  if (!sessionClosed(*status)) {
    return Error{ErrorKind::kHardware, run.session, "", "is still open: the disk does not keep up",
                 "see `tenter rig status`; `tenter session verify` tells what is in it"};
  }
  if (status->value("reason", "") == "rig: mapping") tellMapping(*status, false);
  return ended(*before, *status);
}

void RigVisit::tellMapping(const Json& status, bool all) {
  const Json findings = status.value("mapping", Json::array());
  console_.answer["mapping"] = findings;
  for (const Json& finding : findings) {
    const bool confirmed = finding.value("confirmed", false);
    if (confirmed && all) console_.say("  " + finding.value("text", ""));
    if (!confirmed) console_.warn("  " + finding.value("text", ""));
  }
}

Result<int> RigVisit::ended(const Json& before, const Json& status) {
  const std::string state = status.value("state", "");
  const std::string reason = status.value("reason", "");
  console_.answer["state"] = state;
  console_.answer["reason"] = reason;
  const Json last = status.value("last", Json::object());
  const bool took_time = numberOf(last) != numberOf(before.value("last", Json::object()));
  if (took_time) {
    const std::string how = last.value("how", "");
    console_.answer["how"] = how;
    if (how != "done") {
      const std::string why = last.value("why", "");
      console_.warn(last.value("what", "") + ": " + how +
                    (why.empty() || why == how ? "" : ": " + why));
    }
    console_.say("the rig is " + state + (reason.empty() ? "" : " (" + reason + ")"));
    return how == "done" && !interrupted() ? kDone : kInterlock;
  }
  console_.say("the rig is " + state + (reason.empty() ? "" : " (" + reason + ")"));
  const bool as_before = before.value("state", "") == state && before.value("reason", "") == reason;
  const bool halted = (state == "fault" || state == "stopped") && !as_before;
  return halted || interrupted() ? kInterlock : kDone;
}

}  // namespace tenter::app
