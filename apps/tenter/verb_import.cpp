// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "verbs.h"

namespace tenter::app {

Verb importVerb() {
  return {"import", "Data of other machines and programs", [](CLI::App& command, Action& action) {
            static const std::array kKinds = {tensileImport(), cantileverImport(), arcsimImport(),
                                              kesImport()};
            command.require_subcommand(1);
            addSubcommands(command, kKinds, action);
          }};
}

}  // namespace tenter::app
