// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/mechanics/material.h"

namespace tenter {

// Data of other machines and programs (docs/imports.md). One source file a kind. Every error names
// the file, the line or field, and the reason; nothing that cannot be true is taken over.

/// What a person says of a specimen that the file does not.
struct SpecimenInfo {
  std::string fabric, specimen;
  double areal_density_kg_per_m2 = 0.0;
  double thickness_m = 0.0;  ///< 0 if not known.
};

/// Where strain zero lies in a file that starts under force.
enum class ZeroStrainRule {
  kExtrapolate,  ///< At zero force, by the slope of the first rows.
  kFirstRow,     ///< At the first row: its force is taken for a pretension that does not strain.
  kGiven,        ///< The strip was stretched by a stated length at displacement 0.
};
/// extrapolate | first-row | given.
Result<ZeroStrainRule> parseZeroStrainRule(const std::string& name);

struct TensileImportOptions {
  SpecimenInfo info;
  double length_m = 0.0;  ///< Between clamps at displacement 0 of the file.
  double width_m = 0.0;   ///< Of one strip.
  int strips = 1;
  double angle_rad = 0.0;  ///< From weft to the pulling direction.
  ZeroStrainRule zero_strain = ZeroStrainRule::kExtrapolate;
  double zero_offset_m = 0.0;  ///< Used by kGiven only.
  double force_sigma_N = 0.0;  ///< 0: not known.
};
/// Rows of displacement [mm] and total force [N]; loading, or cycles of loading and unloading.
Result<Measurement> importTensile(const std::filesystem::path& csv,
                                  const TensileImportOptions& options);

struct CantileverImportOptions {
  SpecimenInfo info;
  double length_m = 0.0;
  double width_m = 0.025;    ///< The shape does not depend on it.
  double angle_rad = 0.0;    ///< From weft to the strip's length.
  double tip_sigma_m = 0.0;  ///< 0: not known.
};
/// Tip of one strip that hangs under its own weight; reach and drop [m] from the clamp.
Result<Measurement> importCantilever(double reach_m, double drop_m,
                                     const CantileverImportOptions& options);
/// Rows of reach [mm] and drop [mm]: repeats with strips of the same length.
Result<Measurement> importCantilever(const std::filesystem::path& csv,
                                     const CantileverImportOptions& options);

/// A number of a source that contradicts itself or physics; it is kept as it is.
struct FlaggedRow {
  std::string table;
  int row = 0;  ///< From 0.
  std::string reason;
};

struct ImportedMaterial {
  Material material;
  std::vector<FlaggedRow> flagged;
};

/// An ARCSim material (docs/formats/arcsim.md): tabulated coupled law, law id "arcsim", tables kept
/// digit for digit.
Result<ImportedMaterial> importArcsim(const std::filesystem::path& file, const std::string& fabric);
/// Rows of an "arcsim" material's tables that are not positive definite. Error when the tables do
/// not have their shape.
Result<std::vector<FlaggedRow>> flagArcsimRows(const Material& material);

struct KesImportOptions {
  std::optional<std::string> fabric;  ///< One column of the table; all if not given.
  double areal_density_kg_per_m2 = 0.0;
};
/// A table of KES-FB results, one column a fabric: law "soft", isotropic, by the rules of
/// docs/imports.md.
Result<std::vector<ImportedMaterial>> importKes(const std::filesystem::path& csv,
                                                const KesImportOptions& options);

}  // namespace tenter
