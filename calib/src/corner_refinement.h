// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace tenter {

/// Moves corners of a grid to where the gradients meet, with a window of a quarter of the distance
/// to the nearest neighbour: large windows average noise away, larger ones reach the next corner's
/// edges. On the old JPEGs of OpenCV's documentation a quarter is best, 7 px there.
/// @param columns  of the grid; corners are row by row.
void refineGridCorners(const cv::Mat& image, int columns, std::vector<cv::Point2f>& corners);

/// The same with a window that is given, from 2 to 30 px to each side.
void refineCorners(const cv::Mat& image, double half_window_px, std::vector<cv::Point2f>& corners);

}  // namespace tenter
