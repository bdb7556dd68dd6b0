// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tenter/test_support/temporary_folder.h"
#include "tenter/twin/served_rig.h"

namespace tenter::rig_system_test {

/// A virtual rig, and the shipped daemon running on it. Throws what goes wrong.
class RunningRig {
 public:
  explicit RunningRig(bool tcp = true, const MountOptions& mount = {},
                      std::optional<VirtualCamerasOptions> cameras = {});
  ~RunningRig();
  RunningRig(const RunningRig&) = delete;
  RunningRig& operator=(const RunningRig&) = delete;

  ServedRig& rig() { return *rig_; }
  pid_t daemon() const { return daemon_; }
  /// Kills the daemon, if it still runs, and starts another one with a log of its own, and with a
  /// library before all others if one is named.
  void restartDaemon(const std::string& preload = "");
  /// Sends it that, and waits until it has ended; its exit code.
  int endDaemon(int signal);
  std::string log() const;  ///< The path of the daemon's log.
  std::string path(const std::string& name) const { return folder_ / name; }
  std::string socket() const { return folder_ / "tenterd.sock"; }

  /// Exit code of `tenter rig --socket ...`; what it says goes to path("out").
  int tenterRig(const std::vector<std::string>& arguments);
  /// Starts it and goes on; wait(pid) gives its exit code.
  pid_t startTenterRig(const std::vector<std::string>& arguments);
  static int wait(pid_t child);
  nlohmann::json status();
  std::string write(const std::string& name, const std::string& text);

 private:
  void startDaemon(const std::string& preload);

  test_support::TemporaryFolder folder_;
  std::unique_ptr<ServedRig> rig_;
  pid_t daemon_ = -1;
  int starts_ = 0;
};

/// Polls every half millisecond; false after the limit.
bool waitFor(double limit_s, const std::function<bool()>& condition);

}  // namespace tenter::rig_system_test
