// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter::app {

inline constexpr int kDone = 0;

/// How a command talks: options that every verb has, and the two streams.
class Console {
 public:
  bool json = false, quiet = false;
  int verbosity = 0;

  /// The machine's answer, printed as one document when the command ends.
  nlohmann::json answer = nlohmann::json::object();

  /// One line for a person on stdout; nothing with --json or --quiet.
  void say(const std::string& line) const;
  /// One line on stderr, unless --quiet.
  void warn(const std::string& line) const;
  /// One line on stderr, --quiet or not: why the exit code is not 0.
  static void complain(const std::string& line);
  /// An error on stderr, and in the answer with --json.
  void fail(const Error& error);
  void printAnswer() const;
};

/// "1 frame", "2 frames".
std::string counted(std::size_t count, const std::string& thing);

/// What a verb does once its options are read: an exit code, or the error that has one.
using Action = std::function<Result<int>(Console&)>;

/// A row of the table of verbs, or of the kinds below a verb.
struct Verb {
  std::string_view name, summary;
  /// Adds the options, and a callback that puts what is to be done into `action`.
  void (*setUp)(CLI::App& command, Action& action);
};

/// All verbs of the command line. To add one: its file, and one line in verbs.cpp.
std::span<const Verb> verbs();

/// Adds each row as a subcommand of `command`.
void addSubcommands(CLI::App& command, std::span<const Verb> rows, Action& action);

/// Sets up a command whose options live in an `Options`: `declare` adds them, `run` obeys.
template <class Options>
void setUpCommand(CLI::App& command, Action& action, void (*declare)(CLI::App&, Options&),
                  Result<int> (*run)(const Options&, Console&)) {
  auto options = std::make_shared<Options>();
  declare(command, *options);
  command.callback([options, run, &action] {
    action = [options, run](Console& console) { return run(*options, console); };
  });
}

}  // namespace tenter::app
