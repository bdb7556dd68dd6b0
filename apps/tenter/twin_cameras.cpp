// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <cstdio>
#include <thread>

#include "camera_source.h"
#include "interrupt.h"
#include "tenter/core/files.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  CameraSourceOptions source;
  std::string output;
  std::uint64_t seed = 1;
  std::vector<double> lost_percent;
};

void declare(CLI::App& command, Options& o) {
  declareCameraSource(command, o.source, 4);
  command.add_option("-o,--output", o.output, "File for their table of a rig's file")->required();
  command.add_option("--seed", o.seed, "Of noise and losses")->capture_default_str();
  command
      .add_option("--lost-percent", o.lost_percent,
                  "Packets that are lost, of each camera or of all")
      ->check(CLI::Range(0.0, 100.0));
}

Result<int> serve(const Options& o, Console& console) {
  const auto options = camerasOf(o.source, o.seed);
  if (!options) return options.error();
  const auto cameras = VirtualCameras::serve(*options);
  if (!cameras) return cameras.error();
  for (int i = 0; i < (*cameras)->count() && !o.lost_percent.empty(); ++i) {
    const auto row = std::min(static_cast<std::size_t>(i), o.lost_percent.size() - 1);
    (*cameras)->losePackets(i, 0.01 * o.lost_percent[row]);
  }
  if (auto done = writeFileAtomically(o.output, (*cameras)->configuration()); !done) {
    return done.error();
  }
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < (*cameras)->count(); ++i) {
    rows.push_back({{"name", (*cameras)->name(i)},
                    {"address", (*cameras)->address(i)},
                    {"serial", (*cameras)->serial(i)}});
    console.say((*cameras)->name(i) + "  " + (*cameras)->address(i) + "  " + (*cameras)->serial(i));
  }
  // At once and flushed: whoever uses the cameras reads it while this program serves.
  if (console.json) std::printf("%s\n", nlohmann::json{{"cameras", rows}}.dump().c_str());
  std::fflush(stdout);
  while (!interrupted()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  console.answer["served"] = (*cameras)->count();
  return kDone;
}

}  // namespace

Verb twinCameras() {
  return {"cameras", "Serve virtual GigE Vision cameras until Ctrl-C",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, serve); }};
}

}  // namespace tenter::app
