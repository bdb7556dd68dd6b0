// SPDX-License-Identifier: GPL-3.0-or-later
#include "protocol_files.h"

#include "tenter/rig/protocol.h"
#include "tenter/rig/shipped_files.h"

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
  command.add_option("--rig", o.rig, "Configuration of a rig whose limits it must keep");
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

Result<int> check(const Options& o, Console& console) {
  const auto protocol = readCaptureProtocol(o.protocol);
  if (!protocol) return protocol.error();
  if (!o.rig.empty()) {
    const auto rig = readRigConfig(o.rig);
    if (!rig) return rig.error();
    if (auto fits = checkAgainstRig(*protocol, *rig); !fits) return fits.error();
  }
  std::size_t steps = 0;
  double highest_N = 0.0;
  for (const ProtocolPhase& phase : protocol->phases) {
    steps += phase.steps.size() * static_cast<std::size_t>(phase.cycles);
    for (const ProtocolStep& step : phase.steps) highest_N = std::max(highest_N, step.force_N);
  }
  console.answer = {
      {"name", protocol->name},       {"phases", protocol->phases.size()},     {"steps", steps},
      {"highest_force_N", highest_N}, {"checked_against_rig", !o.rig.empty()}, {"ok", true}};
  console.say(protocol->name + ": ok, " + std::to_string(protocol->phases.size()) + " phases, " +
              std::to_string(steps) + " steps with cycles");
  return kDone;
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
  return {"check", "Check a protocol, and whether a rig's limits allow it",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareCheck, check); }};
}

}  // namespace tenter::app
