// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <optional>

#include "protocol_files.h"
#include "rig_gauges.h"
#include "rig_snap.h"
#include "rig_visit.h"
#include "verbs.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;

constexpr double kMillimetre_m = 1e-3;

struct Options {
  const CLI::Option* socket = nullptr;  ///< Of `tenter rig`, before or behind the verb.
  std::string axis;
  double by_mm = 0.0, speed_mm_per_s = 1.0;
  std::string protocol, output, fabric = "unknown", specimen = "unknown", who = "unknown",
                                operator_name = "unknown";
  double areal_density_kg_per_m2 = 0.2;
  std::optional<double> temperature_degC, humidity_percent;
  bool skip_mapping_check = false;
  std::vector<std::string> axes;
};

void declareSocket(CLI::App& command, Options& o) {
  o.socket = command.get_parent()->get_option("--socket");
}

void declareJog(CLI::App& command, Options& o) {
  declareSocket(command, o);
  command.add_option("axis", o.axis, "Name of the axis")->required();
  command.add_option("--by-mm", o.by_mm, "How far; positive loads the sample")->required();
  command.add_option("--speed-mm-per-s", o.speed_mm_per_s, "How fast")->capture_default_str();
}

void declareRun(CLI::App& command, Options& o) {
  declareSocket(command, o);
  command.add_option("protocol", o.protocol, "A shipped protocol, or a TOML file")->required();
  command.add_option("-o,--output", o.output, "Folder of the session")->required();
  command.add_option("--fabric", o.fabric, "For the session's record")->capture_default_str();
  command.add_option("--specimen", o.specimen, "Which piece of the fabric")->capture_default_str();
  command.add_option("--who", o.who, "Whom the data belong to")->capture_default_str();
  command.add_option("--operator", o.operator_name, "Who is at the bench")->capture_default_str();
  command.add_option("--areal-density", o.areal_density_kg_per_m2, "kg/m2")->capture_default_str();
  command.add_option("--temperature", o.temperature_degC, "Of the air, degrees Celsius")
      ->check(CLI::Range(-50.0, 100.0));
  command.add_option("--humidity", o.humidity_percent, "Relative, of the air, per cent")
      ->check(CLI::Range(0.0, 100.0));
  command.add_flag("--skip-mapping-check", o.skip_mapping_check,
                   "Begin without having seen that each axis pulls its own cell; it is recorded");
}

void declareCheckMapping(CLI::App& command, Options& o) {
  declareSocket(command, o);
  command.add_option("axes", o.axes, "Axes to try; without, all that have a cell");
}

Result<int> status(const Options& o, Console& console) {
  const auto client = RigClient::connect(o.socket->as<std::string>());
  if (!client) return client.error();
  const auto answer = (*client)->call("status");
  if (!answer) return answer.error();
  console.answer = *answer;
  for (const std::string& line : gaugeLines(*answer)) console.say(line);
  return kDone;
}

Result<int> stop(const Options& o, Console& console) {
  const auto client = RigClient::connect(o.socket->as<std::string>());
  if (!client) return client.error();
  const auto answer = (*client)->call("stop");
  if (!answer) return answer.error();
  console.answer = *answer;
  console.say("all axes halted");
  return kDone;
}

/// Of a run that another terminal of the same user has started and goes on watching.
template <const char* kMethod>
Result<int> beside(const Options& o, Console& console) {
  const auto client = RigClient::connect(o.socket->as<std::string>());
  if (!client) return client.error();
  if (auto done = (*client)->call(kMethod); !done) return done.error();
  const auto answer = (*client)->call("status");
  if (!answer) return answer.error();
  console.answer = *answer;
  console.say("the rig is " + answer->value("state", ""));
  return kDone;
}

Result<int> giveAndWait(const Options& o, Console& console, const std::string& method,
                        const Json& params = Json::object()) {
  const auto visit = RigVisit::begin(o.socket->as<std::string>(), console);
  if (!visit) return visit.error();
  const bool needs_current = method != "disable";
  if (needs_current) {
    if (auto up = (*visit)->enable(); !up) return up.error();
  }
  const auto before = (*visit)->call("status");
  if (!before) return before.error();
  if (method != "enable") {
    if (auto done = (*visit)->call(method, params); !done) return done.error();
  }
  const auto status = (*visit)->wait(method);
  if (!status) return status.error();
  return (*visit)->ended(*before, *status);
}

