// SPDX-License-Identifier: GPL-3.0-or-later
#include "trial.h"

#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "tenter/rig/load_cell.h"
#include "tenter/rig/redecide.h"
#include "tenter/session/session_reader.h"
#include "tenter/test_support/temporary_folder.h"
#include "tenter/twin/fault_player.h"

namespace tenter::campaign {
namespace {

namespace fs = std::filesystem;

/// Six sigma of the amplifier's noise, and a count.
constexpr double kTolerance_N = 6.0 * 0.003 + 0.002;
/// An amplifier holds a conversion for so long before it is read.
constexpr std::int64_t kHold_ns = 4'000'000;
/// A value that does not move is known to be stuck after so long.
constexpr std::int64_t kStuckAfter_ns = 600'000'000;
constexpr double kAddedForce_N = 15.0;
constexpr double kLongestCall_s = 4.0;  // twice what the daemon waits for its loop
constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr const char* kHold = R"(schema_version = 1
name = "hold"
description = "nothing moves"
axes = ["axis-1"]
speed_m_per_s = 0.001
capture_interval_s = 1.0
[[phase]]
name = "hold"
[[phase.step]]
end = "hold"
hold_s = 1.0
)";

ScriptedFault faultOf(const Injection& injection) {
  const FaultKindRow& row = *injection.kind;
  ScriptedFault fault;
  fault.kind_name = row.name;
  fault.device = injection.device;
  fault.on_axis = row.part == Part::kAxis;
  if (row.name == "added-force") {
    fault.kind = AddedForceFault{kAddedForce_N};
  } else if (row.part == Part::kCell) {
    VirtualCellFault kind = *parseVirtualCellFault(row.name);
    kind.requests = row.once ? 1 : 0;
    fault.kind = kind;
  } else if (row.name == "unplug") {
    fault.kind = UnplugFault{};
  } else if (row.name == "slow") {
    fault.kind = SlowFault{std::chrono::milliseconds(60)};
  } else {
    for (const VirtualFaultRow& known : virtualFaults()) {
      if (known.name == row.name) fault.kind = known.fault;
    }
  }
  return fault;
}

class Trial {
 public:
  Trial(TrialRig& rig, const Injection& injection)
      : rig_(rig), kind_(*injection.kind), phase_(injection.phase) {
    verdict_.injection = injection;
  }

  Verdict run() {
    rig_.truth().forget();
    rig_.enter(phase_, verdict_.injection.device);
    std::this_thread::sleep_for(std::chrono::duration<double>(verdict_.injection.delay_s));
    const nlohmann::json before = rig_.peer().status();
    const std::string state = before.value("state", "");
    overlong_before_ = overlongCalls(before);
    if (state == "fault" || state == "stopped" || state == "off") {
      throw std::runtime_error("halted before the injection: " + before.value("reason", ""));
    }
    // On a busy machine the cords are slack before anything could befall their unloading.
    if (!rig_.session().empty() && !before.value("recording", false))
      throw std::runtime_error("the run was over before the injection");
    log_begin_ = fs::file_size(rig_.running().log());
    begun_ns_ = monotonic_ns();
    kind_.part == Part::kProgram ? befallProgram() : befallDevice();
    const std::int64_t until_ns = monotonic_ns();
    judgeMotion(until_ns);
    end();
    judgeSession();
    judgeNames();
    if (peer_there_) {
      verdict_.longest_call_s = rig_.peer().takeLongestCall_s();
      if (verdict_.longest_call_s > kLongestCall_s) problem("a call took too long");
      if (kind_.name != "daemon-stopped" && kind_.name != "daemon-killed") {
        verdict_.overlong_calls = overlongCalls(rig_.peer().status()) - overlong_before_;
      }
    }
    if (verdict_.wrong_values > 0) problem("a wrong value was accepted");
    return verdict_;
  }

 private:
  void problem(const std::string& text) { verdict_.problems.push_back(text); }
  double observed_s() const { return std::max(0.5, 1e-3 * kind_.bound_ms + 0.25); }

