// SPDX-License-Identifier: GPL-3.0-or-later
#include "protocol_files.h"

#include <algorithm>
#include <cstdio>

#include "tenter/rig/protocol_simulation.h"
#include "tenter/rig/shipped_files.h"
#include "tenter/twin/served_rig.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;

struct Options {
  std::string protocol, rig;
};

void declareShow(CLI::App& command, Options& o) {
  command.add_option("protocol", o.protocol, "Name of a shipped protocol")->required();
}

void declareCheck(CLI::App& command, Options& o) {
  command.add_option("file", o.protocol, "Protocol (TOML)")->required();
  command.add_option("--rig", o.rig,
                     "Configuration of the rig that is to run it; without, of the virtual one");
}

Result<int> show(const Options& o, Console& console) {
  const ShippedFile* file = findShippedFile(shippedProtocols(), o.protocol);
  if (file == nullptr) {
    std::string names;
    for (const ShippedFile& known : shippedProtocols()) {
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    return usageError("there is no protocol \"" + o.protocol + "\"", "protocols: " + names);
  }
  console.answer = {{"id", file->name}, {"toml", file->text}};
  console.say(std::string(file->text.substr(0, file->text.find_last_not_of('\n') + 1)));
  return kDone;
}

Result<RigConfig> rigOf(const Options& o) {
  if (!o.rig.empty()) return readRigConfig(o.rig);
  return parseRigConfig(servedRigToml("virtual rig"), "virtual rig");
}

Json jsonOf(const ProtocolRun* run) {
  if (run == nullptr) return nullptr;
  return {{"sample_N_per_m", run->stiffness_N_per_m},
          {"duration_s", run->duration_s},
          {"captures", run->captures},
          {"highest_force_N", run->highest_force_N},
          {"longest_way_m", run->longest_way_m},
          {"fault", run->fault}};
}

std::string shown(const ProtocolRun& run) {
  char text[160];
  std::snprintf(text, sizeof text,
                "on springs of %.4g N/m: %.0f s, %lld captures, up to %.3g N and %.3g mm a cord",
                run.stiffness_N_per_m, run.duration_s, static_cast<long long>(run.captures),
                run.highest_force_N, 1e3 * run.longest_way_m);
  return text;
}

/// The rig's own machine carries it out on springs, the stiffest first.
std::vector<std::string> simulate(const CaptureProtocol& protocol, const RigConfig& rig,
                                  Console& console) {
  const ProtocolForecast forecast = forecastProtocol(protocol, rig);
  const ProtocolRun *stiffest = forecast.stiffest(), *softest = forecast.softest();
  console.answer["stiffest"] = jsonOf(stiffest);
  console.answer["softest"] = jsonOf(softest);
  if (stiffest != nullptr) {
    console.say(protocol.name + ", " + rig.name + ": ok, " + shown(*stiffest));
    if (softest != stiffest) console.say("  and " + shown(*softest));
    if (stiffest != &forecast.runs.front())
      console.say("  stiffer ones end in " + (stiffest - 1)->fault);
    if (softest != &forecast.runs.back())
      console.say("  softer ones end in " + (softest + 1)->fault);
    return {};
  }
  return {"on springs of " + std::to_string(forecast.runs.front().stiffness_N_per_m) +
              " N/m: " + forecast.runs.front().fault,
          "on springs of " + std::to_string(forecast.runs.back().stiffness_N_per_m) +
              " N/m: " + forecast.runs.back().fault};
}

Result<int> check(const Options& o, Console& console) {
  const auto protocol = readCaptureProtocol(o.protocol);
  if (!protocol) return protocol.error();
  const auto rig = rigOf(o);
  if (!rig) return rig.error();
  std::size_t steps = 0;
  double highest_N = 0.0;
  for (const ProtocolPhase& phase : protocol->phases) {
    steps += phase.steps.size() * static_cast<std::size_t>(phase.cycles);
    for (const ProtocolStep& step : phase.steps) highest_N = std::max(highest_N, step.force_N);
  }
  console.answer = {{"name", protocol->name},
                    {"phases", protocol->phases.size()},
                    {"steps", steps},
                    {"highest_force_N", highest_N},
                    {"rig", rig->name}};
  std::vector<std::string> problems;
  if (const auto fits = checkAgainstRig(*protocol, *rig); !fits)
    problems.push_back(fits.error().message());
  else
    problems = simulate(*protocol, *rig, console);
  console.answer["problems"] = problems;
  console.answer["ok"] = problems.empty();
  for (const std::string& problem : problems) console.warn(problem);
  return problems.empty() ? kDone : static_cast<int>(ErrorKind::kInterlock);
}

}  // namespace

Result<std::string> protocolText(const std::string& name) {
  if (const ShippedFile* file = findShippedFile(shippedProtocols(), name)) {
    return std::string(file->text);
  }
  const auto protocol = readCaptureProtocol(name);
  if (!protocol) return protocol.error();
  return protocol->text;
}

Verb protocolShow() {
  return {"show", "Print a shipped protocol",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareShow, show); }};
}

Verb protocolCheck() {
  return {"check",
          "Check a protocol: the rig's machine carries it out on springs, within its limits",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareCheck, check); }};
}

}  // namespace tenter::app
