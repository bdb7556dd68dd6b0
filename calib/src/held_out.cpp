// SPDX-License-Identifier: GPL-3.0-or-later
#include "held_out.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace tenter {

namespace {

constexpr std::size_t kFolds = 5, kLeastSets = 6;

struct Sums {
  double reprojection = 0.0, epipolar = 0.0, distance = 0.0, distance_max = 0.0;
  std::size_t corners = 0, lines = 0, distances = 0;
};

std::vector<int> setsOf(const Bundle& bundle) {
  std::set<int> sets;
  for (const BundleImage& image : bundle.images) sets.insert(image.set);
  return {sets.begin(), sets.end()};
}

/// The sets that a fold leaves out are spread over the sequence.
Bundle withImages(const Bundle& bundle, const std::set<int>& sets, bool inside) {
  Bundle part = bundle;
  std::erase_if(part.images,
                [&](const BundleImage& image) { return sets.contains(image.set) != inside; });
  return part;
}

/// Corner's sightings, by id, in one set.
using Sightings = std::map<int, std::vector<std::pair<int, Vec2>>>;

std::map<int, Sightings> sightingsBySet(const Bundle& bundle) {
  std::map<int, Sightings> out;
  for (const BundleImage& image : bundle.images) {
    for (std::size_t i = 0; i < image.corners.ids.size(); ++i) {
      out[image.set][image.corners.ids[i]].emplace_back(
          image.camera, image.corners.pixels.col(static_cast<Eigen::Index>(i)));
    }
  }
  return out;
}

/// Distance of b's corner from the epipolar line of a's, in pixels of b.
std::optional<double> epipolarDistance(const Sighting& a, const Sighting& b) {
  const auto in_a = a.model->normalized(a.pixel), in_b = b.model->normalized(b.pixel);
  if (!in_a || !in_b) return std::nullopt;
  const Eigen::Isometry3d b_from_a = b.camera_from_world * a.camera_from_world.inverse();
  const Vec3 line =
      Vec3(b_from_a.translation()).cross(Vec3(b_from_a.linear() * in_a->homogeneous()));
  const double length = line.head<2>().norm();
  if (!(length > 0.0)) return std::nullopt;
  return b.model->lens().fx_px * line.dot(in_b->homogeneous()) / length;
}

void addDistances(const Bundle& bundle, const std::map<int, Vec3>& points, Sums& sums) {
  const Points3 board = bundle.warpedBoard();
  std::vector<int> ids;
  for (const auto& [id, point] : points) ids.push_back(id);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const int a = ids[i], b = ids[(i + ids.size() / 2) % ids.size()];
    if (a == b) continue;
    const double known = (board.col(a) - board.col(b)).norm();
    const double error = (points.at(a) - points.at(b)).norm() - known;
    sums.distance += error * error;
    sums.distance_max = std::max(sums.distance_max, std::abs(error));
    ++sums.distances;
  }
}

/// Which cameras are usable models: fits that went astray are no cameras.
std::vector<CameraModel> modelsOf(const Bundle& bundle) {
  constexpr int kAnySize_px = 4096;  // sizes do not matter to rays
  std::vector<CameraModel> models;
  for (const LensVector& lens : bundle.lenses) {
    const auto model = CameraModel::make(kAnySize_px, kAnySize_px, lensOf(lens));
    if (!model) return {};
    models.push_back(*model);
  }
  return models;
}

void addStereo(const Bundle& bundle, Sums& sums) {
  const std::vector<CameraModel> models = modelsOf(bundle);
  if (models.size() < 2) return;
  for (const auto& [set, corners] : sightingsBySet(bundle)) {
    std::map<int, Vec3> points;
    for (const auto& [id, seen] : corners) {
      std::vector<Sighting> sightings;
      for (const auto& [camera, pixel] : seen) {
        sightings.push_back({&models[camera], poseOf(bundle.cameras[camera]), pixel});
      }
      for (std::size_t i = 1; i < sightings.size(); ++i) {
        const auto distance = epipolarDistance(sightings[i - 1], sightings[i]);
        if (!distance) continue;
        sums.epipolar += *distance * *distance;
        ++sums.lines;
      }
      if (const auto point = triangulate(sightings)) points[id] = *point;
    }
    addDistances(bundle, points, sums);
  }
}

std::optional<double> rootMean(double sum, std::size_t count) {
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

}  // namespace

std::optional<Vec3> triangulate(const std::vector<Sighting>& sightings) {
  if (sightings.size() < 2) return std::nullopt;
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Sighting& s : sightings) {
    const auto direction = s.model->normalized(s.pixel);
    if (!direction) return std::nullopt;
    const Eigen::Isometry3d world_from_camera = s.camera_from_world.inverse();
    const Vec3 ray = (world_from_camera.linear() * direction->homogeneous()).normalized();
    const Mat3 across = Mat3::Identity() - ray * ray.transpose();
    normal += across;
    right += across * world_from_camera.translation();
  }
  if (!(std::abs(normal.determinant()) > 1e-9)) return std::nullopt;
  Vec3 point = normal.ldlt().solve(right);
  constexpr int kSteps = 3;  // from the rays' point Gauss-Newton is there in two
  for (int step = 0; step < kSteps; ++step) {
    Mat3 information = Mat3::Zero();
    Vec3 gradient = Vec3::Zero();
    for (const Sighting& s : sightings) {
      Eigen::Matrix<double, 2, 3> jacobian;
      const auto pixel = s.model->project(s.camera_from_world * point, &jacobian);
      if (!pixel) return std::nullopt;
      jacobian = jacobian * s.camera_from_world.linear();
      information += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * (*pixel - s.pixel);
    }
    point -= information.ldlt().solve(gradient);
  }
  return point.allFinite() ? std::optional(point) : std::nullopt;
}

void measureHeldOut(const Bundle& fitted, const BundleOptions& options,
                    CalibrationQuality& quality) {
  const std::vector<int> sets = setsOf(fitted);
  if (sets.size() < kLeastSets) return;
  Sums sums;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::set<int> out;
    for (std::size_t i = fold; i < sets.size(); i += kFolds) out.insert(sets[i]);
    Bundle training = withImages(fitted, out, false);
    solveBundle(training, options);
    Bundle held = withImages(fitted, out, true);
    held.lenses = training.lenses;
    held.cameras = training.cameras;
    held.warp_m = training.warp_m;
    BundleOptions only_boards = options;
    only_boards.fit_lenses = only_boards.fit_cameras = only_boards.fit_warp = false;
    solveBundle(held, only_boards);
    for (const BundleImage& image : held.images) {
      sums.reprojection += held.residuals(image).squaredNorm();
      sums.corners += image.corners.ids.size();
    }
    addStereo(held, sums);
  }
  quality.held_out_rms_px = rootMean(sums.reprojection, sums.corners);
  quality.epipolar_rms_px = rootMean(sums.epipolar, sums.lines);
  quality.distance_rms_m = rootMean(sums.distance, sums.distances);
  if (sums.distances > 0) quality.distance_max_m = sums.distance_max;
}

}  // namespace tenter