  static int overlongCalls(const nlohmann::json& status) {
    return status.contains("loop") ? status["loop"].value("overlong_calls", 0) : 0;
  }

  void befallDevice() {
    fault_ = faultOf(verdict_.injection);
    applyFault(rig_.rig(), *fault_, true);
    rig_.stay(observed_s(), true, [&](const nlohmann::json& status) { compare(status); });
  }

  void befallProgram() {
    const auto watch = [&](const nlohmann::json& status) { compare(status); };
    const pid_t daemon = rig_.running().daemon();
    if (kind_.name == "client-gone") {
      rig_.disconnect();
      rig_.connect();
      rig_.stay(observed_s(), false, watch);
    } else if (kind_.name == "client-silent") {
      rig_.peer().order("heartbeat");
      begun_ns_ = monotonic_ns();
      rig_.stay(observed_s(), false, watch);
    } else if (kind_.name == "lease-stolen") {
      stealLease();
    } else if (kind_.name == "lease-taken-over") {
      takeOver();
    } else if (kind_.name == "daemon-killed") {
      kill(daemon, SIGKILL);
      peer_there_ = false;
      rig_.disconnect();
      rig_.stay(observed_s(), false, watch);
    } else if (kind_.name == "daemon-stopped") {
      kill(daemon, SIGSTOP);
      std::this_thread::sleep_for(std::chrono::duration<double>(observed_s()));
    } else if (kind_.name == "disk-full") {
      fs::resize_file(rig_.running().log(), 0);  // the limit counts for the log too
      log_begin_ = 0;
      limitFiles(fs::file_size(rig_.session() + "/journal.jsonl"));
      rig_.stay(observed_s(), true, watch);
    } else if (kind_.name == "disk-read-only") {
      RpcPeer& peer = rig_.peer();
      if (peer.order("run", {{"protocol", kHold},
                             {"session", "/proc/tenter-session"},
                             {"fabric", "knit-12"},
                             {"specimen", "1"},
                             {"who", "trial"},
                             {"operator", "trial"},
                             {"areal_density_kg_per_m2", 0.2}})) {
        problem("a run began that cannot be written");
      }
      error_ = peer.lastError();
    }
  }

  void stealLease() {
    RpcPeer thief(rig_.running().socket());
    for (const char* method : {"lease", "unload", "disable", "home", "reset"}) {
      if (thief.order(method)) problem(std::string("somebody else could ") + method);
      if (std::string(method) == "lease") error_ = thief.lastError();
    }
    rig_.stay(observed_s(), true, [&](const nlohmann::json& status) { compare(status); });
  }

  /// The operator falls silent, and somebody else waits for the lease to run out.
  void takeOver() {
    rig_.peer().order("heartbeat");
    begun_ns_ = monotonic_ns();
    RpcPeer heir(rig_.running().socket());
    const bool taken = rig_system_test::waitFor(3.0, [&] { return heir.order("lease"); });
    if (!taken) problem("the lease does not run out");
    rig_.stay(0.4, false, [&](const nlohmann::json& status) { compare(status); });
  }

  void limitFiles(rlim_t bytes) {
    rlimit limit{};
    prlimit(rig_.running().daemon(), RLIMIT_FSIZE, nullptr, &limit);
    limit.rlim_cur = bytes;
    prlimit(rig_.running().daemon(), RLIMIT_FSIZE, &limit, nullptr);
  }

  /// Takes the fault away, and brings the run to its end.
  void end() {
    if (fault_) applyFault(rig_.rig(), *fault_, false);
    if (kind_.name == "unplug-in-transfer") (void)rig_.rig().usb().replug(fault_->device);
    if (kind_.name == "disk-full") limitFiles(RLIM_INFINITY);
    if (kind_.name == "daemon-stopped") kill(rig_.running().daemon(), SIGCONT);
    if (kind_.name == "daemon-killed") {
      rig_.restart();
      peer_there_ = true;
      log_begin_ = 0;
      return;
    }
    if (phase_ == RigPhase::kIdle) return;
    rig_.peer().order("lease");
    rig_.peer().order("abort");  // refused where the fault has ended it
  }

