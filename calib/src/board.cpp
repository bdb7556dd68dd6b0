// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/board.h"

#include <array>
#include <opencv2/aruco.hpp>
#include <sstream>

namespace tenter {

namespace {

namespace aruco = cv::aruco;

constexpr std::array kDictionaries = {
    MarkerDictionary{"4x4_50", aruco::DICT_4X4_50, 50},
    MarkerDictionary{"4x4_100", aruco::DICT_4X4_100, 100},
    MarkerDictionary{"4x4_250", aruco::DICT_4X4_250, 250},
    MarkerDictionary{"4x4_1000", aruco::DICT_4X4_1000, 1000},
    MarkerDictionary{"5x5_50", aruco::DICT_5X5_50, 50},
    MarkerDictionary{"5x5_100", aruco::DICT_5X5_100, 100},
    MarkerDictionary{"5x5_250", aruco::DICT_5X5_250, 250},
    MarkerDictionary{"5x5_1000", aruco::DICT_5X5_1000, 1000},
    MarkerDictionary{"6x6_50", aruco::DICT_6X6_50, 50},
    MarkerDictionary{"6x6_100", aruco::DICT_6X6_100, 100},
    MarkerDictionary{"6x6_250", aruco::DICT_6X6_250, 250},
    MarkerDictionary{"6x6_1000", aruco::DICT_6X6_1000, 1000},
    MarkerDictionary{"original", aruco::DICT_ARUCO_ORIGINAL, 1024},
    MarkerDictionary{"apriltag_36h11", aruco::DICT_APRILTAG_36h11, 587},
};

Error wrong(const std::string& field, const std::string& reason, const std::string& advice = "") {
  return badInput("", field, reason, advice);
}

std::string dictionaryNames() {
  std::string names;
  for (const MarkerDictionary& row : kDictionaries) {
    names += (names.empty() ? "" : ", ") + std::string(row.name);
  }
  return names;
}

Result<void> validateMarkers(const Board& board) {
  if (!(board.marker_m > 0.0 && board.marker_m < board.square_m)) {
    return wrong("marker_m", "must lie between 0 and the side of a square");
  }
  for (const MarkerDictionary& row : kDictionaries) {
    if (row.name != board.dictionary) continue;
    const int needed = (board.columns + 1) * (board.rows + 1) / 2;
    if (needed <= row.markers) return {};
    return wrong("dictionary", board.dictionary + " has " + std::to_string(row.markers) +
                                   " markers, the board needs " + std::to_string(needed));
  }
  return wrong("dictionary", "'" + board.dictionary + "' is not known",
               "one of " + dictionaryNames());
}

}  // namespace

std::span<const MarkerDictionary> markerDictionaries() { return kDictionaries; }

std::string_view nameOf(Board::Kind kind) {
  return kind == Board::Kind::kCharuco ? "charuco" : "chessboard";
}

Result<Board::Kind> boardKind(std::string_view name) {
  for (const Board::Kind kind : {Board::Kind::kChessboard, Board::Kind::kCharuco}) {
    if (nameOf(kind) == name) return kind;
  }
  return wrong("board", "'" + std::string(name) + "' is not known", "chessboard or charuco");
}

Points3 Board::cornerPositions() const {
  Points3 points(3, cornerCount());
  for (int i = 0; i < cornerCount(); ++i) {
    points.col(i) = Vec3(square_m * (i % columns), square_m * (i / columns), 0.0);
  }
  return points;
}

std::string Board::description() const {
  std::ostringstream out;
  out << (kind == Kind::kCharuco ? "ChArUco board" : "chessboard") << " of " << columns << " x "
      << rows << " inner corners, " << 1e3 * square_m << " mm squares";
  if (kind == Kind::kCharuco) {
    out << ", " << 1e3 * marker_m << " mm markers of " << dictionary;
  }
  return out.str();
}

Result<void> validateBoard(const Board& board) {
  constexpr int kMaxCorners = 100;
  const int longer = std::max(board.columns, board.rows);
  const int shorter = std::min(board.columns, board.rows);
  if (shorter < 2 || longer < 3 || longer > kMaxCorners) {
    return wrong("corners", "must be 3 x 2 to 100 x 100",
                 "count the corners where four squares meet, one fewer than squares");
  }
  if (!(board.square_m >= 1e-4 && board.square_m <= 1.0)) {
    return wrong("square_m", "must lie between 0.1 mm and 1 m", "check the unit");
  }
  return board.kind == Board::Kind::kCharuco ? validateMarkers(board) : Result<void>();
}

}  // namespace tenter
