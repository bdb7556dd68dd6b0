// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <numbers>
#include <vector>

#include "command.h"
#include "tenter/fitting/import.h"

namespace tenter::app {

inline constexpr double kMetresPerMm = 1e-3;
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// What a person says of a specimen, in the units of the command line.
struct SpecimenOptions {
  SpecimenInfo info;
  double thickness_mm = 0.0;
  std::string output;

  SpecimenInfo inSi() const;
};
void declareSpecimen(CLI::App& command, SpecimenOptions& options);

/// Writes the folder and fills the answer with what all imports of measurements tell.
Result<int> finishMeasurement(const Measurement& measurement, const std::string& folder,
                              Console& console);

nlohmann::json flaggedToJson(const std::vector<FlaggedRow>& flagged);
/// One warning a row.
void warnFlagged(const std::vector<FlaggedRow>& flagged, const Console& console);

}  // namespace tenter::app
