// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/cord_finder.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tenter {

namespace {

/// Places along the cord at which it is looked for; its ends, at clip and pulley, are left out.
constexpr int kPlaces = 80;
constexpr double kFirst = 0.08, kLast = 0.92;
/// How far across the guess it is looked for, in its widths and at least [px].
constexpr double kReachWidths = 2.5, kLeastReach_px = 12.0;
constexpr double kStep_px = 0.5;
constexpr double kLeastContrast = 6.0;  ///< Grey levels over what is beside it.
constexpr int kLeastPlaces = 15;
constexpr double kStray = 3.0, kStrayFixed_px = 0.15;
constexpr int kMaxIterations = 15;
/// Part of the directions across the line that the views must see, smallest over largest.
constexpr double kLeastSpread = 1e-4;
/// What sampling leaves of a centre's error though it does not scatter [px].
constexpr double kCentreFloor_px = 0.03;

double bilinear(const GrayImage& image, const Vec2& at) {
  const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
  const double fx = at.x() - x, fy = at.y() - y;
  return (1.0 - fy) * ((1.0 - fx) * image.at(x, y) + fx * image.at(x + 1, y)) +
         fy * ((1.0 - fx) * image.at(x, y + 1) + fx * image.at(x + 1, y + 1));
}

bool inside(const GrayImage& image, const Vec2& at) {
  return at.x() >= 0.0 && at.y() >= 0.0 && at.x() < image.width - 1 && at.y() < image.height - 1;
}

struct Centre {
  int view;
  Vec2 pixel;
};

/// Middle of the stripe of about `width_px` along `across`: between its two edges, where the
/// profile rises and falls most. Offset from the middle [px].
std::optional<double> stripe(const GrayImage& image, const Vec2& middle, const Vec2& across,
                             double width_px, double reach_px) {
  const int half = static_cast<int>(reach_px / kStep_px);
  if (!inside(image, middle - half * kStep_px * across) ||
      !inside(image, middle + half * kStep_px * across)) {
    return std::nullopt;
  }
  std::vector<double> profile;
  for (int i = -half; i <= half; ++i)
    profile.push_back(bilinear(image, middle + i * kStep_px * across));
  // Correlate with a stripe of the right width between two borders of half that width.
  const int core = std::max(1, static_cast<int>(std::lround(0.5 * width_px / kStep_px)));
  const int border = std::max(2, core);
  std::vector<double> sums(profile.size() + 1);
  for (std::size_t i = 0; i < profile.size(); ++i) sums[i + 1] = sums[i] + profile[i];
  const auto mean = [&](int from, int to) { return (sums[to] - sums[from]) / (to - from); };
  std::vector<double> answer(profile.size());
  const int count = static_cast<int>(profile.size());
  int best = -1;
  for (int i = core + border; i + core + border < count; ++i) {
    const double in = mean(i - core, i + core + 1);
    const double left = mean(i - core - border, i - core),
                 right = mean(i + core + 1, i + core + border + 1);
    // It must stand out from both sides, the same way.
    const double over_left = in - left, over_right = in - right;
    const double out =
        over_left * over_right > 0.0 ? std::min(std::abs(over_left), std::abs(over_right)) : 0.0;
    answer[i] = out;
    if (best < 0 || out > answer[best]) best = i;
  }
  if (best < 0 || answer[best] < kLeastContrast * image.white / 255.0) return std::nullopt;
  // Sub-sample: middle of the two edges, each the centroid of its slopes.
  const double sign =
      mean(best - core, best + core + 1) > mean(best - core - border, best - core) ? 1.0 : -1.0;
  const auto edge = [&](int near, double slope_sign) -> std::optional<double> {
    double sum = 0.0, moment = 0.0;
    for (int i = std::max(near - border, 0); i < std::min(near + border, count - 1); ++i) {
      const double slope = std::max(0.0, slope_sign * sign * (profile[i + 1] - profile[i]));
      sum += slope;
      moment += slope * (i + 0.5);
    }
    if (!(sum > 0.0)) return std::nullopt;
    return moment / sum;
  };
  const auto rising = edge(best - core, 1.0), falling = edge(best + core, -1.0);
  if (!rising || !falling) return std::nullopt;
  return kStep_px * (0.5 * (*rising + *falling) - half);
}

std::vector<Centre> centresIn(const CameraView& view, int index, const GrayImage& image,
                              const CordGuess& guess) {
  std::vector<Centre> centres;
  std::vector<double> offsets;
  for (int i = 0; i < kPlaces; ++i) {
    const double share = kFirst + (kLast - kFirst) * i / (kPlaces - 1);
    const Vec3 point = guess.from_m + share * (guess.to_m - guess.from_m);
    Eigen::Matrix<double, 2, 3> jacobian;
    const auto pixel = view.project(point, &jacobian);
    if (!pixel || !inside(image, *pixel)) continue;
    const Vec2 along = (jacobian * (guess.to_m - guess.from_m)).normalized();
    const Vec2 across(-along.y(), along.x());
    const double depth_m = (view.camera_from_space * point).z();
    const double width_px = guess.diameter_m * view.model.lens().fx_px / depth_m;
    const double reach_px = std::max(kLeastReach_px, kReachWidths * width_px);
    const auto off = stripe(image, *pixel, across, width_px, reach_px);
    if (!off) continue;
    centres.push_back({index, *pixel + *off * across});
    offsets.push_back(*off);
  }
  if (static_cast<int>(centres.size()) < kLeastPlaces) return {};
  // The true line departs from the guess by a slowly growing offset: strays from a straight run of
  // offsets are something else.
  std::vector<double> sorted = offsets;
  std::sort(sorted.begin(), sorted.end());
  const double middle = sorted[sorted.size() / 2];
  std::vector<double> spread;
  for (const double off : offsets) spread.push_back(std::abs(off - middle));
  std::sort(spread.begin(), spread.end());
  const double limit = 2.0 * kStray * spread[spread.size() / 2] + kStrayFixed_px;
  std::vector<Centre> kept;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (std::abs(offsets[i] - middle) <= limit) kept.push_back(centres[i]);
  }
  return static_cast<int>(kept.size()) < kLeastPlaces ? std::vector<Centre>{} : kept;
}

