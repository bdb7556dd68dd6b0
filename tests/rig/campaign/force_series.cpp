// SPDX-License-Identifier: GPL-3.0-or-later
// One cell steps beyond the absolute limit while all eight axes draw in: how long until all stand.
// One JSON line a trial.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <random>
#include <thread>

#include "tenter/rig/load_cell.h"
#include "tenter/session/session_reader.h"
#include "tenter/twin/virtual_usb.h"
#include "trial_rig.h"

namespace tenter::campaign {
namespace {

constexpr double kStep_N = 20.0;
/// Unloading begins 0.1 s after the halt; on a slow bus the halt itself is a scan later.
constexpr double kWatched_s = 0.095, kWatchedRtu_s = 0.18;
constexpr double kTwoScansRtu_s = 0.16;
/// Of the rig's file: what a sample of the stiffest kind would have made of the way.
constexpr double kStiffest_N_per_m = 1000.0;

constexpr const char* kPull = R"(schema_version = 1
name = "all-axes"
description = "every axis draws in"
axes = ["axis-1"]
speed_m_per_s = 0.001
capture_interval_s = 1.0
[[phase]]
name = "pull"
[[phase.step]]
end = "travel"
targets_m = {axis-1 = 0.03, axis-2 = 0.03, axis-3 = 0.03, axis-4 = 0.03, axis-5 = 0.03, axis-6 = 0.03, axis-7 = 0.03, axis-8 = 0.03}
)";

void trial(TrialRig& rig, int number, double wait_s, int cell, bool tcp) {
  const std::string session = rig.running().path("series-" + std::to_string(number));
  rig.truth().forget();
  rig.order("run", {{"protocol", kPull},
                    {"session", session},
                    {"fabric", "knit-12"},
                    {"specimen", "1"},
                    {"who", "series"},
                    {"operator", "series"},
                    {"areal_density_kg_per_m2", 0.2},
                    {"skip_mapping_check", true}});
  rig.stay(wait_s, true, [](const auto& /*status*/) {});
  const std::int64_t begun_ns = monotonic_ns();
  rig.rig().addForce(cell, kStep_N);
  std::this_thread::sleep_for(std::chrono::duration<double>(tcp ? kWatched_s : kWatchedRtu_s));
  const std::int64_t loading_ns = rig.truth().lastLoading_ns(begun_ns);
  const double drawn_m = rig.truth().drawn_m(begun_ns, monotonic_ns());
  rig.rig().addForce(cell, 0.0);
  // Until that is read: the next trial is not to begin with a cell that is not trusted.
  if (!tcp) std::this_thread::sleep_for(std::chrono::duration<double>(kTwoScansRtu_s));
  const bool moved = rig.truth().drawn_m(begun_ns - 200'000'000, begun_ns) > 1e-4;
  const bool closed = rig.waitForSession(10.0);
  const auto report = verifySession(session);
  const nlohmann::json at_cell = rig.peer().status().at("cells").at(static_cast<std::size_t>(cell));
  const nlohmann::json line{
      {"cell", cell + 1},
      {"moved_before", moved},
      {"halted_ms", loading_ns == 0 ? 0.0 : 1e-6 * static_cast<double>(loading_ns - begun_ns)},
      {"drawn_m", drawn_m},
      {"scan_ms", at_cell.at("scan_ms")},
      {"longest_scan_ms", at_cell.at("longest_scan_ms")},
      {"overshoot_N", drawn_m * kStiffest_N_per_m},
      {"session_ok", closed && report && report->ok()}};
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
  std::filesystem::remove_all(session);
}

int run(std::uint64_t seed, int count, bool tcp) {
  TrialRig rig(tcp);
  std::mt19937_64 random(seed);
  for (int i = 0; i < count; ++i) {
    rig.recover();
    const double wait_s = 0.45 + 0.2 * static_cast<double>(random() % 1000) / 1000.0;
    trial(rig, i, wait_s, static_cast<int>(random() % ServedRig::kAxes), tcp);
  }
  return 0;
}

}  // namespace
}  // namespace tenter::campaign

int main(int argc, char** argv) {
  if (const auto ready = tenter::VirtualUsb::preload(argv); !ready) {
    std::fprintf(stderr, "%s\n", ready.error().message().c_str());
    return 1;
  }
  CLI::App app{"A force beyond the limit, again and again"};
  std::uint64_t seed = 1;
  int count = 20;
  std::string modbus = "tcp";
  app.add_option("--seed", seed, "Of cells and moments");
  app.add_option("--count", count, "Trials");
  app.add_option("--modbus", modbus, "tcp or rtu")->check(CLI::IsMember({"tcp", "rtu"}));
  CLI11_PARSE(app, argc, argv);
  try {
    return tenter::campaign::run(seed, count, modbus == "tcp");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
