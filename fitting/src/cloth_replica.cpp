// SPDX-License-Identifier: GPL-3.0-or-later
#include "cloth_replica.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tenter {
namespace {

/// A rest mesh lies in its plane, and fills its rectangle, within this share of its size.
constexpr double kFlatness = 0.01;
/// Coordinates closer than this share of the sample are equal.
constexpr double kSame = 1e-6;

double meshArea(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const Vec2 a = mesh.uv.col(t[1]) - mesh.uv.col(t[0]), b = mesh.uv.col(t[2]) - mesh.uv.col(t[0]);
    area += 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
  }
  return area;
}

Eigen::AlignedBox2d boxOf(const Points2& points) {
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff()};
}

bool fills(const Eigen::AlignedBox2d& box, double area) {
  return area > (1.0 - 2.0 * kFlatness) * box.volume();
}

/// Best rigid motion from (u, v, 0) to the rest positions.
Eigen::Isometry3d restFromUv(const TriangleMesh& rest) {
  Points3 flat = Points3::Zero(3, rest.vertexCount());
  flat.topRows<2>() = rest.uv;
  Eigen::Isometry3d motion(Eigen::umeyama(flat, rest.positions, false));
  // Rounding of a mesh that lies at its own material coordinates must not turn it.
  if ((motion.matrix() - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff() < 1e-9)
    motion.setIdentity();
  return motion;
}

bool inside(const ClipOutline& outline, const Vec2& point, double tolerance) {
  double turn = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[i], b = outline[(i + 1) % outline.size()];
    turn += a.x() * b.y() - a.y() * b.x();
  }
  const double sign = turn >= 0.0 ? 1.0 : -1.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[i], edge = outline[(i + 1) % outline.size()] - a;
    const Vec2 to = point - a;
    if (sign * (edge.x() * to.y() - edge.y() * to.x()) < -tolerance * edge.norm()) return false;
  }
  return true;
}

Eigen::AlignedBox2d boxOf(const ClipOutline& outline) {
  Eigen::AlignedBox2d box;
  for (const Vec2& corner : outline) box.extend(corner);
  return box;
}

/// Places that grid lines of one axis must pass: edges across that axis; the ends of small clips
/// that have none.
void addStops(const ClipOutline& outline, int axis, const Eigen::AlignedBox2d& sample,
              std::vector<double>& stops) {
  const double same = kSame * sample.sizes().maxCoeff();
  bool aligned = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[i], edge = outline[(i + 1) % outline.size()] - a;
    if (std::abs(edge[axis]) > same || std::abs(edge[1 - axis]) <= same) continue;
    stops.push_back(a[axis]);
    aligned = true;
  }
  const Eigen::AlignedBox2d box = boxOf(outline);
  if (aligned || (box.sizes().array() > 0.5 * sample.sizes().array()).any()) return;
  stops.push_back(box.min()[axis]);
  stops.push_back(box.max()[axis]);
}

std::vector<double> linesOfAxis(int axis, const SheetFrame& frame,
                                const std::vector<ClipOutline>& outlines, int nodes) {
  std::vector<double> stops;
  const double begin = frame.box_m.min()[axis], end = frame.box_m.max()[axis];
  for (const ClipOutline& outline : outlines) addStops(outline, axis, frame.box_m, stops);
  std::erase_if(stops, [&](double s) { return s <= begin || s >= end; });
  return linesThrough(begin, end, nodes, std::move(stops));
}

Vec2 nodePlace(const GridLines& lines, int node) {
  const int columns = static_cast<int>(lines.u_lines.size());
  return {lines.u_lines[node % columns], lines.v_lines[node / columns]};
}

/// Cell and place in it of a coordinate.
struct CellPlace {
  int cell;
  double share;
};
CellPlace cellPlace(const std::vector<double>& lines, double x) {
  const auto above = std::upper_bound(lines.begin(), lines.end(), x);
  const int cell = std::clamp(static_cast<int>(above - lines.begin()) - 1, 0,
                              static_cast<int>(lines.size()) - 2);
  return {cell, std::clamp((x - lines[cell]) / (lines[cell + 1] - lines[cell]), 0.0, 1.0)};
}

}  // namespace

Result<SheetFrame> sheetFrame(const TriangleMesh& rest) {
  if (!rest.hasUv() || rest.triangles.empty())
    return badInput("", "rest", "the rest mesh has no material coordinates");
  const Eigen::Isometry3d rest_from_uv = restFromUv(rest);
  Points3 flat = Points3::Zero(3, rest.vertexCount());
  flat.topRows<2>() = rest.uv;
  const double size = boxOf(rest.uv).sizes().norm();
  const double deviation = ((rest_from_uv * flat) - rest.positions).colwise().norm().maxCoeff();
  if (deviation > kFlatness * size)
    return badInput("", "rest",
                    "the rest mesh is not flat in its material coordinates: a vertex is " +
                        std::to_string(1e3 * deviation) + " mm off");
  SheetFrame frame;
  frame.rest_from_grid = rest_from_uv;
  frame.vertices_m = rest.uv;
  frame.box_m = boxOf(rest.uv);
  const double area = meshArea(rest);
  if (fills(frame.box_m, area)) return frame;
  // Cut on the bias: the rectangle is one in the rig's x and y.
  const Mat3 turn = rest_from_uv.linear();
  frame.along_yarns = false;
  frame.uv_from_grid.linear() =
      Eigen::Rotation2Dd(std::atan2(turn(1, 0), turn(0, 0))).toRotationMatrix().transpose();
  Eigen::Isometry3d uv_from_grid = Eigen::Isometry3d::Identity();
  uv_from_grid.linear().topLeftCorner<2, 2>() = frame.uv_from_grid.linear();
  frame.rest_from_grid = rest_from_uv * uv_from_grid;
  frame.vertices_m = frame.uv_from_grid.inverse() * rest.uv;
  frame.box_m = boxOf(frame.vertices_m);
  if (!fills(frame.box_m, area)) return badInput("", "rest", "the sample is not a rectangle");
  return frame;
}

