// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "command.h"
#include "tenter/core/measurement.h"
#include "tenter/twin/protocol.h"

namespace tenter::app {

/// How the demo's cameras see the virtual rig.
struct DemoCameras {
  std::string fabric;
  std::uint64_t seed = 7;
  int nodes = 31, frames = 18;
  int width_px = 1936, boards = 20, subset_px = 31;
  int threads = 2;
  std::filesystem::path folder;  ///< Gets one folder a protocol.
};

/// A measurement that was seen, and a sentence on how well.
struct SeenTest {
  Measurement measurement;
  std::string summary;
};

/// Calibrates a protocol's virtual cameras from rendered images of a board, renders a session that
/// carries this calibration, and reconstructs it, with its page on quality. Errors: those of the
/// steps; kNotConverged when interrupted.
Result<SeenTest> measureByImages(const DemoCameras& demo, const ProtocolInfo& protocol,
                                 Console& console);

/// One cycle of stretch-weft through tenterd: actuators on USB, cells on Modbus TCP, cameras by
/// GigE Vision; then reconstructed. Error, of kind kHardware, also where the program was built
/// without devices.
Result<SeenTest> measureThroughDaemon(const DemoCameras& demo, Console& console);

}  // namespace tenter::app
