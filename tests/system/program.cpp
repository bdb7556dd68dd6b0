// SPDX-License-Identifier: GPL-3.0-or-later
#include "program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {

namespace {

/// In the child: streams to files, then the program. Never returns.
[[noreturn]] void become(const std::vector<std::string>& arguments,
                         const std::filesystem::path& folder, const std::filesystem::path& out,
                         const std::filesystem::path& err) {
  const int out_fd = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int err_fd = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int in_fd = open("/dev/null", O_RDONLY);
  const bool ready = out_fd >= 0 && err_fd >= 0 && in_fd >= 0 && dup2(out_fd, 1) >= 0 &&
                     dup2(err_fd, 2) >= 0 && dup2(in_fd, 0) >= 0 && chdir(folder.c_str()) == 0;
  if (!ready) _exit(126);
  std::vector<char*> argv;
  std::string program = TENTER_PROGRAM;
  argv.push_back(program.data());
  std::vector<std::string> copies = arguments;
  for (std::string& copy : copies) argv.push_back(copy.data());
  argv.push_back(nullptr);
  execv(TENTER_PROGRAM, argv.data());
  _exit(127);
}

}  // namespace

Outcome tenter(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
               double interrupt_after_s) {
  const test_support::TemporaryFolder streams;
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) become(arguments, folder, streams / "out", streams / "err");
  if (interrupt_after_s > 0.0) {
    std::this_thread::sleep_for(std::chrono::duration<double>(interrupt_after_s));
    kill(child, SIGINT);
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) throw std::runtime_error("cannot wait");
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.out = test_support::slurp(streams / "out");
  outcome.err = test_support::slurp(streams / "err");
  return outcome;
}

}  // namespace tenter::system_test
