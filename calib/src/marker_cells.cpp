// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/marker_cells.h"

#include <opencv2/aruco.hpp>

#include "tenter/calib/board.h"

namespace tenter {

std::optional<ByteImage> markerCells(const std::string& dictionary_name, int id) {
  for (const MarkerDictionary& row : markerDictionaries()) {
    if (row.name != dictionary_name || id < 0 || id >= row.markers) continue;
    const auto dictionary = cv::aruco::getPredefinedDictionary(row.opencv_id);
    cv::Mat cells;
    cv::aruco::drawMarker(dictionary, id, dictionary->markerSize + 2, cells, 1);
    ByteImage out{cells.cols, cells.rows, {}};
    for (int y = 0; y < cells.rows; ++y) {
      for (int x = 0; x < cells.cols; ++x) {
        out.pixels.push_back(cells.at<unsigned char>(y, x) < 128 ? 0 : 255);
      }
    }
    return out;
  }
  return std::nullopt;
}

}  // namespace tenter
