// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "cord_calibration_json.h"
#include "tenter/calib/cord_calibration.h"

namespace tenter {
namespace {

constexpr double kMoved_m = 1e-4;
constexpr double kSure = 5.0;  // standard deviations that a friction must differ from nothing by

bool moved(const CordRecord& record) {
  const auto [least, most] =
      std::minmax_element(record.positions_m.begin(), record.positions_m.end());
  return !record.positions_m.empty() && *most - *least > kMoved_m;
}

double highestOf(const CordRecord& record) {
  double highest_N = 0.0;
  for (const double tension_N : record.tensions_N) {
    if (std::isfinite(tension_N)) highest_N = std::max(highest_N, tension_N);
  }
  return highest_N;
}

CordEntry& entryOf(CordCalibration& out, const CordRecord& record) {
  for (CordEntry& entry : out.cords) {
    if (entry.axis == record.axis) return entry;
  }
  out.cords.push_back({record.axis, record.cell, std::nullopt, std::nullopt});
  return out.cords.back();
}

void judgeResidual(const CordRecord& record, double rms_N, const char* what,
                   const CordCalibrationOptions& options, CordCalibration& out) {
  const double share = rms_N / highestOf(record);
  if (share <= options.max_residual_share) return;
  char text[160];
  std::snprintf(text, sizeof text,
                ": the %s fits to %.1f %% of the highest tension, %.1f %% allowed", what,
                100.0 * share, 100.0 * options.max_residual_share);
  out.reasons.push_back(record.axis + text);
}

}  // namespace

const CordEntry* CordCalibration::find(std::string_view axis) const {
  const auto found =
      std::find_if(cords.begin(), cords.end(), [&](const CordEntry& c) { return c.axis == axis; });
  return found == cords.end() ? nullptr : &*found;
}

Result<CordCalibration> calibrateCords(const std::vector<CordRecord>& on_springs,
                                       const std::vector<CordRecord>& held,
                                       const CordCalibrationOptions& options) {
  CordCalibration out;
  out.note = options.note;
  for (const CordRecord& record : on_springs) {
    if (!moved(record)) continue;
    const auto fit = fitCordFriction(record);
    if (!fit) {
      out.reasons.push_back(fit.error().message());
      continue;
    }
    judgeResidual(record, fit->rms_N, "friction", options, out);
    if (fit->friction_N < -kSure * fit->friction_sigma_N) {
      out.reasons.push_back(record.axis +
                            ": reads less while it is drawn in; is it the right cell?");
    } else if (fit->friction_N < kSure * fit->friction_sigma_N) {
      out.warnings.push_back(record.axis + ": no friction shows");
    }
    entryOf(out, record).friction = *fit;
  }
  for (const CordRecord& record : held) {
    if (!moved(record)) continue;
    const auto fit = fitCordStretch(record);
    if (!fit) {
      out.reasons.push_back(fit.error().message());
      continue;
    }
    judgeResidual(record, fit->rms_N, "stretch", options, out);
    entryOf(out, record).stretch = *fit;
  }
  if (out.cords.empty() && out.reasons.empty()) {
    return badInput("", "", "no cord was moved in the record", "");
  }
  out.accepted = out.reasons.empty();
  out.id = idOf(out);
  return out;
}

}  // namespace tenter
