// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>

#include "import_specimen.h"
#include "import_table.h"
#include "tenter/fitting/import.h"

namespace tenter {

namespace {

using import::checkRange;
using import::shown;

constexpr double kMax_mm = 2000.0;

struct Tip {
  double reach_m, drop_m;
};

Result<void> checkSetup(const CantileverImportOptions& o) {
  if (auto ok = import::checkSpecimen(o.info); !ok) return ok;
  if (auto ok = checkRange("--length-mm", 1e3 * o.length_m, 5.0, kMax_mm, "mm"); !ok) return ok;
  if (auto ok = checkRange("--width-mm", 1e3 * o.width_m, 0.1, kMax_mm, "mm"); !ok) return ok;
  const double angle_deg = o.angle_rad * 180.0 / std::numbers::pi;
  if (auto ok = checkRange("--angle-deg", angle_deg, -180.0, 180.0, "degrees"); !ok) return ok;
  return checkRange("--tip-sigma-mm", 1e3 * o.tip_sigma_m, 0.0, 1e3 * o.length_m, "mm");
}

/// A tip that an inextensible strip clamped horizontally can have.
Result<void> checkTip(const Tip& tip, double length_m, const std::string& file,
                      const std::string& place) {
  const std::string numbers =
      "reach " + shown(1e3 * tip.reach_m) + " mm and drop " + shown(1e3 * tip.drop_m) + " mm";
  if (!std::isfinite(tip.reach_m) || !std::isfinite(tip.drop_m)) {
    return badInput(file, place, numbers + " are not finite");
  }
  if (tip.reach_m < 0.0 || tip.drop_m < 0.0) {
    return badInput(file, place, numbers + ": neither can be negative",
                    "reach is horizontal, drop downward, both from the clamp");
  }
  const double chord_m = std::hypot(tip.reach_m, tip.drop_m);
  if (chord_m > length_m) {
    return badInput(file, place,
                    numbers + " put the tip " + shown(1e3 * chord_m) +
                        " mm from the clamp, farther than the strip of " + shown(1e3 * length_m) +
                        " mm is long",
                    "measure again, or check the length");
  }
  return {};
}

Result<Measurement> measurementOfTips(const std::vector<Tip>& tips,
                                      const CantileverImportOptions& options) {
  Measurement measurement = import::measurementOf(options.info, "cantilever");
  measurement.sample_size_m = Vec2(options.length_m, options.width_m);
  measurement.cantilever = CantileverSetup{options.length_m, options.width_m, options.angle_rad};
  for (std::size_t i = 0; i < tips.size(); ++i) {
    MeasurementFrame frame;
    frame.time_ns = static_cast<std::int64_t>(i) * 1'000'000'000;
    frame.reach_m = tips[i].reach_m;
    frame.drop_m = tips[i].drop_m;
    frame.tip_sigma_m = options.tip_sigma_m;
    measurement.frames.push_back(frame);
  }
  if (auto ok = validateMeasurement(measurement); !ok) return ok.error();
  return measurement;
}

}  // namespace

Result<Measurement> importCantilever(double reach_m, double drop_m,
                                     const CantileverImportOptions& options) {
  if (auto ok = checkSetup(options); !ok) return ok.error();
  const Tip tip{reach_m, drop_m};
  if (auto ok = checkTip(tip, options.length_m, "", "--reach-mm, --drop-mm"); !ok) {
    return ok.error();
  }
  return measurementOfTips({tip}, options);
}

Result<Measurement> importCantilever(const std::filesystem::path& csv,
                                     const CantileverImportOptions& options) {
  if (auto ok = checkSetup(options); !ok) return ok.error();
  const auto table = import::readNumberedTable(csv, 2);
  if (!table) return table.error();
  std::vector<Tip> tips;
  for (Eigen::Index row = 0; row < table->values.rows(); ++row) {
    tips.push_back({1e-3 * table->values(row, 0), 1e-3 * table->values(row, 1)});
    const auto ok = checkTip(tips.back(), options.length_m, table->file, table->place(row));
    if (!ok) return ok.error();
  }
  return measurementOfTips(tips, options);
}

}  // namespace tenter
