// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tenter/calib/board.h"
#include "tenter/core/files.h"
#include "tenter/twin/scene_renderer.h"

namespace tenter {

struct BoardImageOptions {
  int boards = 20;           ///< Poses; 3 to 1000. Number 0 lies level in the rig's plane.
  RigCameraOptions cameras;  ///< Those of a session of the same protocol, seed and size.
  RenderOptions render;      ///< Its seed is that of `cameras`.
  std::filesystem::path folder;
  std::filesystem::path truth;                               ///< Empty: the truth is not kept.
  std::function<void(double, const std::string&)> progress;  ///< May be empty.
  std::function<bool()> cancelled;                           ///< May be empty.
};

/// The board that is held into the virtual rig: 11 x 8 corners, 12 mm squares.
Board virtualBoard();

/// rig_from_board of every pose. The middle of board 0 is the rig's origin, its rows lie along x;
/// the others are tilted by up to 35 degrees and spread over the cameras' field.
std::vector<Eigen::Isometry3d> boardPoses(const BoardImageOptions& options);

/// What one board looks like to a camera.
ByteImage renderBoard(const Board& board, const Eigen::Isometry3d& rig_from_board,
                      const VirtualCamera& camera, const RenderOptions& options,
                      std::uint64_t number);

/// What tells a folder of board images from others.
const FolderKind& boardImageFolder();

/// Name of an image in the folder: "cam-1-000012.png".
std::string boardImageName(const std::string& camera, int index);

/// Renders all boards for all cameras into a folder that is complete or absent, with board.json
/// that says what the board is; the truth has cameras.json and, in truth.json, the poses. Errors:
/// options out of range, a folder that holds something else, kNotConverged when cancelled.
Result<void> writeBoardImages(const BoardImageOptions& options);

}  // namespace tenter
