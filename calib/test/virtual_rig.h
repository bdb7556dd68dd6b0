// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras and boards of numbers: what they would see, exactly or with noise.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "bundle.h"
#include "tenter/calib/calibrate_cameras.h"

namespace tenter::virtual_rig {

struct Camera {
  std::string name;
  int width_px = 1600, height_px = 1200;
  LensVector lens = LensVector::Zero();
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();

  CameraModel model() const { return *CameraModel::make(width_px, height_px, lensOf(lens)); }
};

inline LensVector lens(double focal_px, double cx_px, double cy_px) {
  LensVector out;
  out << focal_px, focal_px * 1.002, cx_px, cy_px, -0.12, 0.09, 6e-4, -4e-4, -0.02;
  return out;
}

/// `count` cameras 0.25 m apart that look at a point 0.7 m before the first.
inline std::vector<Camera> cameras(int count) {
  std::vector<Camera> out;
  for (int i = 0; i < count; ++i) {
    Camera camera;
    camera.name = "c" + std::to_string(i);
    camera.lens = lens(2300.0 + 20.0 * i, 803.0 - 5.0 * i, 597.0 + 4.0 * i);
    const Eigen::Isometry3d world_from_camera =
        Eigen::Translation3d(0.0, 0.0, 0.7) *
        Eigen::AngleAxisd(0.35 * i, Vec3(0.1, 1.0, 0.05).normalized()) *
        Eigen::Translation3d(0.0, 0.0, -0.7);
    camera.camera_from_world = world_from_camera.inverse();
    out.push_back(camera);
  }
  return out;
}

inline Board chessboard() {
  Board board;
  board.columns = 8;
  board.rows = 6;
  board.square_m = 0.02;
  return board;
}

/// A pose before the cameras, tilted by up to `tilt_rad` about a random axis.
inline Eigen::Isometry3d boardPose(const Board& board, std::mt19937_64& random, double tilt_rad) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Vec3 middle = board.cornerPositions().rowwise().mean();
  const Vec3 axis = Vec3(unit(random), unit(random), 0.3 * unit(random)).normalized();
  const Vec3 place(0.05 * unit(random), 0.035 * unit(random), 0.7 + 0.06 * unit(random));
  return Eigen::Translation3d(place) * Eigen::AngleAxisd(tilt_rad * unit(random), axis) *
         Eigen::Translation3d(-middle);
}

/// What the cameras see of boards in these poses; corners outside of an image are not seen.
inline std::vector<CameraPhotos> photograph(const Board& board, const std::vector<Camera>& cameras,
                                            const std::vector<Eigen::Isometry3d>& world_from_board,
                                            double noise_px, std::mt19937_64& random,
                                            const Vec2& warp_m = Vec2::Zero()) {
  std::normal_distribution<double> noise(0.0, 1.0);
  Bundle shape;
  shape.board_m = board.cornerPositions();
  shape.warp_m = warp_m;
  const Points3 corners = shape.warpedBoard();
  std::vector<CameraPhotos> out;
  for (const Camera& camera : cameras) {
    CameraPhotos photos{camera.name, camera.width_px, camera.height_px, {}, {}};
    const CameraModel model = camera.model();
    for (std::size_t set = 0; set < world_from_board.size(); ++set) {
      BoardPhoto photo;
      photo.file = camera.name + "-" + std::to_string(set) + ".png";
      photo.index = static_cast<int>(set);
      std::vector<Vec2> pixels;
      for (int id = 0; id < board.cornerCount(); ++id) {
        const Vec3 point =
            camera.camera_from_world * (world_from_board[set] * Vec3(corners.col(id)));
        const auto pixel = model.project(point);
        if (!pixel || !model.contains(*pixel)) continue;
        photo.corners.ids.push_back(id);
        pixels.push_back(*pixel + noise_px * Vec2(noise(random), noise(random)));
      }
      photo.corners.pixels.resize(2, static_cast<Eigen::Index>(pixels.size()));
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        photo.corners.pixels.col(static_cast<Eigen::Index>(i)) = pixels[i];
      }
      photos.photos.push_back(std::move(photo));
    }
    out.push_back(std::move(photos));
  }
  return out;
}

inline std::vector<Eigen::Isometry3d> boardPoses(const Board& board, int count,
                                                 std::mt19937_64& random, double tilt_rad = 0.7) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) poses.push_back(boardPose(board, random, tilt_rad));
  return poses;
}

}  // namespace tenter::virtual_rig
