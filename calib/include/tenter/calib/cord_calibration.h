// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// What one cord did in a record: as many positions of its axis as readings of its cell.
struct CordRecord {
  std::string axis, cell;
  std::vector<double> positions_m;  ///< Grow as the axis draws the cord in.
  std::vector<double> tensions_N;   ///< As the cell reads them; NaN: no reading.
};

/// Pulley friction of one cord: the cell behind the pulley reads `friction_N` more while the cord
/// is drawn in over it, as much less while it is let out; after a reversal it takes `presliding_m`
/// of cord to turn from one to the other.
struct CordFrictionFit {
  double friction_N = 0.0, friction_sigma_N = 0.0;
  double presliding_m = 0.0;
  double spring_N_per_m = 0.0;  ///< Of what the cord pulled meanwhile.
  double rms_N = 0.0;           ///< Residual.
  int samples = 0;
};

/// How the cord itself gives way while its end is held:
///   tension = constant + stiffness * (x - at) + curvature / 2 * (x - at)^2.
struct CordStretchFit {
  double stiffness_N_per_m = 0.0, stiffness_sigma_N_per_m = 0.0;
  double curvature_N_per_m2 = 0.0;
  double at_m = 0.0;  ///< Position that the stiffness holds for.
  double rms_N = 0.0;
  int samples = 0;

  double stiffnessAt(double position_m) const {
    return stiffness_N_per_m + curvature_N_per_m2 * (position_m - at_m);
  }
};

/// One cord; what no record showed is absent.
struct CordEntry {
  std::string axis, cell;
  std::optional<CordFrictionFit> friction;
  std::optional<CordStretchFit> stretch;
};

/// docs/formats/cord-calibration.md.
struct CordCalibration {
  std::string id;  ///< "cords-" and a hash of all the rest.
  std::string note;
  bool accepted = false;
  std::vector<std::string> reasons, warnings;
  std::vector<CordEntry> cords;

  /// Nothing if there is none of that axis.
  const CordEntry* find(std::string_view axis) const;
};

/// Load and unload a spring: what the two ways differ by is twice the friction. Error: the record
/// does not go both ways, or the cord does not pull.
Result<CordFrictionFit> fitCordFriction(const CordRecord& record);
/// Draws in a cord whose end is held. Error: too few readings, or the cord does not pull.
Result<CordStretchFit> fitCordStretch(const CordRecord& record);

struct CordCalibrationOptions {
  std::string note;
  /// Largest RMS residual of a fit, as a share of the cord's highest tension.
  double max_residual_share = 0.02;
};

/// Cords that were moved in either record; those that stood still are left out. Error: no cord
/// moved at all. A cord whose fit fails is a reason for rejection.
Result<CordCalibration> calibrateCords(const std::vector<CordRecord>& on_springs,
                                       const std::vector<CordRecord>& held,
                                       const CordCalibrationOptions& options);

inline constexpr std::string_view kCordCalibrationMarker = "tenter-cord-calibration";
Result<void> writeCordCalibration(const std::filesystem::path& file,
                                  const CordCalibration& calibration);
/// Error: fields that are wrong, or an id that is not that of the content.
Result<CordCalibration> readCordCalibration(const std::filesystem::path& file);

}  // namespace tenter
