// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>

#include "tenter/calib/board_detector.h"

namespace tenter {

Result<BoardCorners> detectChessboard(const cv::Mat& image, const Board& board);
Result<BoardCorners> detectCharuco(const cv::Mat& image, const Board& board);

}  // namespace tenter
