// SPDX-License-Identifier: GPL-3.0-or-later
#include "strip_sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tenter {
namespace {

/// Below this an angle is 0 or 90 degrees: the strip's end is then off by 1e-6 of its length.
constexpr double kAligned_rad = 1e-6;

/// Quarter turns from the weft, or -1 if the strip runs along no yarn.
int quarterTurns(double angle_rad) {
  const double turns = angle_rad / (0.5 * std::numbers::pi);
  const double nearest = std::round(turns);
  if (std::abs(turns - nearest) * 0.5 * std::numbers::pi > kAligned_rad) return -1;
  return (static_cast<int>(nearest) % 4 + 4) % 4;
}

std::vector<double> negated(const std::vector<double>& lines) {
  std::vector<double> result;
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) result.push_back(-*line);
  return result;
}

SheetMesh alignedStrip(int quarter, const std::vector<double>& along,
                       const std::vector<double>& across, DiagonalPattern diagonals) {
  // The width's direction is the length's turned by 90 degrees.
  switch (quarter) {
    case 0:
      return gridSheet(GridLines{along, across, diagonals});
    case 1:
      return gridSheet(GridLines{negated(across), along, diagonals});
    case 2:
      return gridSheet(GridLines{negated(along), negated(across), diagonals});
    default:
      return gridSheet(GridLines{across, negated(along), diagonals});
  }
}

Result<SheetMesh> turnedStrip(const Vec3& along, const Vec3& across,
                              const std::vector<double>& lines_along,
                              const std::vector<double>& lines_across, DiagonalPattern diagonals) {
  SheetMesh straight = gridSheet(GridLines{lines_along, lines_across, diagonals});
  TriangleMesh mesh = straight.rest;
  mesh.positions = along * straight.rest.positions.row(0) + across * straight.rest.positions.row(1);
  mesh.uv = mesh.positions.topRows<2>();
  Result<SheetMesh> sheet = sheetFromMesh(mesh, false);
  if (sheet) sheet->pattern = straight.pattern;
  return sheet;
}

}  // namespace

std::vector<int> StripSheet::nodesBetween(double begin, double end) const {
  const double tolerance = 1e-9 * (s.maxCoeff() - s.minCoeff());
  std::vector<int> nodes;
  for (Eigen::Index i = 0; i < s.size(); ++i)
    if (s[i] >= begin - tolerance && s[i] <= end + tolerance) nodes.push_back(static_cast<int>(i));
  return nodes;
}

Result<StripSheet> makeStrip(const ClothModel& model, const std::vector<double>& lines_along,
                             const std::vector<double>& lines_across, double angle_rad,
                             DiagonalPattern diagonals) {
  StripSheet strip;
  strip.along = Vec3(std::cos(angle_rad), std::sin(angle_rad), 0.0);
  strip.across = Vec3(-strip.along.y(), strip.along.x(), 0.0);
  const int quarter = quarterTurns(angle_rad);
  if (quarter >= 0) {
    strip.sheet = alignedStrip(quarter, lines_along, lines_across, diagonals);
  } else if (model.needs_grid) {
    return badInput("", "angle",
                    "model " + std::string(model.id) +
                        " runs along the yarns and cannot take a strip cut at " +
                        std::to_string(angle_rad * 180.0 / std::numbers::pi) + " degrees",
                    "use a triangle model, or strips at 0 and 90 degrees");
  } else {
    Result<SheetMesh> sheet =
        turnedStrip(strip.along, strip.across, lines_along, lines_across, diagonals);
    if (!sheet) return sheet.error();
    strip.sheet = std::move(*sheet);
  }
  strip.s = strip.sheet.rest.positions.transpose() * strip.along;
  return strip;
}

std::vector<double> equalLines(double begin, double end, int intervals) {
  std::vector<double> lines(intervals + 1);
  for (int i = 0; i <= intervals; ++i) lines[i] = begin + (end - begin) * i / intervals;
  return lines;
}

}  // namespace tenter
