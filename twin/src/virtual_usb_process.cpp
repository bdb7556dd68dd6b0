// SPDX-License-Identifier: GPL-3.0-or-later
// Other programs on the virtual bus, and this one.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "tenter/twin/virtual_usb.h"

namespace tenter {
namespace {

constexpr const char* kPreloadVariable = "LD_PRELOAD";
constexpr const char* kBusVariable = "UMOCKDEV_DIR";
constexpr const char* kLibrary = "libumockdev-preload.so.0";

// A sanitizer insists on being the first library of a program.
#if defined(__SANITIZE_ADDRESS__)
constexpr const char* kFirst = "libasan.so.8:";
#elif defined(__SANITIZE_THREAD__)
constexpr const char* kFirst = "libtsan.so.2:";
#else
constexpr const char* kFirst = "";
#endif

std::string valueOf(const char* variable) {
  const char* value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

Error cannotStart(const std::string& program, int code) {
  return {ErrorKind::kHardware, program, "",
          std::string("it does not start: ") + std::strerror(code), ""};
}

}  // namespace

Result<void> VirtualUsb::preload(char** arguments) {
  const std::string before = valueOf(kPreloadVariable);
  if (before.find(kLibrary) != std::string::npos) return {};
  const std::string value = kFirst + std::string(kLibrary) + (before.empty() ? "" : ":" + before);
  setenv(kPreloadVariable, value.c_str(), 1);
  execv("/proc/self/exe", arguments);
  return cannotStart("/proc/self/exe", errno);
}

std::vector<std::string> VirtualUsb::environment() const {
  return {std::string(kBusVariable) + "=" + valueOf(kBusVariable),
          std::string(kPreloadVariable) + "=" + kLibrary};
}

Result<pid_t> VirtualUsb::spawn(const std::vector<std::string>& arguments,
                                const std::filesystem::path& output) const {
  require(!arguments.empty(), "a program to start has a name");
  std::vector<std::string> copies = arguments;
  std::vector<char*> raw;
  raw.reserve(copies.size() + 1);
  for (std::string& copy : copies) raw.push_back(copy.data());
  raw.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  if (!output.empty()) {
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0600);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  }
  pid_t child = 0;
  // The environment is this program's own, which already holds both variables.
  const int code = posix_spawnp(&child, raw.front(), &files, nullptr, raw.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (code != 0) return cannotStart(arguments.front(), code);
  return child;
}

Result<int> VirtualUsb::run(const std::vector<std::string>& arguments,
                            const std::filesystem::path& output) const {
  const Result<pid_t> child = spawn(arguments, output);
  if (!child) return child.error();
  int status = 0;
  while (waitpid(*child, &status, 0) < 0) {
    if (errno != EINTR) return cannotStart(arguments.front(), errno);
  }
  constexpr int kBySignal = 128;  // as a shell says it
  return WIFEXITED(status) ? WEXITSTATUS(status) : kBySignal + WTERMSIG(status);
}

}  // namespace tenter
