// SPDX-License-Identifier: GPL-3.0-or-later
#include <dlfcn.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <exception>
#include <memory>

#include "command.h"
#include "interrupt.h"

namespace tenter::app {
namespace {

constexpr int kUsage = static_cast<int>(ErrorKind::kUsage);
constexpr int kInternal = 1;

/// A multithreaded BLAS inside small supernodes is slower than one thread; which BLAS is loaded is
/// known only at run time.
void useOneBlasThread() {
  using Setter = void (*)(int);
  if (void* setter = dlsym(RTLD_DEFAULT, "openblas_set_num_threads"); setter != nullptr) {
    reinterpret_cast<Setter>(setter)(1);
  }
}

void setUpLog(int verbosity) {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "tenter", std::make_shared<spdlog::sinks::stderr_sink_mt>()));
  spdlog::set_pattern("%T %l %v");
  spdlog::set_level(verbosity == 0   ? spdlog::level::warn
                    : verbosity == 1 ? spdlog::level::info
                                     : spdlog::level::debug);
}

int obey(const Action& action, Console& console) {
  int code = kInternal;
  try {
    const Result<int> result = action(console);
    if (result.ok()) {
      code = *result;
    } else {
      console.fail(result.error());
      code = static_cast<int>(result.error().kind);
    }
  } catch (const std::exception& error) {
    // Not the user's doing: the message is for the report of the bug.
    std::fprintf(stderr, "tenter: internal error: %s\n", error.what());
    return kInternal;
  }
  console.printAnswer();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    Console::complain("standard output: the answer cannot be written");
    return static_cast<int>(ErrorKind::kBadInput);
  }
  return code;
}

int run(int argc, char** argv) {
  CLI::App app{"Measures cloth, fits the materials of cloth simulation to it, and hands them on",
               "tenter"};
  Console console;
  Action action;
  app.fallthrough();  // so that the options below may follow the verb
  app.add_flag("--json", console.json, "Machine-readable answer on stdout");
  app.add_flag("-q,--quiet", console.quiet, "Nothing but errors and the answer");
  app.add_flag("-v,--verbose", console.verbosity, "Log on stderr; twice for more");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 2 usage, 3 bad input, 4 calibration rejected, 5 did not converge (the "
      "best so far is written), 6 hardware, 7 interlock or limit.");
  addSubcommands(app, verbs(), action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  setUpLog(console.verbosity);
  return obey(action, console);
}

}  // namespace
}  // namespace tenter::app

int main(int argc, char** argv) {
  tenter::app::useOneBlasThread();
  tenter::app::catchInterrupts();
  try {
    return tenter::app::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tenter: internal error: %s\n", error.what());
    return 1;
  }
}
