// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "tenter/reconstruction/subset_matcher.h"

namespace tenter {

/// Finds pieces of the reference in the deformed image from nothing, by normalised
/// cross-correlation with a template.
class SeedSearch {
 public:
  enum class Reach {
    kNear,    ///< Around the guess.
    kAll,     ///< Anywhere, neither turned nor stretched.
    kTurned,  ///< Anywhere, turned or stretched.
  };
  struct Repeat {
    Vec2 offset_px;  ///< From the piece to where the reference shows it again.
    double zncc;
  };

  /// Holds references to the images, which must outlive it.
  SeedSearch(const GrayImage& reference, const GrayImage& deformed, int subset_px);

  /// Candidates for the warp around `point`, best first, at most three.
  std::vector<SubsetWarp> find(const Vec2& point, const SubsetWarp& guess, Reach reach) const;

  /// Where the reference shows the piece around `point` best a second time.
  std::optional<Repeat> repeatOf(const Vec2& point) const;

 private:
  struct Peak {
    cv::Point place;
    double zncc;
  };
  std::optional<cv::Mat> templateAround(const Vec2& point, const Mat2& linear) const;
  static std::vector<Peak> peaks(const cv::Mat& image, const cv::Mat& piece, std::size_t count);

  cv::Mat reference_, deformed_;
  int half_px_;
};

}  // namespace tenter
