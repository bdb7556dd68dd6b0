// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <set>

#include "cell_calibration_json.h"
#include "tenter/calib/cell_calibration.h"

namespace tenter {
namespace {

constexpr std::size_t kLeastWeights = 3;
constexpr double kLargestShare = 3.0;                // a single residual against the RMS allowed
constexpr double kLeastGain = 0.5, kMostGain = 2.0;  // beyond, the amplifier is set up wrongly
constexpr double kSpread_degC = 5.0;
constexpr double kSameForce_N = 1e-6;

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f %%", 100.0 * share);
  return text;
}

double spanOf(const CellLine& line) {
  double least = 1e300, most = -1e300;
  for (const DeadLoad& load : line.loads) {
    least = std::min(least, load.force_N);
    most = std::max(most, load.force_N);
  }
  return most - least;
}

double hysteresisOf(const std::vector<DeadLoad>& loads) {
  double largest_N = 0.0;
  for (const DeadLoad& a : loads) {
    for (const DeadLoad& b : loads) {
      if (std::abs(a.force_N - b.force_N) > kSameForce_N) continue;
      largest_N = std::max(largest_N, a.reading_N - b.reading_N);
    }
  }
  return largest_N;
}

/// Sums of the normal equations of reading = a + s * force.
struct Normal {
  double w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  double determinant() const { return w * xx - x * x; }
};

Result<CellLine> fit(const CellLoads& cell) {
  const Error too_few = badInput("", cell.cell, "has fewer than three different weights",
                                 "hang on at least three, nothing at all among them");
  std::set<double> different;
  for (const DeadLoad& load : cell.loads) different.insert(load.force_N);
  if (different.size() < kLeastWeights) return too_few;
  const bool weighted = std::all_of(cell.loads.begin(), cell.loads.end(),
                                    [](const DeadLoad& load) { return load.sigma_N > 0.0; });
  Normal n;
  for (const DeadLoad& load : cell.loads) {
    const double weight = weighted ? 1.0 / (load.sigma_N * load.sigma_N) : 1.0;
    n.w += weight;
    n.x += weight * load.force_N;
    n.y += weight * load.reading_N;
    n.xx += weight * load.force_N * load.force_N;
    n.xy += weight * load.force_N * load.reading_N;
  }
  const double slope = (n.w * n.xy - n.x * n.y) / n.determinant();
  const double offset_N = (n.xx * n.y - n.x * n.xy) / n.determinant();
  if (!(std::abs(slope) > 1e-6)) {
    return badInput("", cell.cell, "its readings do not move with the weights", "");
  }
  CellLine line;
  line.cell = cell.cell;
  line.loads = cell.loads;
  line.gain = 1.0 / slope;
  line.offset_N = offset_N;
  double squares = 0.0, chi_squared = 0.0;
  for (const DeadLoad& load : cell.loads) {
    const double residual_N = load.reading_N - offset_N - slope * load.force_N;
    squares += residual_N * residual_N;
    if (weighted) chi_squared += residual_N * residual_N / (load.sigma_N * load.sigma_N);
    line.largest_N = std::max(line.largest_N, std::abs(residual_N));
  }
  const auto freedom = static_cast<double>(cell.loads.size() - 2);
  line.rms_N = std::sqrt(squares / freedom);
  line.hysteresis_N = hysteresisOf(cell.loads);
  // What is stated of the readings counts, unless they scatter more than that.
  const double variance = weighted ? std::max(1.0, chi_squared / freedom) : squares / freedom;
  const double slope_sigma = std::sqrt(variance * n.w / n.determinant());
  line.offset_sigma_N = std::sqrt(variance * n.xx / n.determinant());
  line.gain_sigma = slope_sigma * line.gain * line.gain;
  // gain = 1 / slope turns the sign round.
  line.correlation = n.x / std::sqrt(n.w * n.xx);
  return line;
}

void judge(const CellLine& line, const CellCalibrationOptions& options, CellCalibration& out) {
  const double span_N = spanOf(line), allowed_N = options.max_residual_share * span_N;
  if (line.rms_N > allowed_N || line.largest_N > kLargestShare * allowed_N) {
    out.reasons.push_back(line.cell + ": readings lie " + percent(line.rms_N / span_N) +
                          " of the largest weight off the line (largest " +
                          percent(line.largest_N / span_N) + "), " +
                          percent(options.max_residual_share) + " allowed");
  }
  if (line.gain < kLeastGain || line.gain > kMostGain) {
    out.reasons.push_back(line.cell + ": a gain of " + std::to_string(line.gain) +
                          " says that the amplifier is set up for another cell or unit");
  }
  std::set<double> temperatures;
  for (const DeadLoad& load : line.loads) {
    if (load.temperature_degC) temperatures.insert(*load.temperature_degC);
  }
  if (temperatures.empty()) {
    out.warnings.push_back(line.cell + ": the temperature was not noted");
  } else if (*temperatures.rbegin() - *temperatures.begin() > kSpread_degC) {
    out.warnings.push_back(line.cell + ": the temperature moved by more than 5 degrees meanwhile");
  }
}

}  // namespace

double CellLine::sigma_N(double reading_N) const {
  const double by_gain = gain_sigma * (reading_N - offset_N), by_offset = gain * offset_sigma_N;
  return std::sqrt(std::max(
      0.0, by_gain * by_gain + by_offset * by_offset - 2.0 * correlation * by_gain * by_offset));
}

const CellLine* CellCalibration::find(std::string_view cell) const {
  const auto found =
      std::find_if(cells.begin(), cells.end(), [&](const CellLine& c) { return c.cell == cell; });
  return found == cells.end() ? nullptr : &*found;
}

Result<CellCalibration> calibrateCells(const std::vector<CellLoads>& cells,
                                       const CellCalibrationOptions& options) {
  if (cells.empty()) return badInput("", "", "there are no weights", "");
  CellCalibration out;
  out.note = options.note;
  for (const CellLoads& cell : cells) {
    auto line = fit(cell);
    if (!line) return line.error();
    judge(*line, options, out);
    out.cells.push_back(*std::move(line));
  }
  out.accepted = out.reasons.empty();
  out.id = idOf(out);
  return out;
}

}  // namespace tenter
