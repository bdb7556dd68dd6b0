// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "tenter/calib/board.h"
#include "tenter/calib/byte_image.h"

namespace tenter {

/// Corners of a board as one image shows them.
struct BoardCorners {
  std::vector<int> ids;  ///< Ascending; all of them for a chessboard.
  Points2 pixels;        ///< 2 x n [px], the centre of the first pixel is (0, 0).
};

/// Finds a board. A chessboard must be seen whole, a ChArUco board at least in eight corners that
/// do not lie on one line. The order of a chessboard's corners is that of the board up to a turn
/// that maps the grid onto itself. Error's reason says what was not found.
/// Precondition: validateBoard(board).
Result<BoardCorners> detectBoard(const ByteImage& image, const Board& board);

/// Inner corners of the chessboard that an image really shows, columns x rows, if they are near,
/// but not, those of `board`; for telling a user who counted wrongly. Slow.
std::optional<std::pair<int, int>> otherCornerCount(const ByteImage& image, const Board& board);

}  // namespace tenter
