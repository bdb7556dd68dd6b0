// SPDX-License-Identifier: GPL-3.0-or-later
#include "board_options.h"

#include <charconv>

#include "import_options.h"

namespace tenter::app {

namespace {

/// A marker of ChArUco boards is three quarters of a square unless told otherwise.
constexpr double kMarkerOfSquare = 0.75;

/// "9x6".
bool parseCounts(const std::string& text, int& columns, int& rows) {
  const char *at = text.data(), *end = text.data() + text.size();
  const auto first = std::from_chars(at, end, columns);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return false;
  const auto second = std::from_chars(first.ptr + 1, end, rows);
  return second.ec == std::errc() && second.ptr == end;
}

}  // namespace

Result<Board> BoardOptions::board() const {
  Board board;
  const auto parsed = boardKind(kind);
  if (!parsed) return usageError("--board: " + parsed.error().reason, parsed.error().advice);
  board.kind = *parsed;
  if (!parseCounts(corners, board.columns, board.rows)) {
    return usageError("--corners: '" + corners + "' is not understood",
                      "such as 9x6: inner corners of a row and of a column");
  }
  board.square_m = kMetresPerMm * square_mm;
  board.dictionary = dictionary;
  if (board.kind == Board::Kind::kCharuco) {
    board.marker_m = marker_mm > 0.0 ? kMetresPerMm * marker_mm : kMarkerOfSquare * board.square_m;
  }
  if (const auto valid = validateBoard(board); !valid) {
    const Error& error = valid.error();
    return usageError("the board's " + error.place + " " + error.reason, error.advice);
  }
  return board;
}

void declareBoard(CLI::App& command, BoardOptions& o) {
  command.add_option("--board", o.kind, "chessboard or charuco")->capture_default_str();
  command.add_option("--corners", o.corners, "Inner corners of a row x of a column, such as 9x6")
      ->required();
  command.add_option("--square-mm", o.square_mm, "Side of a square, measured on the print")
      ->required();
  command.add_option("--marker-mm", o.marker_mm,
                     "ChArUco: side of a marker; 0.75 squares if not given");
  command.add_option("--dictionary", o.dictionary, "ChArUco: markers, such as 4x4_50 or 5x5_100")
      ->capture_default_str();
}

}  // namespace tenter::app