  /// Against what truly was while the amplifier was read.
  void compareValue(int cell, double gross_N, std::int64_t time_ns, std::int64_t age_ns) {
    const bool unknown = kind_.name == "stuck" && cell == verdict_.injection.device &&
                         time_ns > begun_ns_ && time_ns < begun_ns_ + kStuckAfter_ns;
    if (unknown) return;
    const auto truth = rig_.truth().tensions_N(cell, time_ns - age_ns - kHold_ns, time_ns);
    if (!truth) return;
    ++verdict_.values;
    if (gross_N > truth->first - kTolerance_N && gross_N < truth->second + kTolerance_N) return;
    if (++verdict_.wrong_values > 1) return;
    problem("cell-" + std::to_string(cell + 1) + " read " + std::to_string(gross_N) + " N of " +
            std::to_string(truth->first) + " to " + std::to_string(truth->second) + " N, " +
            std::to_string((time_ns - begun_ns_) / kMillisecond_ns) + " ms after the injection");
  }

  void compare(const nlohmann::json& status) {
    if (!status.contains("time_ns")) return;
    const auto& cells = status.at("cells");
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (!cells[i].at("gross_N").is_number()) continue;
      compareValue(static_cast<int>(i), cells[i]["gross_N"], status["time_ns"],
                   static_cast<std::int64_t>(1e6 * cells[i].at("age_ms").get<double>()));
    }
    last_state_ = status.value("state", "");
  }

  void judgeMotion(std::int64_t until_ns) {
    const auto milliseconds = [&](std::int64_t time_ns) {
      return time_ns == 0 ? 0.0 : 1e-6 * static_cast<double>(time_ns - begun_ns_);
    };
    const std::int64_t loading_ns = rig_.truth().lastLoading_ns(begun_ns_);
    const std::int64_t motion_ns = rig_.truth().lastMotion_ns(begun_ns_);
    verdict_.loading_ms = milliseconds(loading_ns);
    verdict_.motion_ms = milliseconds(motion_ns);
    const bool everything = kind_.name == "kill-switch" || kind_.name == "daemon-killed" ||
                            kind_.name == "daemon-stopped";
    const bool cells_count = phase_ == RigPhase::kJog || phase_ == RigPhase::kLoading;
    const bool loading = kind_.name == "added-force" || kind_.part != Part::kCell || cells_count;
    if (kind_.once || kind_.bound_ms == 0 || phase_ == RigPhase::kIdle) return;
    const std::int64_t bound_ns = begun_ns_ + kind_.bound_ms * kMillisecond_ns;
    if (everything && motion_ns > bound_ns) {
      problem("an axis moved " + std::to_string(verdict_.motion_ms) + " ms after it");
    } else if (loading && loading_ns > bound_ns) {
      problem("an axis loaded " + std::to_string(verdict_.loading_ms) + " ms after it");
    }
    const bool must_end = phase_ == RigPhase::kHolding && kind_.part != Part::kProgram;
    if (must_end && last_state_ != "fault" && last_state_ != "stopped") {
      problem("the rig went on holding in state " + last_state_);
    }
    if (until_ns < bound_ns) problem("it was not watched for long enough");
  }

  bool isNamed(const std::string& text) const {
    const std::string device = kind_.part == Part::kCell ? "cell-" : "axis-";
    const std::string source =
        kind_.part == Part::kProgram ? "" : device + std::to_string(verdict_.injection.device + 1);
    std::size_t from = 0;
    while (from < text.size()) {
      const std::size_t end = std::min(text.find('\n', from), text.size());
      const std::string_view line(text.data() + from, end - from);
      from = end + 1;
      if (line.find(source) == std::string_view::npos) continue;
      for (const std::string& name : kind_.names) {
        if (line.find(name) != std::string_view::npos) return true;
      }
    }
    return false;
  }

