// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/board_images.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "exposure.h"
#include "random_numbers.h"
#include "tenter/twin/capture.h"

namespace tenter {
namespace {

constexpr const char* kBoardFile = "board.json";
constexpr const char* kBoardFormat = "tenter-board-images";
constexpr double kMaxTilt_rad = 35.0 / 180.0 * std::numbers::pi;
constexpr double kSpread_m = 0.045;  // of boards' middles over the field
constexpr double kDepth_m = 0.030;
constexpr double kMargin = 0.5;  // white paper around the squares, in squares
constexpr double kPixelsAMetre = 1e4;

Vec3 middleOf(const Board& board) {
  return {0.5 * board.square_m * (board.columns - 1), 0.5 * board.square_m * (board.rows - 1), 0.0};
}

/// Face up and level at the origin, x along the rows: the board's z points into it.
Eigen::Isometry3d levelPose(const Board& board) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Vec3(1.0, -1.0, -1.0).asDiagonal();
  pose.translation() = -(pose.linear() * middleOf(board));
  return pose;
}

Eigen::Isometry3d tiltedPose(const Board& board, const Vec3& focus, RandomNumbers& random) {
  const auto symmetric = [&] { return 2.0 * random.uniform() - 1.0; };
  const double direction = 2.0 * std::numbers::pi * random.uniform();
  const double tilt = kMaxTilt_rad * std::sqrt(random.uniform());
  const double turn = std::numbers::pi * symmetric();
  const Vec3 middle =
      focus + Vec3(kSpread_m * symmetric(), kSpread_m * symmetric(), kDepth_m * symmetric());
  const Vec3 axis(std::cos(direction), std::sin(direction), 0.0);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      (Eigen::AngleAxisd(tilt, axis) * Eigen::AngleAxisd(turn, Vec3::UnitZ())).toRotationMatrix() *
      levelPose(board).linear();
  pose.translation() = middle - pose.linear() * middleOf(board);
  return pose;
}

/// The paper with the board on it.
RayMesh paperOf(const Board& board, const Eigen::Isometry3d& rig_from_board) {
  const double margin = (1.0 + kMargin) * board.square_m;
  const Vec2 low(-margin, -margin);
  const Vec2 high(board.square_m * (board.columns - 1) + margin,
                  board.square_m * (board.rows - 1) + margin);
  const std::array<Vec2, 4> places = {low, Vec2(low.x(), high.y()), high, Vec2(high.x(), low.y())};
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i)
    corners[i] = rig_from_board * Vec3(places[i].x(), places[i].y(), 0.0);
  RayMesh mesh;
  mesh.addQuad(corners, places, 0);
  return mesh;
}

nlohmann::json boardJson(const Board& board) {
  return {{"format", kBoardFormat},        {"kind", nameOf(board.kind)},
          {"columns", board.columns},      {"rows", board.rows},
          {"square_m", board.square_m},    {"marker_m", board.marker_m},
          {"dictionary", board.dictionary}};
}

nlohmann::json posesJson(const std::vector<Eigen::Isometry3d>& poses) {
  nlohmann::json list = nlohmann::json::array();
  for (const Eigen::Isometry3d& pose : poses) {
    nlohmann::json rows = nlohmann::json::array();
    for (int row = 0; row < 3; ++row)
      rows.push_back({pose.linear()(row, 0), pose.linear()(row, 1), pose.linear()(row, 2)});
    const Vec3 place = pose.translation();
    list.push_back({{"rotation", rows}, {"translation_m", {place.x(), place.y(), place.z()}}});
  }
  return list;
}

Result<void> renderAll(const BoardImageOptions& options, const std::vector<VirtualCamera>& cameras,
                       const std::vector<Eigen::Isometry3d>& poses,
                       const std::filesystem::path& inside) {
  const Board board = virtualBoard();
  RenderOptions render = options.render;
  render.seed = options.cameras.seed;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (const VirtualCamera& camera : cameras) {
      if (options.cancelled && options.cancelled()) {
        return notConverged("stopped; nothing was written");
      }
      const ByteImage image = renderBoard(board, poses[i], camera, render, i);
      const auto name = boardImageName(camera.name, static_cast<int>(i));
      auto done = writeFileAtomically(inside / name, encodePng(image, kPixelsAMetre));
      if (!done) return done;
    }
    if (options.progress) {
      options.progress(static_cast<double>(i + 1) / static_cast<double>(poses.size()),
                       "board " + std::to_string(i + 1) + " of " + std::to_string(poses.size()));
    }
  }
  return writeFileAtomically(inside / kBoardFile, boardJson(board).dump(2) + "\n");
}

Result<void> writeBoardTruth(const BoardImageOptions& options,
                             const std::vector<VirtualCamera>& cameras,
                             const std::vector<Eigen::Isometry3d>& poses) {
  const nlohmann::json truth{{"protocol", options.cameras.protocol},
                             {"seed", options.cameras.seed},
                             {"rig_from_board", posesJson(poses)}};
  return writeFolderAtomically(
      options.truth, truthFolder(), [&](const std::filesystem::path& inside) -> Result<void> {
        const auto exact = calibrationOf(cameras, rigFocus(options.cameras.protocol), 0.0, 1);
        if (auto done = writeCalibration(inside / "cameras.json", exact); !done) return done;
        return writeFileAtomically(inside / "truth.json", truth.dump(2) + "\n");
      });
}

}  // namespace

Board virtualBoard() { return {Board::Kind::kCharuco, 11, 8, 0.012, 0.009, "4x4_100"}; }

std::vector<Eigen::Isometry3d> boardPoses(const BoardImageOptions& options) {
  const Board board = virtualBoard();
  const Vec3 focus = rigFocus(options.cameras.protocol);
  RandomNumbers random(options.cameras.seed, "boards");
  std::vector<Eigen::Isometry3d> poses = {levelPose(board)};
  while (static_cast<int>(poses.size()) < options.boards)
    poses.push_back(tiltedPose(board, focus, random));
  return poses;
}

ByteImage renderBoard(const Board& board, const Eigen::Isometry3d& rig_from_board,
                      const VirtualCamera& camera, const RenderOptions& options,
                      std::uint64_t number) {
  const CellPattern pattern(board);
  const auto device = RayDevice::make();
  require(device.ok(), "renderBoard: the ray tracer starts on this processor");
  const RayScene scene(*device, {{kWhiteAlbedo, &pattern}}, {paperOf(board, rig_from_board)});
  return expose(scene, camera, PixelDirections(camera.model), options, number);
}

const FolderKind& boardImageFolder() {
  static const FolderKind kKind{kBoardFile, kBoardFormat, {"*.png"}};
  return kKind;
}

std::string boardImageName(const std::string& camera, int index) {
  const std::string number = std::to_string(index);
  return camera + "-" + std::string(6 - std::min<std::size_t>(6, number.size()), '0') + number +
         ".png";
}

Result<void> writeBoardImages(const BoardImageOptions& options) {
  if (options.boards < 3 || options.boards > 1000) return usageError("3 to 1000 boards");
  const auto cameras = rigCameras(options.cameras);
  if (!cameras) return cameras.error();
  if (auto device = RayDevice::make(); !device) return device.error();
  const auto poses = boardPoses(options);
  auto written = writeFolderAtomically(options.folder, boardImageFolder(),
                                       [&](const std::filesystem::path& inside) {
                                         return renderAll(options, *cameras, poses, inside);
                                       });
  if (!written || options.truth.empty()) return written;
  return writeBoardTruth(options, *cameras, poses);
}

}  // namespace tenter
