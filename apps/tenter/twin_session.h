// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "camera_source.h"
#include "command.h"
#include "tenter/twin/mounted_specimen.h"

namespace tenter::app {

struct SessionCapture {
  MountOptions mount;
  std::string protocol_text;  ///< Empty: as shipped.
  bool tcp = true;
  CameraSourceOptions cameras;  ///< Their number is 0: no images.
  std::string output;           ///< Folder of the session.
  std::string truth;            ///< Folder for what hung there and how it pulled; empty: not kept.
};

/// Serves a virtual rig, starts the daemon on it, runs the mount's protocol into a session, and
/// ends both, however it goes.
Result<int> captureSession(const SessionCapture& capture, Console& console);

}  // namespace tenter::app
