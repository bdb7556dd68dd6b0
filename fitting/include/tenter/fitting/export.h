// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tenter/mechanics/material.h"

namespace tenter {

struct ExportOptions {
  std::optional<double> edge_m;  ///< Mean edge of the mesh that will use the numbers.
};

/// Relative error of one component over its measured strains, in the target's own formulae.
struct ExportError {
  std::string component;
  double strain_min = 0.0, strain_max = 0.0;  ///< As the material measures strain.
  bool measured = false;  ///< Otherwise a stated default range stands in for the measured one.
  double rms_rel = 0.0, max_rel = 0.0;
};

/// What a material became in another program's format (docs/exports.md).
struct ExportedMaterial {
  std::string content;              ///< The file.
  std::vector<ExportError> errors;  ///< Membrane components, then bending.
  double rms_rel = 0.0;  ///< Root mean square of |S_target - S| / |S| over the membrane samples.
  double max_rel = 0.0;  ///< Largest of them.
  double bending_rms_rel = 0.0, bending_max_rel = 0.0;  ///< Of the moment; NaN without bending.
  std::vector<std::string> lost;                        ///< What the format cannot hold, in words.
};

/// One row of the table of targets. To add one: its file, and one line in export.cpp.
struct ExportTarget {
  std::string_view id, description;
  std::string_view file_extension;
  std::string_view marker;  ///< Text by which a file of this kind is known as ours.
  bool needs_edge = false;
  Result<ExportedMaterial> (*make)(const Material&, const ExportOptions&);
};
std::span<const ExportTarget> exportTargets();
Result<const ExportTarget*> findExportTarget(std::string_view id);

/// Error when the target needs what the options lack, or the law has no stress of its own (one
/// mesh's constants).
Result<ExportedMaterial> exportMaterial(const Material& material, const ExportTarget& target,
                                        const ExportOptions& options);

}  // namespace tenter