Result<int> jog(const Options& o, Console& console) {
  return giveAndWait(o, console, "jog",
                     {{"axis", o.axis},
                      {"distance_m", o.by_mm * kMillimetre_m},
                      {"speed_m_per_s", o.speed_mm_per_s * kMillimetre_m}});
}

Result<int> run(const Options& o, Console& console) {
  const auto text = protocolText(o.protocol);
  if (!text) return text.error();
  const auto visit = RigVisit::begin(o.socket->as<std::string>(), console);
  if (!visit) return visit.error();
  RigRun run{*text,
             o.protocol,
             o.output,
             o.fabric,
             o.specimen,
             o.who,
             o.operator_name,
             o.areal_density_kg_per_m2,
             o.temperature_degC,
             {},
             o.skip_mapping_check};
  if (o.humidity_percent) run.relative_humidity = 0.01 * *o.humidity_percent;
  return (*visit)->run(run);
}

Result<int> checkMapping(const Options& o, Console& console) {
  const auto visit = RigVisit::begin(o.socket->as<std::string>(), console);
  if (!visit) return visit.error();
  if (auto up = (*visit)->enable(); !up) return up.error();
  if (auto homed = (*visit)->homeIfLost(); !homed) return homed.error();
  const auto before = (*visit)->call("status");
  if (!before) return before.error();
  if (auto done = (*visit)->call("check-mapping", {{"axes", o.axes}}); !done) return done.error();
  const auto status = (*visit)->wait("check-mapping");
  if (!status) return status.error();
  (*visit)->tellMapping(*status, true);
  return (*visit)->ended(*before, *status);
}

template <const char* kMethod>
Result<int> plain(const Options& o, Console& console) {
  return giveAndWait(o, console, kMethod);
}

constexpr char kEnable[] = "enable", kDisable[] = "disable", kHome[] = "home", kTare[] = "tare",
               kUnload[] = "unload", kReset[] = "reset", kPause[] = "pause", kResume[] = "resume",
               kAbort[] = "abort";

template <const char* kMethod>
void setUpBeside(CLI::App& command, Action& action) {
  setUpCommand<Options>(command, action, declareSocket, beside<kMethod>);
}

template <const char* kMethod>
void setUpPlain(CLI::App& command, Action& action) {
  setUpCommand<Options>(command, action, declareSocket, plain<kMethod>);
}

}  // namespace

Verb rigVerb() {
  static const std::array kRows = {
      Verb{"status", "State, positions and tensions",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSocket, status); }},
      rigGauges(),
      Verb{"stop", "Halt all axes at once; anybody may",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSocket, stop); }},
      Verb{"enable", "Give the motors current", setUpPlain<kEnable>},
      Verb{"disable", "Take the motors' current away", setUpPlain<kDisable>},
      Verb{"home", "Find the ends of all axes", setUpPlain<kHome>},
      Verb{"tare", "Take the tensions of now for zero", setUpPlain<kTare>},
      Verb{"unload", "Let all cords out until they are slack", setUpPlain<kUnload>},
      Verb{"reset", "Leave a fault or a stop behind", setUpPlain<kReset>},
      Verb{"pause", "Hold the run that is under way", setUpBeside<kPause>},
      Verb{"resume", "Go on with a run that was held", setUpBeside<kResume>},
      Verb{"abort", "End the run that is under way, and unload", setUpBeside<kAbort>},
      rigSnap(),
      Verb{"jog", "Move one axis",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareJog, jog); }},
      Verb{"check-mapping", "Draw in each axis a little: is it its own cell that answers?",
           [](CLI::App& c, Action& a) {
             setUpCommand<Options>(c, a, declareCheckMapping, checkMapping);
           }},
      Verb{"run", "Run a protocol and record the session; homes first if it must",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareRun, run); }}};
  return {"rig", "The rig, through tenterd", [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            command.add_option("--socket", "Socket of tenterd")->required();
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