Result<ClipOutline> clipOutline(const ClipReading& clip, const SheetFrame& frame) {
  const Eigen::Isometry2d grid_from_uv = frame.uv_from_grid.inverse();
  ClipOutline outline;
  if (clip.outline_uv_m.size() >= 3) {
    for (const Vec2& corner : clip.outline_uv_m) outline.push_back(grid_from_uv * corner);
    return outline;
  }
  if (clip.clamped_vertices.empty())
    return badInput("", "clip " + clip.clip, "has neither an outline nor clamped vertices");
  Eigen::AlignedBox2d box;
  for (const int vertex : clip.clamped_vertices) box.extend(frame.vertices_m.col(vertex).eval());
  return ClipOutline{
      box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
}

GridLines replicaLines(const SheetFrame& frame, const std::vector<ClipOutline>& outlines,
                       const FitTestOptions& options) {
  return {linesOfAxis(0, frame, outlines, options.nodes),
          linesOfAxis(1, frame, outlines, options.nodes), options.diagonals};
}

Result<SheetMesh> replicaSheet(const SheetFrame& frame, const GridLines& lines,
                               const ClothModel& model) {
  SheetMesh sheet = gridSheet(lines);
  const Points3 flat = sheet.rest.positions;
  sheet.rest.positions = frame.rest_from_grid * flat;
  if (frame.along_yarns) return sheet;
  if (model.needs_grid)
    return badInput("", "rest",
                    "model " + std::string(model.id) +
                        " runs along the yarns and cannot take a sample cut on the bias",
                    "use a triangle model, or leave this measurement out");
  TriangleMesh mesh = sheet.rest;
  mesh.uv = frame.uv_from_grid * Points2(flat.topRows<2>());
  Result<SheetMesh> turned = sheetFromMesh(mesh, false);
  if (turned) turned->pattern = sheet.pattern;
  return turned;
}

std::vector<std::vector<int>> heldNodes(const GridLines& lines,
                                        const std::vector<ClipOutline>& outlines) {
  const int count = static_cast<int>(lines.u_lines.size() * lines.v_lines.size());
  const double same = kSame * (lines.u_lines.back() - lines.u_lines.front());
  std::vector<bool> taken(count, false);
  std::vector<std::vector<int>> held(outlines.size());
  for (std::size_t c = 0; c < outlines.size(); ++c) {
    const Vec2 centre = boxOf(outlines[c]).center();
    int nearest = -1;
    double best = std::numeric_limits<double>::infinity();
    for (int node = 0; node < count; ++node) {
      if (taken[node]) continue;
      const Vec2 place = nodePlace(lines, node);
      if (inside(outlines[c], place, same)) held[c].push_back(node);
      if ((place - centre).norm() < best) {
        best = (place - centre).norm();
        nearest = node;
      }
    }
    if (held[c].empty() && nearest >= 0) held[c].push_back(nearest);
    for (const int node : held[c]) taken[node] = true;
  }
  return held;
}

Interpolation interpolation(const GridLines& lines, const Points2& points_m) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(3 * static_cast<std::size_t>(points_m.cols()));
  for (Eigen::Index p = 0; p < points_m.cols(); ++p) {
    const auto [i, s] = cellPlace(lines.u_lines, points_m(0, p));
    const auto [j, t] = cellPlace(lines.v_lines, points_m(1, p));
    const int a = lines.node(i, j), b = lines.node(i + 1, j), c = lines.node(i + 1, j + 1),
              d = lines.node(i, j + 1);
    using Share = std::pair<int, double>;
    std::array<Share, 3> shares;
    // Each quad as gridSheet splits it.
    if (lines.diagonals == DiagonalPattern::kAlternating && (i + j) % 2 == 1)
      shares = s + t <= 1.0
                   ? std::array{Share{a, 1.0 - s - t}, Share{b, s}, Share{d, t}}
                   : std::array{Share{b, 1.0 - t}, Share{c, s + t - 1.0}, Share{d, 1.0 - s}};
    else
      shares = t <= s ? std::array{Share{a, 1.0 - s}, Share{b, s - t}, Share{c, t}}
                      : std::array{Share{a, 1.0 - t}, Share{c, s}, Share{d, t - s}};
    for (const auto& [node, weight] : shares)
      if (weight != 0.0) entries.emplace_back(static_cast<int>(p), node, weight);
  }
  Interpolation matrix(points_m.cols(),
                       static_cast<Eigen::Index>(lines.u_lines.size() * lines.v_lines.size()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace tenter
