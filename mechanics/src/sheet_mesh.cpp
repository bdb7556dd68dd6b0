// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/sheet_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flat_sheet.h"

namespace tenter {
namespace {

/// Of the whole length: stops closer than this are one stop.
constexpr double kMergeTolerance = 1e-6;

std::vector<Triangle> gridTriangles(const GridLines& g) {
  std::vector<Triangle> triangles;
  for (int j = 0; j + 1 < static_cast<int>(g.v_lines.size()); ++j) {
    for (int i = 0; i + 1 < static_cast<int>(g.u_lines.size()); ++i) {
      const int a = g.node(i, j), b = g.node(i + 1, j);
      const int c = g.node(i + 1, j + 1), d = g.node(i, j + 1);
      const bool other = g.diagonals == DiagonalPattern::kAlternating && (i + j) % 2 == 1;
      if (other) {
        triangles.push_back({a, b, d});
        triangles.push_back({b, c, d});
      } else {
        triangles.push_back({a, b, c});
        triangles.push_back({a, c, d});
      }
    }
  }
  return triangles;
}

bool increasing(const std::vector<double>& lines) {
  return std::adjacent_find(lines.begin(), lines.end(),
                            [](double a, double b) { return !(a < b); }) == lines.end();
}

std::vector<double> equalLines(double size, int nodes) {
  std::vector<double> lines(static_cast<std::size_t>(nodes));
  for (int i = 0; i < nodes; ++i) lines[i] = size * i / (nodes - 1);
  return lines;
}

/// Stops strictly inside, sorted, none within the tolerance of another or of an end.
std::vector<double> mergedStops(double begin, double end, std::vector<double> stops) {
  const double gap = kMergeTolerance * (end - begin);
  std::sort(stops.begin(), stops.end());
  std::vector<double> merged;
  for (const double s : stops) {
    const double last = merged.empty() ? begin : merged.back();
    if (s - last > gap && end - s > gap) merged.push_back(s);
  }
  return merged;
}

}  // namespace

double SheetMesh::area() const {
  double sum = 0.0;
  for (const RestTriangle& t : triangles) sum += t.area_m2;
  return sum;
}

SheetMesh flatSheet(const Points2& uv, std::vector<Triangle> triangles, std::string pattern) {
  SheetMesh sheet;
  sheet.rest.uv = uv;
  sheet.rest.positions = Points3::Zero(3, uv.cols());
  sheet.rest.positions.topRows<2>() = uv;
  sheet.rest.triangles = std::move(triangles);
  sheet.topology = buildTopology(sheet.rest).value();
  sheet.pattern = std::move(pattern);
  for (const Triangle& t : sheet.rest.triangles) {
    Mat2 edges;
    edges << uv.col(t[1]) - uv.col(t[0]), uv.col(t[2]) - uv.col(t[0]);
    sheet.triangles.push_back({edges.inverse(), 0.5 * edges.determinant()});
  }
  return sheet;
}

SheetMesh gridSheet(GridLines lines) {
  const std::size_t nu = lines.u_lines.size(), nv = lines.v_lines.size();
  require(nu >= 2 && nv >= 2 && increasing(lines.u_lines) && increasing(lines.v_lines),
          "gridSheet: at least two increasing lines each way");
  Points2 uv(2, static_cast<Eigen::Index>(nu * nv));
  for (std::size_t j = 0; j < nv; ++j) {
    for (std::size_t i = 0; i < nu; ++i) {
      uv.col(static_cast<Eigen::Index>(j * nu + i)) = Vec2(lines.u_lines[i], lines.v_lines[j]);
    }
  }
  const bool alternating = lines.diagonals == DiagonalPattern::kAlternating;
  SheetMesh sheet = flatSheet(uv, gridTriangles(lines),
                              "grid " + std::to_string(nu) + "x" + std::to_string(nv) +
                                  (alternating ? " alternating" : " uniform"));
  sheet.grid = std::move(lines);
  return sheet;
}

SheetMesh gridSheet(const Vec2& size_m, int nodes_u, int nodes_v, DiagonalPattern diagonals) {
  require(nodes_u >= 2 && nodes_v >= 2 && size_m.minCoeff() > 0.0,
          "gridSheet: a positive size and at least two nodes each way");
  return gridSheet(
      GridLines{equalLines(size_m[0], nodes_u), equalLines(size_m[1], nodes_v), diagonals});
}

std::vector<double> linesThrough(double begin, double end, int nodes, std::vector<double> stops) {
  require(begin < end && nodes >= 2, "linesThrough: an interval and at least two lines");
  std::vector<double> anchors = mergedStops(begin, end, std::move(stops));
  const int inner = static_cast<int>(anchors.size());
  nodes = std::max(nodes, inner + 2);
  const double spacing = (end - begin) / (nodes - 1);
  std::vector<int> index{0};
  for (int k = 0; k < inner; ++k) {
    const int nearest = static_cast<int>(std::lround((anchors[k] - begin) / spacing));
    index.push_back(std::clamp(nearest, index.back() + 1, nodes - 1 - (inner - k)));
  }
  index.push_back(nodes - 1);
  anchors.insert(anchors.begin(), begin);
  anchors.push_back(end);
  // Equal spacing between stops: only the lines on stops then have unequal neighbours.
  std::vector<double> lines;
  for (std::size_t k = 0; k + 1 < anchors.size(); ++k) {
    const int count = index[k + 1] - index[k];
    for (int i = 0; i < count; ++i) {
      lines.push_back(anchors[k] + (anchors[k + 1] - anchors[k]) * i / count);
    }
  }
  lines.push_back(end);
  return lines;
}

Eigen::Matrix3Xd greenStrains(const SheetMesh& sheet, const Eigen::Ref<const Points3>& positions) {
  Eigen::Matrix3Xd out(3, sheet.triangleCount());
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    const Triangle& ids = sheet.rest.triangles[t];
    Eigen::Matrix<double, 3, 2> edges;
    edges << positions.col(ids[1]) - positions.col(ids[0]),
        positions.col(ids[2]) - positions.col(ids[0]);
    const Eigen::Matrix<double, 3, 2> w = edges * sheet.triangles[t].edges_inverse;
    out.col(t) << 0.5 * (w.col(0).squaredNorm() - 1.0), 0.5 * (w.col(1).squaredNorm() - 1.0),
        w.col(0).dot(w.col(1));
  }
  return out;
}

}  // namespace tenter
