// SPDX-License-Identifier: GPL-3.0-or-later
#include "grid_mesh.h"

#include <algorithm>
#include <numeric>

namespace tenter {

namespace {

constexpr int kClosing = 5;  ///< Matched neighbours, of eight, that close a hole.

std::vector<std::uint8_t> presentNodes(const SheetGrid& grid, const SheetHeights& heights,
                                       const std::vector<RestVertex>& vertices) {
  const auto valid = [&](int column, int row) {
    return column >= 0 && row >= 0 && column < grid.columns && row < grid.rows &&
           vertices[static_cast<std::size_t>(row) * grid.columns + column].state ==
               PointState::kValid;
  };
  std::vector<std::uint8_t> present(vertices.size());
  for (int node = 0; node < static_cast<int>(vertices.size()); ++node) {
    const int column = node % grid.columns, row = node / grid.columns;
    int around = 0;
    for (int r = row - 1; r <= row + 1; ++r) {
      for (int c = column - 1; c <= column + 1; ++c) around += static_cast<int>(valid(c, r));
    }
    const bool closed = valid(column, row) || grid.to_the_edge || around >= kClosing;
    present[node] = static_cast<std::uint8_t>(closed && heights.known(node));
  }
  return present;
}

/// Lower left corners of cells with all four nodes, of the largest piece joined by edges.
std::vector<int> largestPiece(const SheetGrid& grid, const std::vector<std::uint8_t>& present) {
  const int columns = grid.columns - 1, rows = grid.rows - 1;
  const auto whole = [&](int column, int row) {
    const int node = row * grid.columns + column;
    return present[node] && present[node + 1] && present[node + grid.columns] &&
           present[node + grid.columns + 1];
  };
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(columns) * rows);
  std::vector<int> largest;
  for (int start = 0; start < columns * rows; ++start) {
    if (seen[start] || !whole(start % columns, start / columns)) continue;
    std::vector<int> piece = {start};
    seen[start] = 1;
    for (std::size_t k = 0; k < piece.size(); ++k) {
      const int c = piece[k] % columns, r = piece[k] / columns;
      for (const auto& [dc, dr] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const int cc = c + dc, rr = r + dr;
        if (cc < 0 || rr < 0 || cc >= columns || rr >= rows) continue;
        if (seen[rr * columns + cc] || !whole(cc, rr)) continue;
        seen[rr * columns + cc] = 1;
        piece.push_back(rr * columns + cc);
      }
    }
    if (piece.size() > largest.size()) largest = std::move(piece);
  }
  std::sort(largest.begin(), largest.end());
  for (int& cell : largest) cell = (cell / columns) * grid.columns + cell % columns;
  return largest;
}

}  // namespace

Result<RestSurface> meshOnGrid(const SheetGrid& grid, const SheetHeights& heights,
                               std::vector<RestVertex> vertices) {
  const std::vector<int> cells = largestPiece(grid, presentNodes(grid, heights, vertices));
  if (cells.empty()) {
    return badInput("", "", "no piece of surface was found in two views",
                    "do the images show the same texture, in focus and unsaturated?");
  }
  RestSurface surface;
  surface.columns = grid.columns;
  surface.rows = grid.rows;
  std::vector<int> vertex_of_node(vertices.size(), -1);
  for (const int cell : cells) {
    for (const int node : {cell, cell + 1, cell + grid.columns, cell + grid.columns + 1}) {
      vertex_of_node[node] = 0;
    }
  }
  for (int node = 0; node < static_cast<int>(vertices.size()); ++node) {
    if (vertex_of_node[node] < 0) continue;
    vertex_of_node[node] = static_cast<int>(surface.node_of_vertex.size());
    surface.node_of_vertex.push_back(node);
  }
  const auto count = static_cast<Eigen::Index>(surface.node_of_vertex.size());
  surface.mesh.positions.resize(3, count);
  surface.mesh.uv.resize(2, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int node = surface.node_of_vertex[i];
    const bool valid = vertices[node].state == PointState::kValid;
    surface.mesh.positions.col(i) =
        valid ? vertices[node].point.position_m : heights.element(node).point_m;
    surface.mesh.uv.col(i) = grid.uv(grid.place(node));
    surface.vertices.push_back(std::move(vertices[node]));
  }
  for (const int cell : cells) {
    const int a = vertex_of_node[cell], b = vertex_of_node[cell + 1];
    const int c = vertex_of_node[cell + grid.columns], d = vertex_of_node[cell + grid.columns + 1];
    surface.mesh.triangles.push_back({a, b, d});
    surface.mesh.triangles.push_back({a, d, c});
  }
  return surface;
}

}  // namespace tenter