  static std::string faultLines(const std::string& journal) {
    std::string found;
    for (std::size_t from = 0, end = 0; from < journal.size(); from = end + 1) {
      end = std::min(journal.find('\n', from), journal.size());
      const std::string_view line(journal.data() + from, end - from);
      if (line.find("\"event\":\"fault\"") != std::string_view::npos) found += line;
    }
    return found;
  }

  void judgeNames() {
    if (kind_.names.empty()) return;
    if (!error_.empty()) {
      if (!isNamed(error_)) problem("the refusal says: " + error_);
      return;
    }
    if (kind_.name == "disk-read-only") return problem("nothing was refused");
    const std::string log = test_support::slurp(rig_.running().log()).substr(log_begin_);
    if (!isNamed(log)) problem("not named in the log: " + log.substr(0, 2000));
    // What cannot be written cannot be in the session.
    if (rig_.session().empty() || kind_.name == "disk-full") return;
    if (!isNamed(journal_)) problem("not named in the session, but: " + faultLines(journal_));
  }

  void judgeSession() {
    if (rig_.session().empty()) return;
    const bool breaks_off = kind_.name == "daemon-killed" || kind_.name == "disk-full";
    if (!rig_.waitForSession(10.0) && !breaks_off) problem("the session was not closed");
    const auto report = verifySession(rig_.session());
    if (!report) return problem("no session: " + report.error().message());
    if (!report->ok()) problem("the session is not whole: " + report->problems.front());
    Redecider redecider;
    const auto replayed = replaySession(rig_.session(), {}, redecider);
    if (!replayed) {
      problem("the session cannot be replayed: " + replayed.error().message());
    } else if (!redecider.decided() || (!redecider.identical() && kind_.name != "disk-full")) {
      problem("the session decides otherwise when it is replayed");
    }
    journal_ = test_support::slurp(rig_.session() + "/journal.jsonl");
    compareSamples();
    fs::remove_all(rig_.session());
  }

  void compareSamples() {
    const auto reader = SessionReader::open(rig_.session());
    if (!reader) return;
    std::int64_t zero_ns = 0;
    for (auto record = (*reader)->next(); record && record->has_value();
         record = (*reader)->next()) {
      const auto* generic = std::get_if<GenericRecord>(&(*record)->body);
      if (generic != nullptr && generic->kind == "rig-memory") {
        zero_ns = nlohmann::json::parse(generic->data).at("monotonic_ns");
      }
      const auto* sample = std::get_if<SampleRecord>(&(*record)->body);
      if (sample == nullptr) continue;
      for (std::size_t i = 0; i < sample->tensions.size(); ++i) {
        const TensionReading& tension = sample->tensions[i];
        if (tension.status != TensionStatus::kOk) continue;
        compareValue(static_cast<int>(i), *tension.tension_N, zero_ns + (*record)->time_ns,
                     tension.age_ns);
      }
    }
  }

  TrialRig& rig_;
  const FaultKindRow& kind_;
  RigPhase phase_;
  Verdict verdict_;
  std::optional<ScriptedFault> fault_;
  std::int64_t begun_ns_ = 0;
  int overlong_before_ = 0;
  std::size_t log_begin_ = 0;
  bool peer_there_ = true;
  std::string last_state_, error_, journal_;
};

}  // namespace

nlohmann::json Verdict::json() const {
  return {{"kind", injection.kind->name},
          {"phase", rigPhaseName(injection.phase)},
          {"device", injection.device + 1},
          {"problems", problems},
          {"loading_ms", loading_ms},
          {"motion_ms", motion_ms},
          {"values", values},
          {"wrong_values", wrong_values},
          {"longest_call_s", longest_call_s},
          {"overlong_calls", overlong_calls},
          {"disturbed", disturbed}};
}

Verdict tryFault(TrialRig& trial, const Injection& injection) {
  return Trial(trial, injection).run();
}

}  // namespace tenter::campaign
