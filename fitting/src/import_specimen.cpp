// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_specimen.h"

#include "import_table.h"

namespace tenter::import {

namespace {

constexpr double kMinDensity_kg_per_m2 = 0.005;
constexpr double kMaxDensity_kg_per_m2 = 5.0;
constexpr double kMaxThickness_m = 0.05;

}  // namespace

Result<void> checkSpecimen(const SpecimenInfo& info) {
  auto ok = checkRange("--areal-density-kg-m2", info.areal_density_kg_per_m2, kMinDensity_kg_per_m2,
                       kMaxDensity_kg_per_m2, "kg/m^2");
  if (!ok) return ok;
  return checkRange("--thickness-mm", 1e3 * info.thickness_m, 0.0, 1e3 * kMaxThickness_m, "mm");
}

Measurement measurementOf(const SpecimenInfo& info, const std::string& protocol) {
  Measurement measurement;
  measurement.fabric = info.fabric.empty() ? "unnamed" : info.fabric;
  measurement.specimen = info.specimen.empty() ? "1" : info.specimen;
  measurement.protocol = protocol;
  measurement.areal_density_kg_per_m2 = info.areal_density_kg_per_m2;
  measurement.thickness_m = info.thickness_m;
  return measurement;
}

}  // namespace tenter::import
