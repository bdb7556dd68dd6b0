// SPDX-License-Identifier: GPL-3.0-or-later
// A seeded campaign of faults against the daemon on a virtual rig; one JSON line an injection.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>

#include "tenter/twin/virtual_usb.h"
#include "trial.h"

namespace {

struct Options {
  std::uint64_t seed = 1;
  int count = 120, shard = 0, shards = 1;
  std::string modbus = "tcp", only;
};

using namespace tenter::campaign;  // NOLINT(google-build-using-namespace)

/// Where the machine that runs this is so busy that the rig halts before the injection, another
/// time.
Verdict attempt(TrialRig& trial, const Injection& injection) {
  constexpr int kAttempts = 4;
  Verdict verdict;
  verdict.injection = injection;
  for (int i = 0; i < kAttempts; ++i) {
    try {
      trial.recover();
      Verdict made = tryFault(trial, injection);
      made.disturbed = i;
      return made;
    } catch (const std::exception& error) {  // the others are still to be tried
      verdict.problems = {error.what()};
      trial.restart();
    }
  }
  verdict.disturbed = kAttempts;
  return verdict;
}

int run(const Options& o) {
  const bool tcp = o.modbus == "tcp";
  TrialRig trial(tcp);
  int bad = 0;
  std::optional<Injection> last;
  for (const Injection& injection : makePlan(o.seed, o.count, o.shard, o.shards, tcp)) {
    if (!o.only.empty() && injection.kind->name != o.only) continue;
    // The daemon names the same again only after a second of quiet.
    if (last && last->kind == injection.kind && last->device == injection.device)
      std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    last = injection;
    const Verdict verdict = attempt(trial, injection);
    std::printf("%s\n", verdict.json().dump().c_str());
    std::fflush(stdout);
    if (!verdict.problems.empty()) ++bad;
  }
  return bad == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto ready = tenter::VirtualUsb::preload(argv); !ready) {
    std::fprintf(stderr, "%s\n", ready.error().message().c_str());
    return 1;
  }
  CLI::App app{"Faults against the daemon on a virtual rig"};
  Options options;
  app.add_option("--seed", options.seed, "Of kinds, phases, devices and moments");
  app.add_option("--count", options.count, "Injections of the plan");
  app.add_option("--shard", options.shard, "Which part of the plan, from 0");
  app.add_option("--shards", options.shards, "Parts of the plan");
  app.add_option("--only", options.only, "One kind of the plan alone");
  app.add_option("--modbus", options.modbus, "tcp or rtu")->check(CLI::IsMember({"tcp", "rtu"}));
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::printf(
        "%s\n",
        nlohmann::json{
            {"kind", "campaign"}, {"phase", "-"}, {"device", 0}, {"problems", {error.what()}}}
            .dump()
            .c_str());
    return 1;
  }
}
