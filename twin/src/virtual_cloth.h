// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/mechanics/equilibrium.h"
#include "tenter/twin/capture.h"

namespace tenter {

/// What the sample is made of: the specimen's law, or a fitted model's.
struct ClothSource {
  const ClothModel* model = nullptr;  ///< Elements; for the specimen those of "stvk".
  std::shared_ptr<StrainLaw> membrane;
  std::shared_ptr<StrainLaw> bending;
  bool own = false;  ///< A fitted model.
};
Result<ClothSource> makeClothSource(const Fabric& specimen, const std::optional<OwnLaw>& own_law);

/// Turns the material directions of a flat sheet: the x axis then lies at `angle_rad` from the
/// weft. Such a sheet is no grid any more to springs, which follow mesh lines.
void turnMaterial(SheetMesh& sheet, double angle_rad);

/// The flat sample over [0, side]^2 on given lines; on the bias its material directions are turned
/// by 45 degrees (u along the diagonal of x and y), which grids of springs cannot follow.
SheetMesh sampleSheet(GridLines lines, bool on_bias);
Vec2 materialPoint(Vec2 place, bool on_bias);  ///< (u, v) of a place on the flat sample.

/// One frame without noise. Parts are as in MeasurementFrame.
struct ExactFrame {
  MeasurementFrame reading;
  std::vector<double> cord_motion;  ///< +1 drawn in, -1 let out, 0 still; one a cord.
  RigMoment moment;                 ///< Empty unless the options keep it.
};

struct CaptureRun {
  std::vector<ExactFrame> frames;
  std::vector<ClipInfo> clips;
  TriangleMesh rest;  ///< Tracked mesh.
  CaptureStatistics statistics;
};

/// Tracked vertices of the flat sample: a regular grid with uv.
TriangleMesh trackedMesh(int per_side, bool on_bias);

/// Protocols with cords and free clips.
Result<CaptureRun> runCords(const CaptureOptions& options, const Fabric& specimen,
                            const ClothSource& cloth);
/// The table tests.
Result<CaptureRun> runTable(const CaptureOptions& options, const Fabric& specimen,
                            const ClothSource& cloth);

/// Solves and counts the cost. True if `state` is now a converged, stable equilibrium; otherwise it
/// is as it was. `cancelled` is polled between Newton steps.
bool findStableShape(EquilibriumSolver& solver, ClothState& state, CaptureStatistics& statistics,
                     const std::function<bool()>& cancelled = nullptr);

}  // namespace tenter