/// A line a + t d; steps move a and d across the line.
struct Line {
  Vec3 point, direction;
  Eigen::Matrix<double, 3, 2> across() const {
    const Vec3 helper = std::abs(direction.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
    Eigen::Matrix<double, 3, 2> basis;
    basis.col(0) = direction.cross(helper).normalized();
    basis.col(1) = direction.cross(basis.col(0));
    return basis;
  }
};

/// Signed distance of a centre from the projected line [px] and its derivatives by the point's and
/// the direction's motion across the line.
bool distanceOf(const CameraView& view, const Line& line, const Vec2& pixel, double& distance,
                Eigen::Matrix<double, 1, 4>& jacobian) {
  const auto ray = view.direction(pixel);
  if (!ray) return false;
  // Place on the line nearest to the centre's ray.
  const Vec3 to = line.point - view.centre();
  const double b = ray->dot(line.direction), d = ray->dot(to), e = line.direction.dot(to);
  const double t = (b * d - e) / (1.0 - b * b);
  Eigen::Matrix<double, 2, 3> by_point;
  const auto near = view.project(line.point + t * line.direction, &by_point);
  if (!near) return false;
  const Vec2 along = (by_point * line.direction).normalized();
  const Vec2 normal(-along.y(), along.x());
  distance = normal.dot(pixel - *near);
  const Eigen::Matrix<double, 1, 2> moved = normal.transpose() * by_point * line.across();
  jacobian << moved, t * moved;
  return true;
}

}  // namespace

std::optional<CordLine> findCord(const std::vector<CameraView>& views,
                                 const std::vector<GrayImage>& images, const CordGuess& guess) {
  std::vector<Centre> centres;
  CordLine result;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (images[v].width == 0) continue;
    const auto found = centresIn(views[v], static_cast<int>(v), images[v], guess);
    result.views += static_cast<int>(!found.empty());
    centres.insert(centres.end(), found.begin(), found.end());
  }
  if (result.views < 2) return std::nullopt;
  Line line{0.5 * (guess.from_m + guess.to_m), (guess.to_m - guess.from_m).normalized()};
  Eigen::Matrix4d normal;
  std::vector<double> distances;
  for (int i = 0; i < kMaxIterations; ++i) {
    normal.setZero();
    Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
    double scale = kLeastReach_px;
    if (!distances.empty()) {
      std::vector<double> sorted;
      for (const double value : distances) sorted.push_back(std::abs(value));
      std::sort(sorted.begin(), sorted.end());
      scale = kStray * sorted[sorted.size() / 2] + kStrayFixed_px;
    }
    distances.clear();
    for (const Centre& centre : centres) {
      double distance = 0.0;
      Eigen::Matrix<double, 1, 4> jacobian;
      if (!distanceOf(views[centre.view], line, centre.pixel, distance, jacobian))
        return std::nullopt;
      distances.push_back(distance);
      const double weight = 1.0 / (1.0 + distance * distance / (scale * scale));
      normal += weight * jacobian.transpose() * jacobian;
      gradient += weight * distance * jacobian.transpose();
    }
    const Eigen::Vector4d step = normal.ldlt().solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    const auto across = line.across();
    line.point += across * step.head<2>();
    line.direction = (line.direction + across * step.tail<2>()).normalized();
  }
  const Eigen::Vector4d spread = Eigen::SelfAdjointEigenSolver<Mat2>(normal.topLeftCorner<2, 2>())
                                     .eigenvalues()
                                     .replicate<2, 1>();
  if (!(spread(0) > kLeastSpread * spread(1))) return std::nullopt;
  double squares = 0.0;
  for (const double distance : distances) squares += distance * distance;
  result.residual_px = std::sqrt(squares / static_cast<double>(distances.size()));
  const double sigma_px = std::hypot(result.residual_px, kCentreFloor_px);
  const Eigen::Matrix4d covariance =
      sigma_px * sigma_px * normal.ldlt().solve(Eigen::Matrix4d::Identity());
  result.angle_sigma_rad = std::sqrt(0.5 * covariance.bottomRightCorner<2, 2>().trace());
  result.point_m = line.point;
  result.direction = line.direction;
  return result;
}

}  // namespace tenter
