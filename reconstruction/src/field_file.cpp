// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/field_file.h"

#include <cstdio>

#include "tenter/core/files.h"

namespace tenter {

std::string formatField(const CorrelationField& field) {
  std::string text(kFieldHeader);
  text += '\n';
  char row[256];
  for (const CorrelatedPoint& point : field.points) {
    const double x = point.position.x(), y = point.position.y();
    if (point.valid()) {
      const Vec2 moved = point.match.warp.displacement();
      std::snprintf(row, sizeof row, "%.10g,%.10g,%.6f,%.6f,%.6f,%.6f,1\n", x, y, moved.x(),
                    moved.y(), point.sigma_px(), point.match.zncc);
    } else {
      std::snprintf(row, sizeof row, "%.10g,%.10g,nan,nan,nan,%.6f,0\n", x, y, point.match.zncc);
    }
    text += row;
  }
  return text;
}

Result<std::vector<Vec2>> readPoints(const std::filesystem::path& file) {
  const auto table = readNumericTable(file, 2);
  if (!table) return table.error();
  std::vector<Vec2> points;
  for (Eigen::Index row = 0; row < table->rows(); ++row) points.emplace_back(table->row(row));
  return points;
}

}  // namespace tenter
