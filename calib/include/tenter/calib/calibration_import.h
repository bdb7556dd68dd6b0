// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "tenter/calib/camera_calibration.h"

namespace tenter {

struct CalibrationImportOptions {
  double unit_m = 1e-3;  ///< Length that translations in the file are counted in.
  /// Width and height of the images, for files that do not tell.
  std::optional<std::pair<int, int>> size_px;
};

/// Reads the calibration of another program: an OpenCV FileStorage (YAML, XML or JSON) or a DICe
/// camera system (XML); which one is told from the content (docs/calibration.md). Several files are
/// read as one, such as OpenCV's intrinsics.yml and extrinsics.yml. XML with entities of its own is
/// refused, so are files above 16 MiB. Error names file and field.
Result<CameraCalibration> importCalibration(const std::vector<std::filesystem::path>& files,
                                            const CalibrationImportOptions& options);

/// The same of texts and the names of their files.
Result<CameraCalibration> importCalibrationTexts(
    const std::vector<std::pair<std::string, std::string>>& names_and_texts,
    const CalibrationImportOptions& options);

}  // namespace tenter
