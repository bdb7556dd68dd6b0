// SPDX-License-Identifier: GPL-3.0-or-later
#include "coarse_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "eight_bits.h"
#include "semi_global.h"

namespace tenter {

namespace {

/// Angle between two cameras' axes at which a pair is best, and beyond which it is of no use.
constexpr double kBestAngle_rad = 20.0 * std::numbers::pi / 180.0;
constexpr double kWidestAngle_rad = 75.0 * std::numbers::pi / 180.0;
constexpr int kStep_px = 2;
constexpr int kPlaneRounds = 20;

struct Pair {
  int a, b;
  double cost;  ///< Departure from the best angle [rad].
};

/// Angle under which a point well before both cameras sees them.
double angleBetween(const CameraView& a, const CameraView& b) {
  const Vec3 ahead_a = a.camera_from_space.linear().row(2),
             ahead_b = b.camera_from_space.linear().row(2);
  return std::acos(std::clamp(ahead_a.dot(ahead_b), -1.0, 1.0));
}

/// Pairs, best first, in which no view occurs oftener than needed for all to take part.
std::vector<Pair> choosePairs(const std::vector<CameraView>& views,
                              const std::vector<GrayImage>& images) {
  std::vector<Pair> all, chosen;
  const int count = static_cast<int>(views.size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      const double angle = angleBetween(views[a], views[b]);
      if (images[a].width == 0 || images[b].width == 0 || angle > kWidestAngle_rad) continue;
      all.push_back({a, b, std::abs(angle - kBestAngle_rad)});
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Pair& p, const Pair& q) { return p.cost < q.cost; });
  std::vector<int> uses(views.size());
  for (const Pair& pair : all) {
    if (uses[pair.a] > 0 && uses[pair.b] > 0) continue;
    chosen.push_back(pair);
    ++uses[pair.a];
    ++uses[pair.b];
  }
  return chosen;
}

void addPoints(const std::vector<SeenPoint>& points, const CameraView& view, CoarseCloud& cloud,
               std::vector<double>& pixel_sizes) {
  const Vec3 centre = view.centre();
  const double focal_px = 0.5 * (view.model.lens().fx_px + view.model.lens().fy_px);
  for (const SeenPoint& point : points) {
    cloud.points_m.push_back(point.position_m);
    pixel_sizes.push_back((point.position_m - centre).norm() / focal_px);
  }
}

Vec3 medianPoint(const std::vector<Vec3>& points) {
  Vec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vec3& point : points) values.push_back(point[axis]);
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), at, values.end());
    middle[axis] = *at;
  }
  return middle;
}

}  // namespace

Result<CoarseCloud> coarseCloud(const std::vector<CameraView>& views,
                                const std::vector<GrayImage>& images,
                                const std::function<bool()>& keep_going, const FlatPrior* prior) {
  std::vector<cv::Mat> pixels;
  for (const GrayImage& image : images) {
    pixels.push_back(image.width > 0 ? eightBits(image) : cv::Mat());
  }
  CoarseCloud cloud;
  std::vector<double> pixel_sizes;
  Error last = badInput("", "",
                        "no two cameras look at one place from directions less than 75 "
                        "degrees apart",
                        "is the calibration that of these cameras?");
  for (const Pair& pair : choosePairs(views, images)) {
    if (keep_going && !keep_going()) return notConverged("stopped by the user");
    const auto points = semiGlobalPoints(views[pair.a], pixels[pair.a], views[pair.b],
                                         pixels[pair.b], kStep_px, prior);
    if (points) {
      addPoints(*points, views[pair.a], cloud, pixel_sizes);
    } else {
      last = points.error();
      cloud.warnings.push_back(points.error().message());
    }
  }
  if (cloud.points_m.empty()) return last;
  const auto middle = pixel_sizes.begin() + static_cast<std::ptrdiff_t>(pixel_sizes.size() / 2);
  std::nth_element(pixel_sizes.begin(), middle, pixel_sizes.end());
  cloud.pixel_m = *middle;
  return cloud;
}

Eigen::Isometry3d planeOf(const CoarseCloud& cloud, const std::vector<CameraView>& views) {
  Vec3 middle = medianPoint(cloud.points_m), normal = Vec3::UnitZ();
  std::vector<double> weights(cloud.points_m.size(), 1.0);
  for (int round = 0; round < kPlaneRounds; ++round) {
    Vec3 sum = Vec3::Zero();
    double total = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      sum += weights[i] * cloud.points_m[i];
      total += weights[i];
    }
    middle = sum / total;
    Mat3 scatter = Mat3::Zero();
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const Vec3 d = cloud.points_m[i] - middle;
      scatter += weights[i] * d * d.transpose();
    }
    normal = Eigen::SelfAdjointEigenSolver<Mat3>(scatter).eigenvectors().col(0);
    std::vector<double> off;
    for (const Vec3& point : cloud.points_m) off.push_back(std::abs(normal.dot(point - middle)));
    std::vector<double> sorted = off;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), at, sorted.end());
    const double scale = std::max(3.0 * *at, cloud.pixel_m);
    for (std::size_t i = 0; i < off.size(); ++i) {
      weights[i] = 1.0 / (1.0 + (off[i] / scale) * (off[i] / scale));
    }
  }
  Vec3 towards = Vec3::Zero();
  for (const CameraView& view : views) towards += view.centre() - middle;
  if (normal.dot(towards) < 0.0) normal = -normal;
  const Vec3 columns = views.front().camera_from_space.linear().row(0);
  const Vec3 x = (columns - columns.dot(normal) * normal).normalized();
  Eigen::Isometry3d space_from_plane = Eigen::Isometry3d::Identity();
  space_from_plane.linear() << x, normal.cross(x), normal;
  space_from_plane.translation() = middle;
  return space_from_plane;
}

}  // namespace tenter
