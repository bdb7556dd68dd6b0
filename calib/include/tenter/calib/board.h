// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// A flat calibration board of squares. Its corners are the inner ones, where four squares meet,
/// numbered row by row. Frame of the board: origin in corner 0, x along the rows, y along the
/// columns (down, as the board is printed), z into the board, so that a camera before it sees x to
/// the right and y down.
struct Board {
  enum class Kind { kChessboard, kCharuco };

  Kind kind = Kind::kChessboard;
  int columns = 9, rows = 6;          ///< Inner corners: one fewer than squares.
  double square_m = 0.025;            ///< Side of a square.
  double marker_m = 0.0;              ///< ChArUco: side of a marker's black border.
  std::string dictionary = "4x4_50";  ///< ChArUco: which markers; see markerDictionaries().

  int cornerCount() const { return columns * rows; }
  /// 3 x n, z = 0 [m].
  Points3 cornerPositions() const;
  /// "chessboard of 9 x 6 inner corners, 25 mm squares".
  std::string description() const;
};

/// "chessboard" and "charuco".
std::string_view nameOf(Board::Kind kind);
Result<Board::Kind> boardKind(std::string_view name);

/// A family of markers by the name that files and options use.
struct MarkerDictionary {
  std::string_view name;
  int opencv_id, markers;
};
std::span<const MarkerDictionary> markerDictionaries();

/// Error unless the board has 3 x 2 to 100 x 100 corners, squares of 0.1 mm to 1 m, and, for
/// ChArUco, a known dictionary with enough markers that are smaller than the squares. Place names
/// the field.
Result<void> validateBoard(const Board& board);

}  // namespace tenter
