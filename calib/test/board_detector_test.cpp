// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/board_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "virtual_photo.h"

namespace tenter {
namespace {

using testing::HasSubstr;
using virtual_rig::photographSheet;
using virtual_rig::print;

constexpr double kGreyNoise = 2.0;
/// Held-out boards are to fit within 0.1 px, so corners must be better.
constexpr double kCornerError_px = 0.08;

virtual_rig::Camera camera() {
  virtual_rig::Camera c = virtual_rig::cameras(1)[0];
  c.width_px = 640;
  c.height_px = 480;
  c.lens = virtual_rig::lens(950.0, 321.0, 238.0);
  return c;
}

Eigen::Isometry3d tilted(const Board& board, const Vec2& aside_m = Vec2::Zero()) {
  const Vec3 middle = board.cornerPositions().rowwise().mean();
  return Eigen::Translation3d(aside_m.x(), aside_m.y(), 0.62) *
         Eigen::AngleAxisd(0.4, Vec3(1.0, 0.7, 0.3).normalized()) * Eigen::Translation3d(-middle);
}

Board charuco() {
  Board board;
  board.kind = Board::Kind::kCharuco;
  board.columns = 8;
  board.rows = 5;
  board.square_m = 0.03;
  board.marker_m = 0.0225;
  return board;
}

Board chessboard() {
  Board board;
  board.columns = 8;
  board.rows = 5;
  board.square_m = 0.03;
  return board;
}

/// RMS distance from where the corners truly are [px].
double errorOf(const BoardCorners& found, const Board& board, const Eigen::Isometry3d& pose) {
  const CameraModel model = camera().model();
  const Points3 corners = board.cornerPositions();
  double sum = 0.0;
  for (std::size_t i = 0; i < found.ids.size(); ++i) {
    const auto truth = model.project(pose * Vec3(corners.col(found.ids[i])));
    sum += (*truth - found.pixels.col(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(found.ids.size()));
}

TEST(BoardDetectorTest, FindsThePrintedChessboard) {
  std::mt19937_64 random(1);
  const Board board = chessboard();
  const auto pose = tilted(board);
  const ByteImage photo = photographSheet(print(board, 8.0), camera(), pose, kGreyNoise, random);
  const auto found = detectBoard(photo, board);
  ASSERT_TRUE(found.ok()) << found.error().message();
  EXPECT_EQ(found->ids.size(), 40u);
  EXPECT_LT(errorOf(*found, board, pose), kCornerError_px);
}

TEST(BoardDetectorTest, FindsThePrintedCharucoBoardEvenInPart) {
  std::mt19937_64 random(2);
  const Board board = charuco();
  const auto sheet = print(board, 8.0);
  const auto whole =
      detectBoard(photographSheet(sheet, camera(), tilted(board), kGreyNoise, random), board);
  ASSERT_TRUE(whole.ok()) << whole.error().message();
  EXPECT_EQ(whole->ids.size(), 40u);
  EXPECT_LT(errorOf(*whole, board, tilted(board)), kCornerError_px);

  const auto aside = tilted(board, {0.12, 0.05});
  const auto part = detectBoard(photographSheet(sheet, camera(), aside, kGreyNoise, random), board);
  ASSERT_TRUE(part.ok()) << part.error().message();
  EXPECT_GE(part->ids.size(), 8u);
  EXPECT_LT(part->ids.size(), 40u);
  EXPECT_LT(errorOf(*part, board, aside), kCornerError_px);
}

TEST(BoardDetectorTest, SaysWhatItDoesNotSee) {
  const ByteImage blank{320, 240, std::vector<std::uint8_t>(320 * 240, 128)};
  EXPECT_THAT(detectBoard(blank, chessboard()).error().reason,
              HasSubstr("no chessboard with 8 x 5 inner corners"));
  EXPECT_THAT(detectBoard(blank, charuco()).error().reason, HasSubstr("no marker"));
  const ByteImage tiny{8, 8, std::vector<std::uint8_t>(64, 0)};
  EXPECT_FALSE(detectBoard(tiny, chessboard()).ok());
  EXPECT_FALSE(detectBoard(tiny, charuco()).ok());
}

TEST(BoardDetectorTest, DoesNotTakeAPartOfALargerBoardAndTellsItsCount) {
  std::mt19937_64 random(3);
  const Board board = chessboard();
  const ByteImage photo =
      photographSheet(print(board, 8.0), camera(), tilted(board), kGreyNoise, random);
  for (const auto& [columns, rows] : {std::pair(7, 5), {9, 6}}) {
    Board asked = board;
    asked.columns = columns;
    asked.rows = rows;
    EXPECT_FALSE(detectBoard(photo, asked).ok()) << columns << " x " << rows;
    const auto told = otherCornerCount(photo, asked);
    ASSERT_TRUE(told.has_value()) << columns << " x " << rows;
    EXPECT_EQ(std::max(told->first, told->second), 8);
    EXPECT_EQ(std::min(told->first, told->second), 5);
  }
}

}  // namespace
}  // namespace tenter
