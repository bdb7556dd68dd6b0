// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// One dead weight on one cell, and what the amplifier said.
struct DeadLoad {
  double force_N = 0.0;
  double reading_N = 0.0;
  double sigma_N = 0.0;  ///< Of the reading; 0: not known.
  std::optional<double> temperature_degC;
};

/// A cell as its dead weights have it: reading = offset + force / gain, by weighted least squares.
struct CellLine {
  std::string cell;
  double gain = 1.0;      ///< force = gain * (reading - offset).
  double offset_N = 0.0;  ///< What the amplifier says of nothing.
  double gain_sigma = 0.0, offset_sigma_N = 0.0, correlation = 0.0;
  double rms_N = 0.0;         ///< Residual of the readings, with n - 2 degrees of freedom.
  double largest_N = 0.0;     ///< The largest of them.
  double hysteresis_N = 0.0;  ///< Largest difference between readings of the same weight.
  std::vector<DeadLoad> loads;

  double force_N(double reading_N) const { return gain * (reading_N - offset_N); }
  /// Standard deviation of that force that comes from gain and offset.
  double sigma_N(double reading_N) const;
};

/// docs/formats/cell-calibration.md.
struct CellCalibration {
  std::string id;  ///< "cells-" and a hash of all the rest.
  std::string note;
  bool accepted = false;
  std::vector<std::string> reasons, warnings;
  std::vector<CellLine> cells;

  /// Nothing if there is none of that name.
  const CellLine* find(std::string_view cell) const;
};

struct CellCalibrationOptions {
  std::string note;
  double gravity_m_per_s2 = 9.80665;
  /// Largest RMS residual as a share of the largest weight; a single one may be three times that.
  double max_residual_share = 0.002;
};

/// What is known of one cell's weights before the fit.
struct CellLoads {
  std::string cell;
  std::vector<DeadLoad> loads;
};

/// Reads dead weights from a table with a line of names: `cell`, one of `mass_kg`, `mass_g`,
/// `force_N`, and `reading_N`; `sigma_N` and `temperature_degC` may be there. Errors name line and
/// column.
Result<std::vector<CellLoads>> readDeadLoads(const std::filesystem::path& file,
                                             double gravity_m_per_s2);

/// Fits and judges. Error: fewer than three different weights on a cell, readings that do not move.
Result<CellCalibration> calibrateCells(const std::vector<CellLoads>& cells,
                                       const CellCalibrationOptions& options);

inline constexpr std::string_view kCellCalibrationMarker = "tenter-cell-calibration";
Result<void> writeCellCalibration(const std::filesystem::path& file,
                                  const CellCalibration& calibration);
/// Error: fields that are wrong, or an id that is not that of the content.
Result<CellCalibration> readCellCalibration(const std::filesystem::path& file);

}  // namespace tenter
