// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "opencv_storage.h"
#include "tenter/calib/calibration_import.h"

namespace tenter {

Result<CameraCalibration> calibrationFromStorage(const Storage& storage, const std::string& file,
                                                 const CalibrationImportOptions& options);
Result<CameraCalibration> calibrationFromDice(const XmlElement& root, const std::string& file,
                                              const CalibrationImportOptions& options);

/// The nearest rotation to a matrix that is one to 1e-3, as files print them; nothing otherwise.
std::optional<Mat3> nearestRotation(const Mat3& matrix);
/// Warns of a distance between cameras that only a wrong unit explains.
void warnOfUnit(CameraCalibration& calibration);

}  // namespace tenter
