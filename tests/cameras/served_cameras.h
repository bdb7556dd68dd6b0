// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "tenter/acquisition/camera_config.h"

namespace tenter::test {

/// Virtual cameras with test patterns in a process of their own, as on a machine of their own.
class ServedCameras {
 public:
  ServedCameras(int count, int width_px, int height_px);
  ~ServedCameras();
  ServedCameras(const ServedCameras&) = delete;
  ServedCameras& operator=(const ServedCameras&) = delete;

  /// As written by the twin, for this machine.
  CameraSection section() const;
  std::string address(std::size_t camera) const { return section().cameras.at(camera).address; }
  /// "lose 0 0.01", "unplug 1", "replug 1", "freeze 2 1", "overexpose 0 1", "defocus 3 2.0",
  /// "exchange 0 1"; returns when it is done.
  void tell(const std::string& order);

 private:
  std::string readLine();

  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  std::string configuration_;
};

/// The process' other half, for main().
int serveCameras(int count, int width_px, int height_px);

}  // namespace tenter::test
