// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/fitting/fit_test.h"
#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// Where the rectangle of cloth lies: in material coordinates, or, cut on the bias, in the plane of
/// its rest mesh.
struct SheetFrame {
  Eigen::Isometry2d uv_from_grid = Eigen::Isometry2d::Identity();
  Eigen::Isometry3d rest_from_grid = Eigen::Isometry3d::Identity();  ///< Of (p, q, 0).
  Eigen::AlignedBox2d box_m;  ///< The sample in grid coordinates.
  bool along_yarns = true;
  Points2 vertices_m;  ///< Tracked vertices in grid coordinates.
};

/// Error when the rest mesh is not a flat rectangle.
Result<SheetFrame> sheetFrame(const TriangleMesh& rest);

/// What a clip covers, in grid coordinates: a convex polygon.
using ClipOutline = std::vector<Vec2>;

/// From the clip's outline, else the bounding box of the vertices that it clamps. Error when it has
/// neither.
Result<ClipOutline> clipOutline(const ClipReading& clip, const SheetFrame& frame);

/// The replica's lines with stops on the outlines' edges ([Est12] sec. 5.1, docs/mechanics.md).
GridLines replicaLines(const SheetFrame& frame, const std::vector<ClipOutline>& outlines,
                       const FitTestOptions& options);

/// Error when the model runs along the yarns and the sample is cut on the bias.
Result<SheetMesh> replicaSheet(const SheetFrame& frame, const GridLines& lines,
                               const ClothModel& model);

/// Nodes inside each outline, its border included; a node goes to the first clip that claims it. A
/// clip between the lines takes the nearest node.
std::vector<std::vector<int>> heldNodes(const GridLines& lines,
                                        const std::vector<ClipOutline>& outlines);

/// points x nodes: linear interpolation on the triangles of a grid; points outside are moved to its
/// border.
using Interpolation = Eigen::SparseMatrix<double, Eigen::RowMajor>;
Interpolation interpolation(const GridLines& lines, const Points2& points_m);

}  // namespace tenter
