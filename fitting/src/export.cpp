// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/export.h"

#include <array>
#include <cmath>

#include "export_targets.h"

namespace tenter {

namespace {

constexpr double kMinEdge_m = 1e-5, kMaxEdge_m = 1.0;

}  // namespace

std::span<const ExportTarget> exportTargets() {
  static const std::array kTargets = {arcsimExport(), blenderExport(), newtonExport(), csvExport()};
  return kTargets;
}

Result<const ExportTarget*> findExportTarget(std::string_view id) {
  std::string known;
  for (const ExportTarget& target : exportTargets()) {
    if (target.id == id) return &target;
    known.append(known.empty() ? "" : " ").append(target.id);
  }
  return usageError("there is no export to '" + std::string(id) + "'", "there are: " + known);
}

Result<ExportedMaterial> exportMaterial(const Material& material, const ExportTarget& target,
                                        const ExportOptions& options) {
  if (target.needs_edge && !options.edge_m) {
    return usageError("the numbers of " + std::string(target.id) + " depend on the mesh",
                      "give its mean edge with --edge-mm");
  }
  const double edge_m = options.edge_m.value_or(kMaxEdge_m);
  if (!std::isfinite(edge_m) || edge_m < kMinEdge_m || edge_m > kMaxEdge_m) {
    return usageError("--edge-mm must lie between 0.01 and 1000");
  }
  return target.make(material, options);
}

}  // namespace tenter
