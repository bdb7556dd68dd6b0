// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <optional>
#include <thread>

#include "camera_source.h"
#include "device_preload.h"
#include "interrupt.h"
#include "tenter/twin/fault_player.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  ServedRigOptions rig;
  CameraSourceOptions cameras;
  std::string state, modbus = "tcp", faults;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("--fabric", o.rig.mount.fabric, "One of `tenter twin fabrics`")->required();
  command.add_option("--state", o.state, "Folder for rig.toml")->required();
  command.add_option("--modbus", o.modbus, "How the load cells are reached")
      ->check(CLI::IsMember({"tcp", "rtu"}))
      ->capture_default_str();
  declareRigCameras(command, o.cameras);
  command.add_option("--fault", o.faults, "Script of faults (docs/formats/fault-script.md)");
  command.add_option("--protocol", o.rig.mount.protocol, "How the sample hangs")
      ->capture_default_str();
  command.add_option("--seed", o.rig.mount.seed, "Of the cells' noise and of the specimen")
      ->capture_default_str();
  command.add_option("--specimen", o.rig.mount.specimen, "Number of the piece; 0: as the seed")
      ->capture_default_str();
  command
      .add_option("--clips", o.rig.mount.clips,
                  "free: the sample hangs on them; held: fixed, so that cords alone give way; "
                  "unhooked: every cord is on a spring at the frame")
      ->check(CLI::IsMember({"free", "held", "unhooked"}))
      ->capture_default_str();
  command.add_option("--nodes", o.rig.mount.nodes, "Nodes a side of the simulated sheet")
      ->capture_default_str();
}

std::string quoted(const std::string& text) { return "'" + text + "'"; }

/// Nothing without a script; what it does goes to faults.jsonl in the state folder.
Result<std::unique_ptr<FaultPlayer>> play(std::optional<FaultScript> script, ServedRig& rig) {
  if (!script) return std::unique_ptr<FaultPlayer>();
  return FaultPlayer::start(rig, *std::move(script),
                            rig.configFile().replace_filename("faults.jsonl"));
}

Result<int> serve(const Options& o, Console& console) {
  std::optional<FaultScript> script;
  if (!o.faults.empty()) {
    auto read = readFaultScript(o.faults, {ServedRig::kAxes, o.modbus == "tcp", o.cameras.cameras});
    if (!read) return read.error();
    script = *std::move(read);
  }
  ServedRigOptions options = o.rig;
  if (auto added = addCameras(o.cameras, options); !added) return added.error();
  if (auto ready = preloadDevices(); !ready) return ready.error();
  options.state = o.state;
  options.tcp = o.modbus == "tcp";
  const auto rig = ServedRig::start(options);
  if (!rig) return rig.error();
  const auto player = play(std::move(script), **rig);
  if (!player) return player.error();
  std::string command = "env";
  for (const std::string& variable : (*rig)->usb().environment()) command += " " + quoted(variable);
  const std::string config = (*rig)->configFile().string();
  const std::string socket = (*rig)->configFile().replace_filename("tenterd.sock").string();
  command += " tenterd --config " + quoted(config) + " --socket " + quoted(socket);
  // At once and flushed: whoever starts the daemon reads it while this program serves.
  std::printf("%s\n", console.json ? nlohmann::json{{"tenterd", command},
                                                    {"config", config},
                                                    {"socket", socket},
                                                    {"environment", (*rig)->usb().environment()}}
                                         .dump()
                                         .c_str()
                                   : command.c_str());
  std::fflush(stdout);
  while (!interrupted()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  console.answer["served"] = o.rig.mount.fabric;
  return kDone;
}

}  // namespace

Verb twinServe() {
  return {"serve", "Serve a virtual rig behind the devices' protocols until Ctrl-C",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, serve); }};
}

}  // namespace tenter::app
