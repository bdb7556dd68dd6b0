// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/measured_sheet.h"

#include <algorithm>
#include <string>

#include "cloth_replica.h"
#include "position_residuals.h"

namespace tenter {
namespace {

/// Free nodes without a valid vertex in any triangle at them.
int unseenNodes(const Interpolation& interpolation, const TrackedFrame& frame,
                const std::vector<bool>& held) {
  std::vector<bool> seen = held;
  for (Eigen::Index vertex = 0; vertex < interpolation.rows(); ++vertex) {
    if (!frame.seen(vertex)) continue;
    for (Interpolation::InnerIterator node(interpolation, vertex); node; ++node)
      seen[static_cast<std::size_t>(node.col())] = true;
  }
  return static_cast<int>(std::count(seen.begin(), seen.end(), false));
}

Result<std::vector<ClipOutline>> outlinesOf(const MeasurementFrame& frame,
                                            const SheetFrame& sheet) {
  std::vector<ClipOutline> outlines;
  for (const ClipReading& clip : frame.clips) {
    Result<ClipOutline> outline = clipOutline(clip, sheet);
    if (!outline) return outline.error();
    outlines.push_back(std::move(*outline));
  }
  return outlines;
}

Result<MeasuredSheet> sheetOf(const TriangleMesh& rest, const MeasurementFrame& frame,
                              const FitTestOptions& options) {
  const Result<SheetFrame> sheet = sheetFrame(rest);
  if (!sheet) return sheet.error();
  const auto outlines = outlinesOf(frame, *sheet);
  if (!outlines) return outlines.error();
  const GridLines lines = replicaLines(*sheet, *outlines, options);
  Result<SheetMesh> replica = replicaSheet(*sheet, lines, *findClothModel("stvk").value());
  if (!replica) return replica.error();
  MeasuredSheet measured;
  measured.mesh = std::move(replica->rest);
  const Points3 at_rest = measured.mesh.positions;
  std::vector<bool> held(static_cast<std::size_t>(at_rest.cols()), false);
  const auto nodes = heldNodes(lines, *outlines);
  for (std::size_t clip = 0; clip < nodes.size(); ++clip) {
    for (const int node : nodes[clip]) {
      measured.mesh.positions.col(node) = frame.clips[clip].rig_from_clip * Vec3(at_rest.col(node));
      held[static_cast<std::size_t>(node)] = true;
      measured.held.push_back(node);
    }
  }
  std::sort(measured.held.begin(), measured.held.end());
  const TrackedFrame tracked{frame.positions, frame.position_sigma_m, frame.valid};
  const Interpolation at_vertices = interpolation(lines, sheet->vertices_m);
  measured.unseen = unseenNodes(at_vertices, tracked, held);
  fillMeasuredShape(at_vertices, tracked, lines, at_rest, held, measured.mesh.positions, kFillOnly);
  return measured;
}

}  // namespace

Result<MeasuredSheet> measuredSheet(const Measurement& measurement, std::size_t frame,
                                    const FitTestOptions& options) {
  const std::string place = "frame " + std::to_string(frame);
  if (!measurement.rest)
    return badInput("", "rest", "the measurement tracks no cloth, so it has no shape");
  if (frame >= measurement.frames.size())
    return badInput("", place,
                    "there are " + std::to_string(measurement.frames.size()) + " frames, from 0");
  const MeasurementFrame& chosen = measurement.frames[frame];
  const bool any = chosen.positions.cols() > 0 &&
                   (chosen.valid.empty() || std::any_of(chosen.valid.begin(), chosen.valid.end(),
                                                        [](auto v) { return v != 0; }));
  if (!any) return badInput("", place, "shows no vertex of the cloth");
  Result<MeasuredSheet> measured = sheetOf(*measurement.rest, chosen, options);
  if (!measured) {
    Error error = measured.error();
    if (error.place.empty()) error.place = place;
    return error;
  }
  return measured;
}

}  // namespace tenter
