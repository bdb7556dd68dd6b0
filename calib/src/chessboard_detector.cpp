// SPDX-License-Identifier: GPL-3.0-or-later
#include "chessboard_detector.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "corner_refinement.h"

namespace tenter {

namespace {

/// Boards are looked for in images of at most this size; only corners are refined in larger ones.
constexpr double kSearchSide_px = 1400.0;

struct SearchImage {
  cv::Mat image;
  double scale = 1.0;  ///< Full size over search size.
};

SearchImage reduced(const cv::Mat& image, double side_px) {
  const double longer = std::max(image.cols, image.rows);
  if (longer <= side_px) return {image, 1.0};
  SearchImage small;
  cv::resize(image, small.image, cv::Size(), side_px / longer, side_px / longer, cv::INTER_AREA);
  small.scale = static_cast<double>(image.cols) / small.image.cols;
  return small;
}

/// The classic search, then the slower one that sees through blur and uneven light.
bool findGrid(const cv::Mat& image, const cv::Size& grid, std::vector<cv::Point2f>& corners) {
  if (cv::findChessboardCorners(image, grid, corners,
                                cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return true;
  }
  const bool symmetric_search_works = grid.width > 2 && grid.height > 2;
  return symmetric_search_works &&
         cv::findChessboardCornersSB(image, grid, corners, cv::CALIB_CB_NORMALIZE_IMAGE);
}

bool insideWithMargin(const std::vector<cv::Point2f>& corners, const cv::Mat& image) {
  return std::all_of(corners.begin(), corners.end(), [&](const cv::Point2f& c) {
    return std::isfinite(c.x) && std::isfinite(c.y) && c.x >= 1 && c.y >= 1 &&
           c.x <= static_cast<float>(image.cols - 2) && c.y <= static_cast<float>(image.rows - 2);
  });
}

/// Mean grey level around a point; nothing near the image's rim.
std::optional<double> levelAt(const cv::Mat& image, const cv::Point2d& point) {
  const cv::Rect patch(static_cast<int>(point.x) - 1, static_cast<int>(point.y) - 1, 3, 3);
  if ((patch & cv::Rect(0, 0, image.cols, image.rows)) != patch) return std::nullopt;
  return cv::mean(image(patch))[0];
}

/// Whether the four cells around a place of the grid are the black and white of an inner corner.
/// On the board's rim the outer two cells are alike, inside they differ as much as the inner two.
bool looksLikeCorner(const cv::Mat& image, const cv::Matx33d& pixels_from_grid, int column,
                     int row) {
  constexpr double kLeastContrast = 20.0, kAlike = 0.5;
  double level[4];
  for (int i = 0; i < 4; ++i) {
    const cv::Vec3d at =
        pixels_from_grid * cv::Vec3d(column + (i % 2) - 0.5, row + (i / 2) - 0.5, 1.0);
    const auto found = levelAt(image, {at[0] / at[2], at[1] / at[2]});
    if (!found) return false;
    level[i] = *found;
  }
  const double contrast = 0.5 * std::abs(level[0] + level[3] - level[1] - level[2]);
  return contrast > kLeastContrast && std::abs(level[0] - level[3]) < kAlike * contrast &&
         std::abs(level[1] - level[2]) < kAlike * contrast;
}

/// Whether inner corners go on beyond those found: then they are a part of a larger board, and
/// which part is anybody's guess.
bool goesOn(const cv::Mat& image, const Board& board, const std::vector<cv::Point2f>& corners) {
  constexpr double kMost = 0.8;
  std::vector<cv::Point2f> grid;
  for (int i = 0; i < board.cornerCount(); ++i) {
    grid.emplace_back(static_cast<float>(i % board.columns), static_cast<float>(i / board.columns));
  }
  const cv::Mat homography = cv::findHomography(grid, corners);
  if (homography.empty()) return false;
  const cv::Matx33d pixels_from_grid(homography.ptr<double>());
  for (const int row : {-1, board.rows}) {
    int like = 0;
    for (int i = 0; i < board.columns; ++i)
      like += looksLikeCorner(image, pixels_from_grid, i, row);
    if (like > kMost * board.columns) return true;
  }
  for (const int column : {-1, board.columns}) {
    int like = 0;
    for (int i = 0; i < board.rows; ++i)
      like += looksLikeCorner(image, pixels_from_grid, column, i);
    if (like > kMost * board.rows) return true;
  }
  return false;
}

cv::Mat viewOf(const ByteImage& image) {
  return {image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.pixels.data())};
}

}  // namespace

Result<BoardCorners> detectChessboard(const cv::Mat& image, const Board& board) {
  const SearchImage search = reduced(image, kSearchSide_px);
  std::vector<cv::Point2f> corners;
  const cv::Size grid(board.columns, board.rows);
  if (!findGrid(search.image, grid, corners)) {
    return badInput("", "",
                    "no chessboard with " + std::to_string(board.columns) + " x " +
                        std::to_string(board.rows) + " inner corners is seen whole");
  }
  if (goesOn(search.image, board, corners)) {
    return badInput("", "",
                    "the chessboard goes on beyond " + std::to_string(board.columns) + " x " +
                        std::to_string(board.rows) + " inner corners");
  }
  if (search.scale > 1.0) {
    // Sharpened at the small size first, so that the window at full size holds the corner.
    refineGridCorners(search.image, board.columns, corners);
    for (cv::Point2f& c : corners) {
      c.x = static_cast<float>((c.x + 0.5) * search.scale - 0.5);
      c.y = static_cast<float>((c.y + 0.5) * search.scale - 0.5);
    }
  }
  if (insideWithMargin(corners, image)) refineGridCorners(image, board.columns, corners);
  if (!insideWithMargin(corners, image)) {
    return badInput("", "", "the board reaches beyond the image");
  }
  BoardCorners found;
  found.pixels.resize(2, board.cornerCount());
  for (int i = 0; i < board.cornerCount(); ++i) {
    found.ids.push_back(i);
    found.pixels.col(i) = Vec2(corners[i].x, corners[i].y);
  }
  return found;
}

Result<BoardCorners> detectBoard(const ByteImage& image, const Board& board) {
  require(validateBoard(board).ok(), "detectBoard takes a valid board");
  try {
    return board.kind == Board::Kind::kCharuco ? detectCharuco(viewOf(image), board)
                                               : detectChessboard(viewOf(image), board);
  } catch (const cv::Exception&) {
    return badInput("", "", "the search for the board failed");
  }
}

std::optional<std::pair<int, int>> otherCornerCount(const ByteImage& image, const Board& board) {
  constexpr double kSide_px = 800.0;
  constexpr int kReach = 2;
  const SearchImage search = reduced(viewOf(image), kSide_px);
  // The nearest counts first: squares counted for corners, a row forgotten.
  for (int distance = 1; distance <= 2 * kReach; ++distance) {
    for (int columns = -kReach; columns <= kReach; ++columns) {
      for (int rows = -kReach; rows <= kReach; ++rows) {
        if (std::abs(columns) + std::abs(rows) != distance) continue;
        Board other = board;
        other.columns += columns;
        other.rows += rows;
        // The same grid turned by a quarter is no other count.
        const bool turned = other.columns == board.rows && other.rows == board.columns;
        if (other.columns < 3 || other.rows < 3 || turned) continue;
        std::vector<cv::Point2f> corners;
        const cv::Size grid(other.columns, other.rows);
        const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
        if (!cv::findChessboardCorners(search.image, grid, corners, flags)) continue;
        if (goesOn(search.image, other, corners)) continue;
        return std::pair(other.columns, other.rows);
      }
    }
  }
  return std::nullopt;
}

}  // namespace tenter
