// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon's JSON-RPC: whatever a line holds, the answer is one line of JSON-RPC, and nothing is
// written outside of the session that was asked for. The rig has no devices.
#include <spdlog/spdlog.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <thread>

#include "fuzz_target.h"
#include "rpc.h"

namespace {

using Json = nlohmann::json;

constexpr const char* kRig = R"(schema_version = 1
name = "fuzz"
[limits]
absolute_N = 6.0
working_N = 5.0
slack_N = 0.05
slope_N_per_s = 30.0
stiffest_sample_N_per_m = 400.0
following_error_m = 0.001
[[cell]]
name = "cell-1"
address = "tcp:127.0.0.1:9"
unit = 1
map = "laumas-tlb"
capacity_N = 50.0
[[axis]]
name = "axis-1"
serial = "there-is-none"
metres_per_unit = 1e-6
travel_m = [0.0, 0.08]
max_speed_m_per_s = 0.005
max_acceleration_m_per_s2 = 0.1
cell = "cell-1"
)";

constexpr const char* kProtocol = R"(schema_version = 1
name = "p"
description = "d"
axes = ["axis-1"]
speed_m_per_s = 0.001
capture_interval_s = 1.0
[[phase]]
name = "p"
[[phase.step]]
end = "hold"
hold_s = 1.0
)";

void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// A daemon without its socket, for as long as the fuzzer runs.
struct Daemon {
  Daemon() {
    spdlog::set_level(spdlog::level::off);
    auto started = tenter::daemon::RigService::start(*tenter::parseRigConfig(kRig, "rig.toml"));
    require(started.ok(), "the daemon starts without devices");
    service = *std::move(started);
    rpc = std::make_unique<tenter::daemon::Rpc>(*service);
    loop = std::thread([this] { service->loop([this] { rpc->tick(); }); });
  }
  ~Daemon() {
    service->quit();
    loop.join();
  }

  std::unique_ptr<tenter::daemon::RigService> service;
  std::unique_ptr<tenter::daemon::Rpc> rpc;
  std::thread loop;
};

/// Sessions go where none can be made, so that no input writes to this machine.
std::string tamed(std::string_view line) {
  Json request = Json::parse(line, nullptr, false);
  const bool names_session =
      request.is_object() && request.contains("params") && request["params"].is_object() &&
      request["params"].contains("session") && request["params"]["session"].is_string();
  if (!names_session) return std::string(line);
  request["params"]["session"] = "/proc/tenter-fuzz";
  return request.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::vector<std::string> fuzzSeeds() {
  std::vector<std::string> seeds;
  for (const char* method : {"status", "stop", "lease", "heartbeat", "enable", "disable", "home",
                             "tare", "pause", "resume", "abort", "unload", "reset", "dance"}) {
    seeds.push_back(Json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}}.dump());
  }
  const Json jog{{"axis", "axis-1"}, {"distance_m", 0.001}, {"speed_m_per_s", 0.001}};
  const Json run{{"protocol", kProtocol},
                 {"session", "/proc/tenter-fuzz"},
                 {"fabric", "f"},
                 {"specimen", "s"},
                 {"who", "w"},
                 {"operator", "o"},
                 {"areal_density_kg_per_m2", 0.2}};
  seeds.push_back(Json{{"jsonrpc", "2.0"}, {"id", "x"}, {"method", "jog"}, {"params", jog}}.dump());
  seeds.push_back(Json{{"jsonrpc", "2.0"}, {"id", 2}, {"method", "run"}, {"params", run}}.dump());
  seeds.emplace_back("[]");
  seeds.emplace_back("{\"jsonrpc\":\"2.0\",\"method\":\"status\",\"params\":[1,2]}");
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Daemon daemon;
  const std::string line = tamed({reinterpret_cast<const char*>(data), size});
  const tenter::daemon::Client client{1, "somebody"};
  std::vector<tenter::daemon::Descriptor> attached;
  const std::string answer = daemon.rpc->answer(line, client, attached);
  if (answer.empty()) {
    require(!Json::parse(line, nullptr, false).contains("id"),
            "only a notification stays unanswered");
    return 0;
  }
  require(answer.find('\n') == std::string::npos, "an answer is one line");
  const Json parsed = Json::parse(answer, nullptr, false);
  require(parsed.is_object() && parsed.value("jsonrpc", "") == "2.0" && parsed.contains("id"),
          "an answer is JSON-RPC 2.0");
  require(parsed.contains("result") != parsed.contains("error"), "a result or an error");
  return 0;
}
