// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <vector>

#include "tenter/calib/board.h"
#include "tenter/core/result.h"

namespace tenter {

/// A turn of the board that maps its grid of corners onto itself. Chessboards have it, and the
/// search for their corners may begin at either end.
struct BoardTurn {
  std::vector<int> id;  ///< Corner i of the turned board is corner id[i].
  Eigen::Isometry3d board_from_turned = Eigen::Isometry3d::Identity();
};
/// The identity first. ChArUco boards have no other.
std::vector<BoardTurn> boardTurns(const Board& board);

/// camera_from_board by set, one map a camera.
using BoardPoses = std::vector<std::map<int, Eigen::Isometry3d>>;

struct CameraPlacement {
  std::vector<Eigen::Isometry3d> camera_from_world;  ///< World: camera 0.
  /// By camera and set, which turn makes the image agree with the others.
  std::vector<std::map<int, std::size_t>> turns;
};

/// Chains cameras by the boards they see at the same time, the best connected first; between two
/// cameras the pose on which most sets agree. Error (place: number of the camera) if a camera
/// shares no set with those already placed.
Result<CameraPlacement> placeCameras(const BoardPoses& poses, const std::vector<BoardTurn>& turns);

}  // namespace tenter
