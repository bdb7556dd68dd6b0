// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "page_layout.h"
#include "tenter/calib/marker_cells.h"

namespace tenter {

namespace {

constexpr double kMmPerMetre = 1e3;

void addMarker(PrintPage& page, const ByteImage& cells, double x_mm, double y_mm, double side_mm) {
  page.boxes.push_back({x_mm, y_mm, side_mm, side_mm, 0});
  const double cell = side_mm / cells.width;
  for (int row = 0; row < cells.height; ++row) {
    for (int column = 0; column < cells.width; ++column) {
      if (cells.at(column, row) == 0) continue;
      page.boxes.push_back({x_mm + column * cell, y_mm + row * cell, cell, cell, 255});
    }
  }
}

}  // namespace

Result<PrintPage> boardPage(const Board& board, const Paper& paper) {
  require(validateBoard(board).ok(), "boardPage takes a valid board");
  const double square = kMmPerMetre * board.square_m, marker = kMmPerMetre * board.marker_m;
  const int across = board.columns + 1, down = board.rows + 1;
  auto layout = layOut(across * square, down * square, paper,
                       board.description() + ". Print at 100 %, then measure the rulers.");
  if (!layout) return layout.error();
  PrintPage& page = layout->page;
  int marker_id = 0;
  for (int row = 0; row < down; ++row) {
    for (int column = 0; column < across; ++column) {
      const double x = layout->x_mm + column * square, y = layout->y_mm + row * square;
      if ((row + column) % 2 == 0) {
        page.boxes.push_back({x, y, square, square, 0});
      } else if (board.kind == Board::Kind::kCharuco) {
        const double margin = 0.5 * (square - marker);
        addMarker(page, *markerCells(board.dictionary, marker_id++), x + margin, y + margin,
                  marker);
      }
    }
  }
  return std::move(layout->page);
}

}  // namespace tenter
