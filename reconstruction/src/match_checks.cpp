// SPDX-License-Identifier: GPL-3.0-or-later
#include "match_checks.h"

#include <algorithm>
#include <cmath>

#include "tenter/core/median.h"

namespace tenter {

namespace {

/// A subset with more of it at an end of the grey scale is not trusted. A texture may be printed in
/// black and white, which is at the ends in both images; what is there in one alone was cut off.
constexpr double kSaturatedShare = 0.5, kSaturatedChange = 0.1;
/// A camera that stops below the format's end piles up this share of its pixels on one value.
constexpr double kPile = 0.005;
/// What a match may differ from the median of its neighbours' predictions: in their own spread, in
/// its standard deviation, and by a fixed part [px] for curvature of the field.
constexpr double kSpreads = 2.0, kSigmas = 3.0, kFixed_px = 0.1;
constexpr std::size_t kLeastNeighbours = 2;

/// The end of the scale seen from one side: `format_end`, or an extreme on which pixels pile up.
float endOfScale(const std::vector<float>& pixels, float extreme, float format_end) {
  const auto pile = std::count(pixels.begin(), pixels.end(), extreme);
  return static_cast<double>(pile) > kPile * static_cast<double>(pixels.size()) ? extreme
                                                                                : format_end;
}

}  // namespace

SaturationMap::SaturationMap(const GrayImage& image)
    : width_(image.width),
      height_(image.height),
      sums_(static_cast<std::size_t>(image.width + 1) * (image.height + 1)) {
  const auto [least, most] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  const bool flat = *least == *most;
  const float black = flat ? 0.0F : endOfScale(image.pixels, *least, 0.0F);
  const float white = flat ? image.white : endOfScale(image.pixels, *most, image.white);
  const auto stride = static_cast<std::size_t>(width_) + 1;
  for (int y = 0; y < height_; ++y) {
    int row = 0;
    for (int x = 0; x < width_; ++x) {
      const float value = image.at(x, y);
      row += static_cast<int>(value <= black || value >= white);
      sums_[(y + 1) * stride + x + 1] = sums_[y * stride + x + 1] + row;
    }
  }
}

double SaturationMap::share(const Vec2& place, int side_px) const {
  const auto clamped = [](double value, int size) {
    return static_cast<std::size_t>(std::clamp(value, 0.0, static_cast<double>(size)));
  };
  const double half = 0.5 * side_px;
  const std::size_t left = clamped(place.x() - half, width_),
                    top = clamped(place.y() - half, height_);
  const std::size_t right = clamped(place.x() + half, width_);
  const std::size_t bottom = clamped(place.y() + half, height_);
  if (right <= left || bottom <= top) return 0.0;
  const auto stride = static_cast<std::size_t>(width_) + 1;
  const int count = sums_[bottom * stride + right] - sums_[top * stride + right] -
                    sums_[bottom * stride + left] + sums_[top * stride + left];
  return count / static_cast<double>((right - left) * (bottom - top));
}

double SaturationMap::share() const {
  return sums_.back() / (static_cast<double>(width_) * height_);
}

PointState MatchJudge::stateOf(const CorrelatedPoint& point) const {
  const SubsetMatch& match = point.match;
  const int side = options_.match.subset_px;
  const double before = reference_.share(point.position, side);
  double after = before;
  if (matched(match)) after = deformed_.share(point.position + match.warp.displacement(), side);
  if (std::max(before, after) > kSaturatedShare || std::abs(after - before) > kSaturatedChange) {
    return PointState::kSaturated;
  }
  switch (match.end) {
    case MatchEnd::kOutside:
      return PointState::kOutside;
    case MatchEnd::kNoTexture:
      return PointState::kNoTexture;
    case MatchEnd::kDiverged:
    case MatchEnd::kNotConverged:
      return PointState::kNotFound;
    case MatchEnd::kConverged:
      break;
  }
  if (!matched(match)) return PointState::kLowCorrelation;
  return point.sigma_px() <= options_.max_sigma_px ? PointState::kValid : PointState::kUncertain;
}

namespace {

/// Sums over means of 2 x 2 pixels, so that noise does not pass for sharpness.
class Sharpness {
 public:
  explicit Sharpness(const GrayImage& image) : image_(image) {}

  void add(int x, int y) {
    if (x < 0 || y < 0 || x + 3 >= image_.width || y + 3 >= image_.height) return;
    const double value = block(x, y);
    const double dx = 0.5 * (block(x + 2, y) - value), dy = 0.5 * (block(x, y + 2) - value);
    slopes_ += dx * dx + dy * dy;
    sum_ += value;
    squares_ += value * value;
    count_ += 1.0;
  }
  double value() const {
    const double variance = squares_ / count_ - sum_ * sum_ / (count_ * count_);
    return variance > 0.0 ? slopes_ / count_ / variance : 0.0;
  }

 private:
  double block(int x, int y) const {
    return 0.25 * (static_cast<double>(image_.at(x, y)) + image_.at(x + 1, y) +
                   image_.at(x, y + 1) + image_.at(x + 1, y + 1));
  }

  const GrayImage& image_;
  double slopes_ = 0.0, sum_ = 0.0, squares_ = 0.0, count_ = 0.0;
};

}  // namespace

double sharpnessOf(const GrayImage& image) {
  Sharpness sharpness(image);
  for (int y = 0; y + 3 < image.height; y += 2) {
    for (int x = 0; x + 3 < image.width; x += 2) sharpness.add(x, y);
  }
  return sharpness.value();
}

double sharpnessAround(const GrayImage& image, const std::vector<Vec2>& places) {
  constexpr int kReach_px = 4;
  Sharpness sharpness(image);
  for (const Vec2& place : places) {
    const int x = static_cast<int>(place.x()), y = static_cast<int>(place.y());
    for (int j = -kReach_px; j <= kReach_px; j += 2) {
      for (int i = -kReach_px; i <= kReach_px; i += 2) sharpness.add(x + i, y + j);
    }
  }
  return sharpness.value();
}

bool agreesWithNeighbours(const CorrelatedPoint& point,
                          const std::vector<const CorrelatedPoint*>& neighbours) {
  if (neighbours.size() < kLeastNeighbours) return false;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> predicted;
    for (const CorrelatedPoint* other : neighbours) {
      const Vec2 offset = point.position - other->position;
      const SubsetWarp& warp = other->match.warp;
      predicted.push_back(warp.displacement()[axis] +
                          ((warp.linear() - Mat2::Identity()) * offset)[axis]);
    }
    const double centre = medianOf(predicted);
    for (double& value : predicted) value = std::abs(value - centre);
    const double allowed = kFixed_px + kSpreads * medianOf(predicted) + kSigmas * point.sigma_px();
    if (std::abs(point.match.warp.displacement()[axis] - centre) > allowed) return false;
  }
  return true;
}

}  // namespace tenter
