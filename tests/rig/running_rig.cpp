// SPDX-License-Identifier: GPL-3.0-or-later
#include "running_rig.h"

#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tenter/core/files.h"

namespace tenter::rig_system_test {
namespace {

template <class T>
T valueOf(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return *std::move(result);
}

}  // namespace

RunningRig::RunningRig(bool tcp, const MountOptions& mount,
                       std::optional<VirtualCamerasOptions> cameras) {
  ServedRigOptions options;
  options.mount = mount;
  options.state = folder_.path();
  options.tcp = tcp;
  options.cameras = std::move(cameras);
  rig_ = valueOf(ServedRig::start(options));
  startDaemon("");
}

std::string RunningRig::log() const { return path("daemon-" + std::to_string(starts_) + ".log"); }

void RunningRig::restartDaemon(const std::string& preload) {
  kill(daemon_, SIGKILL);
  wait(daemon_);
  std::filesystem::remove(socket());
  startDaemon(preload);
}

void RunningRig::startDaemon(const std::string& preload) {
  ++starts_;
  std::vector<std::string> command{TENTER_DAEMON, "--config", rig_->configFile().string(),
                                   "--socket", socket()};
  const std::string variable = "LD_PRELOAD=";
  for (const std::string& setting : rig_->usb().environment()) {
    if (preload.empty() || !setting.starts_with(variable)) continue;
    const std::string libraries = variable + preload + ":" + setting.substr(variable.size());
    command.insert(command.begin(), {"/usr/bin/env", libraries});
  }
  daemon_ = valueOf(rig_->usb().spawn(command, log()));
  if (!waitFor(10.0, [&] { return std::filesystem::is_socket(socket()); })) {
    throw std::runtime_error("no socket");
  }
}

int RunningRig::endDaemon(int signal) {
  kill(daemon_, signal);
  return wait(std::exchange(daemon_, 0));
}

RunningRig::~RunningRig() {
  if (daemon_ > 0) endDaemon(SIGKILL);
}

pid_t RunningRig::startTenterRig(const std::vector<std::string>& arguments) {
  std::vector<std::string> all{TENTER_PROGRAM, "rig", "--socket", socket()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return valueOf(rig_->usb().spawn(all, path("out")));
}

int RunningRig::wait(pid_t child) {
  int status = 0;
  if (waitpid(child, &status, 0) != child) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

int RunningRig::tenterRig(const std::vector<std::string>& arguments) {
  return wait(startTenterRig(arguments));
}

nlohmann::json RunningRig::status() {
  if (tenterRig({"status", "--json"}) != 0) throw std::runtime_error("no status");
  return nlohmann::json::parse(valueOf(readFile(path("out"))));
}

std::string RunningRig::write(const std::string& name, const std::string& text) {
  if (auto done = writeFileAtomically(path(name), text); !done) {
    throw std::runtime_error(done.error().message());
  }
  return path(name);
}

bool waitFor(double limit_s, const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  return condition();
}

}  // namespace tenter::rig_system_test
