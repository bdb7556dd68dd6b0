// SPDX-License-Identifier: GPL-3.0-or-later
#include "command.h"

#include <cctype>
#include <cstdio>

namespace tenter::app {

void Console::say(const std::string& line) const {
  if (!json && !quiet) std::fprintf(stdout, "%s\n", line.c_str());
}

void Console::warn(const std::string& line) const {
  if (!quiet) complain(line);
}

void Console::complain(const std::string& line) {
  // Messages quote what files hold: a control character would cut them off or steer the terminal.
  std::string shown = line;
  for (char& c : shown)
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
  std::fprintf(stderr, "tenter: %s\n", shown.c_str());
}

void Console::fail(const Error& error) {
  complain(error.message());
  answer["error"] = {{"exit_code", static_cast<int>(error.kind)},
                     {"file", error.file},
                     {"place", error.place},
                     {"reason", error.reason},
                     {"advice", error.advice}};
}

void Console::printAnswer() const {
  if (!json) return;
  // File names need not be UTF-8.
  const auto replace = nlohmann::json::error_handler_t::replace;
  std::fprintf(stdout, "%s\n", answer.dump(2, ' ', false, replace).c_str());
}

std::string counted(std::size_t count, const std::string& thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

void addSubcommands(CLI::App& command, std::span<const Verb> rows, Action& action) {
  for (const Verb& row : rows) {
    row.setUp(*command.add_subcommand(std::string(row.name), std::string(row.summary)), action);
  }
}

}  // namespace tenter::app
