// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tenter/calib/cord_calibration.h"
#include "tenter/twin/mounted_specimen.h"

namespace tenter {

/// One cell of a session against the cord that truly hung on it.
struct CordAgreement {
  std::string axis, cord;  ///< "axis-1", "near/a"; no cord: empty.
  std::uint64_t samples = 0;
  double rms_N = 0.0;            ///< Measured less friction, against the truth.
  double rms_by_travel_N = 0.0;  ///< With friction by the travel of the cord's own actuator alone.
  std::optional<double> rms_by_cords_N;  ///< With friction by the calibration of the cords.
  double bias_N = 0.0, largest_N = 0.0;
  double highest_N = 0.0, way_m = 0.0;  ///< Of the truth: its highest tension; of the actuator.
};

/// One sample of one cord.
struct TruthRow {
  double time_s = 0.0;
  int axis = 0;
  double position_m = 0.0, measured_N = 0.0, friction_N = 0.0, truth_N = 0.0;
};

struct SessionTruth {
  std::vector<CordAgreement> cords;
  double rms_N = 0.0, rms_by_travel_N = 0.0;  ///< Over all samples of all cords.
  std::optional<double> rms_by_cords_N;       ///< The same, with a calibration.
  std::vector<TruthRow> rows;
  int solves = 0;
};

struct SessionTruthOptions {
  std::filesystem::path session;
  MountOptions mount;                    ///< As the session's rig was served.
  std::optional<CordCalibration> cords;  ///< To take friction off by, once more.
  std::function<bool()> cancelled;       ///< Polled often. May be empty.
  std::function<void(double)> progress;  ///< Seconds of the session done. May be empty.
};

/// Moves the specimen along the actuator positions that a session of the served rig recorded, by
/// itself and in no hurry, and compares what its cords pull with what the cells said. The session
/// must be the first since the sample was hung: cloth remembers. Friction of the pulleys is that of
/// the truth's cord lengths, and once more that of the actuators' travel alone, as it is taken off
/// without knowing the truth, and by measured things alone with a calibration of the cords; it
/// begins as homing leaves it, let out. Errors: no such session, axes that are not those of a
/// served rig, kNotConverged.
Result<SessionTruth> truthOfSession(const SessionTruthOptions& options);

}  // namespace tenter
