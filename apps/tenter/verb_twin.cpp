// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cstdio>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/core/measurement_folder.h"
#include "tenter/twin/capture.h"
#include "twin_images.h"
#ifdef TENTER_HARDWARE
#include "twin_session.h"
#endif
#include "verbs.h"

namespace tenter::app {

namespace {

struct NoOptions {};

void declareNothing(CLI::App& /*command*/, NoOptions& /*options*/) {}

Result<int> listFabrics(const NoOptions& /*options*/, Console& console) {
  auto& rows = console.answer["fabrics"] = nlohmann::json::array();
  for (const Fabric& fabric : fabrics()) {
    rows.push_back({{"id", fabric.id},
                    {"description", fabric.description},
                    {"areal_density_kg_per_m2", fabric.areal_density_kg_per_m2},
                    {"thickness_m", fabric.thickness_m}});
    console.say(std::string(fabric.id));
  }
  return kDone;
}

struct CaptureCommand {
  CaptureOptions capture;
  std::string noise = "on", scatter = "on", friction = "on", diagonals = "uniform";
  bool measurement = false, session = false, through_daemon = false;
  std::string modbus = "tcp";
  int nodes = 0;
  std::string fabric, output, truth, shown;
  ImageOptions images;
  const CLI::Option* cameras = nullptr;  ///< Whether they were asked for.
};

void declareCapture(CLI::App& command, CaptureCommand& o) {
  const CLI::IsMember on_off({"on", "off"});
  command.add_option("--fabric", o.fabric, "One of `tenter twin fabrics`; boards need none");
  command.add_option("--protocol", o.capture.protocol, "One of `tenter protocol list`")->required();
  CLI::Option_group* kind = command.add_option_group("what is written");
  kind->require_option(1);
  kind->add_flag("--measurement", o.measurement, "A measurement, the input of a fit");
  kind->add_flag("--session", o.session, "A session with images, as a rig records it");
  kind->add_option("--boards", o.images.boards,
                   "Images of a calibration board in so many poses; number 0 lies level in the rig")
      ->check(CLI::Range(3, 1000));
#ifdef TENTER_HARDWARE
  command.add_flag("--through-daemon", o.through_daemon,
                   "A session through virtual devices and tenterd, in real time");
  command.add_option("--images", o.shown,
                     "What cameras show to the daemon: scene (the sample as it hangs), "
                     "test-pattern, a picture, or a folder of pictures; without, and without "
                     "--cameras, it has none");
  command.add_option("--modbus", o.modbus, "How a session's load cells are reached")
      ->check(CLI::IsMember({"tcp", "rtu"}))
      ->capture_default_str();
#endif
  command.add_option("-o,--output", o.output, "Folder of what is written")->required();
  command.add_option("--truth", o.truth, "Folder for what a fit must not know");
  command.add_option("--seed", o.capture.seed, "Of noise and of the specimen")
      ->capture_default_str();
  command.add_option("--specimen", o.capture.specimen, "Number of the piece; 0: as the seed")
      ->capture_default_str();
  command
      .add_option("--nodes", o.nodes,
                  "Nodes a side of the simulated sheet; 0: 50, and 25 through the daemon")
      ->capture_default_str();
  command.add_option("--frames", o.capture.frames, "Frames")->capture_default_str();
  command.add_option("--tracked", o.capture.tracked, "Tracked vertices a side")
      ->capture_default_str();
  command.add_option("--noise", o.noise, "Noise of cameras, poses and load cells")
      ->check(on_off)
      ->capture_default_str();
  command.add_option("--scatter", o.scatter, "Whether specimens differ from the nominal fabric")
      ->check(on_off)
      ->capture_default_str();
  command.add_option("--friction", o.friction, "Internal friction of the cloth, and of the cords")
      ->check(on_off)
      ->capture_default_str();
  command.add_option("--diagonals", o.diagonals, "Diagonals of the simulated sheet")
      ->check(CLI::IsMember({"uniform", "alternating"}))
      ->capture_default_str();
  declareImages(command, o.images);
  o.cameras = command.get_option("--cameras");
}

#ifdef TENTER_HARDWARE
Result<int> captureThroughDaemon(const CaptureCommand& command, Console& console) {
  SessionCapture session;
  session.mount = {command.fabric, command.capture.protocol, command.capture.seed,
                   command.capture.specimen, MountOptions{}.nodes};
  if (command.nodes != 0) session.mount.nodes = command.nodes;
  session.tcp = command.modbus == "tcp";
  std::string shown = command.shown;
  if (shown.empty() && command.cameras->count() > 0) shown = CameraSourceOptions::kScene;
  if (!shown.empty()) {
    const bool drawn =
        shown == CameraSourceOptions::kScene || shown == CameraSourceOptions::kTestPattern;
    session.cameras = {command.images.cameras, shown, drawn ? command.images.width_px : 0, 0};
  }
  session.output = command.output;
  session.truth = command.truth;
  return captureSession(session, console);
}
#endif

Result<int> captureToMeasurement(const CaptureOptions& capture, const CaptureCommand& command,
                                 Console& console) {
  if (auto free = checkOutputFolder(command.output, measurementFolder()); !free)
    return free.error();
  if (!command.truth.empty()) {
    if (command.truth == command.output) {
      return usageError("--truth must be another folder than -o");
    }
    if (auto free = checkOutputFolder(command.truth, truthFolder()); !free) return free.error();
  }
  CaptureOptions options = capture;
  Progress progress(console);
  options.progress = [&](int done, int all) {
    progress.show(
        static_cast<double>(done) / std::max(all, 1),
        options.protocol + ", frame " + std::to_string(done) + " of " + std::to_string(all));
  };
  const auto captured = captureMeasurement(options);
  if (!captured && interrupted()) return notConverged("stopped; nothing was written");
  if (!captured) return captured.error();
  if (auto done = writeMeasurement(command.output, captured->measurement); !done) {
    return done.error();
  }
  if (!command.truth.empty()) {
    if (auto done = writeTruth(command.truth, captured->truth); !done) return done.error();
  }
  const auto& statistics = captured->statistics;
  console.answer = {{"measurement", command.output},
                    {"fabric", options.fabric},
                    {"protocol", options.protocol},
                    {"frames", captured->measurement.frames.size()},
                    {"newton_steps", statistics.newton_steps},
                    {"factorizations", statistics.factorizations},
                    {"largest_residual_N", statistics.largest_residual_N},
                    {"seconds", statistics.seconds}};
  console.say(command.output + ": " + counted(captured->measurement.frames.size(), "frame") +
              " of " + options.protocol);
  return kDone;
}

Result<int> capture(const CaptureCommand& command, Console& console) {
  if (command.fabric.empty() && command.images.boards == 0) {
    return usageError("--fabric is required", "see `tenter twin fabrics`");
  }
  if (command.through_daemon) {
    if (!command.session) return usageError("--through-daemon makes a --session");
#ifdef TENTER_HARDWARE
    return captureThroughDaemon(command, console);
#endif
  }
  CaptureOptions options = command.capture;
  options.fabric = command.fabric;
  if (command.nodes != 0) options.nodes = command.nodes;
  options.noise = command.noise == "on";
  options.scatter = command.scatter == "on";
  options.friction = options.cord_friction = command.friction == "on";
  options.diagonals =
      command.diagonals == "uniform" ? DiagonalPattern::kUniform : DiagonalPattern::kAlternating;
  options.cancelled = interrupted;
  if (command.images.boards > 0) {
    return captureBoards(options, command.images, command.output, command.truth, console);
  }
  if (command.session) {
    return captureImages(options, command.images, command.output, command.truth, console);
  }
  return captureToMeasurement(options, command, console);
}

}  // namespace

Verb twinVerb() {
  static const std::array kRows = {
#ifdef TENTER_HARDWARE
      twinServe(), twinCameras(), twinTruth(),
#endif
      Verb{"fabrics", "Names of the virtual fabrics",
           [](CLI::App& c, Action& a) {
             setUpCommand<NoOptions>(c, a, declareNothing, listFabrics);
           }},
      Verb{"capture", "Simulate a protocol and write what a rig would have measured",
           [](CLI::App& c, Action& a) {
             setUpCommand<CaptureCommand>(c, a, declareCapture, capture);
           }}};
  return {"twin", "The virtual rig", [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
