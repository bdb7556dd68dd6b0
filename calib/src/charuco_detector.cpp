// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/SVD>
#include <algorithm>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>

#include "chessboard_detector.h"
#include "corner_refinement.h"

namespace tenter {

namespace {

constexpr int kMinCorners = 8;
/// Smallest over largest extent of the corners on the board: below it they lie on one line.
constexpr double kMinSpread = 0.1;
/// Corners this far from the homography of the rest, in squares, hang on misread markers.
constexpr double kMaxMisfitOfSquare = 0.12;

int dictionaryId(const std::string& name) {
  for (const MarkerDictionary& row : markerDictionaries()) {
    if (row.name == name) return row.opencv_id;
  }
  return 0;
}

double spread(const Points3& corners) {
  const Points2 plane = corners.topRows<2>();
  const Points2 centred = plane.colwise() - plane.rowwise().mean();
  const auto sizes = Eigen::JacobiSVD<Eigen::MatrixXd>(centred).singularValues();
  return sizes(0) > 0.0 ? sizes(1) / sizes(0) : 0.0;
}

/// Leaves out corners that do not go with the others. Lens distortion bends a board by far less
/// than a misread marker does.
void dropStrays(const Points3& board_points, double square_m, std::vector<int>& ids,
                std::vector<cv::Point2f>& pixels) {
  std::vector<cv::Point2f> plane;
  for (const int id : ids) {
    plane.emplace_back(static_cast<float>(board_points(0, id) / square_m),
                       static_cast<float>(board_points(1, id) / square_m));
  }
  const cv::Mat squares_from_pixels =
      cv::findHomography(pixels, plane, cv::RANSAC, kMaxMisfitOfSquare);
  if (squares_from_pixels.empty()) {
    ids.clear();
    pixels.clear();
    return;
  }
  std::vector<cv::Point2f> mapped;
  cv::perspectiveTransform(pixels, mapped, squares_from_pixels);
  std::vector<int> kept_ids;
  std::vector<cv::Point2f> kept;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!(cv::norm(mapped[i] - plane[i]) <= kMaxMisfitOfSquare)) continue;
    kept_ids.push_back(ids[i]);
    kept.push_back(pixels[i]);
  }
  ids = std::move(kept_ids);
  pixels = std::move(kept);
}

/// OpenCV 4.6 leaves these corners half a pixel to the right and below (measured). They are sought
/// again in a window that ends before the markers do.
void refineBetweenMarkers(const cv::Mat& image, const Board& board, const std::vector<int>& ids,
                          std::vector<cv::Point2f>& pixels) {
  constexpr double kOfMargin = 0.9;
  double spacing_px = 1e9;
  for (std::size_t i = 1; i < ids.size(); ++i) {
    const bool neighbours = ids[i] == ids[i - 1] + 1 && ids[i] % board.columns != 0;
    if (neighbours) spacing_px = std::min(spacing_px, cv::norm(pixels[i] - pixels[i - 1]));
  }
  for (cv::Point2f& pixel : pixels) pixel -= cv::Point2f(0.5F, 0.5F);
  const double margin = 0.5 * (1.0 - board.marker_m / board.square_m);
  refineCorners(image, kOfMargin * margin * spacing_px, pixels);
}

Result<BoardCorners> checked(const Board& board, std::size_t markers, const std::vector<int>& ids,
                             const std::vector<cv::Point2f>& pixels) {
  if (markers == 0) return badInput("", "", "no marker of the dictionary is seen");
  if (ids.size() < kMinCorners) {
    return badInput("", "",
                    "only " + std::to_string(ids.size()) + " of " +
                        std::to_string(board.cornerCount()) + " corners are seen");
  }
  const Points3 all = board.cornerPositions();
  Points3 seen(3, static_cast<Eigen::Index>(ids.size()));
  BoardCorners found{ids, Points2(2, seen.cols())};
  for (Eigen::Index i = 0; i < seen.cols(); ++i) {
    seen.col(i) = all.col(ids[i]);
    found.pixels.col(i) = Vec2(pixels[i].x, pixels[i].y);
  }
  if (spread(seen) < kMinSpread) {
    return badInput("", "", "the corners that are seen lie on one line");
  }
  return found;
}

}  // namespace

Result<BoardCorners> detectCharuco(const cv::Mat& image, const Board& board) {
  namespace aruco = cv::aruco;
  const auto dictionary = aruco::getPredefinedDictionary(dictionaryId(board.dictionary));
  const auto layout = aruco::CharucoBoard::create(board.columns + 1, board.rows + 1,
                                                  static_cast<float>(board.square_m),
                                                  static_cast<float>(board.marker_m), dictionary);
  auto parameters = aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = aruco::CORNER_REFINE_NONE;
  std::vector<std::vector<cv::Point2f>> markers, refused;
  std::vector<int> marker_ids;
  aruco::detectMarkers(image, dictionary, markers, marker_ids, parameters, refused);
  std::vector<int> ids;
  std::vector<cv::Point2f> pixels;
  if (!marker_ids.empty()) {
    aruco::interpolateCornersCharuco(markers, marker_ids, image, layout, pixels, ids);
    refineBetweenMarkers(image, board, ids, pixels);
  }
  if (ids.size() >= 4) dropStrays(board.cornerPositions(), board.square_m, ids, pixels);
  return checked(board, marker_ids.size(), ids, pixels);
}

}  // namespace tenter
