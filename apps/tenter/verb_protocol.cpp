// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "protocol_files.h"
#include "tenter/twin/protocol.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {};

void declare(CLI::App& /*command*/, Options& /*options*/) {}

Result<int> list(const Options& /*options*/, Console& console) {
  auto& rows = console.answer["protocols"] = nlohmann::json::array();
  for (const ProtocolInfo& protocol : protocols()) {
    rows.push_back({{"id", protocol.id},
                    {"description", protocol.description},
                    {"for_fitting", protocol.for_fitting},
                    {"has_cords", protocol.has_cords},
                    {"default_frames", protocol.default_frames}});
    console.say(std::string(protocol.id));
  }
  return kDone;
}

}  // namespace

Verb protocolVerb() {
  static const std::array kRows = {
#ifdef TENTER_HARDWARE
      protocolShow(), protocolCheck(),
#endif
      Verb{"list", "Names of the capture protocols",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, list); }}};
  return {"protocol", "Capture protocols", [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
