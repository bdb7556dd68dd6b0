// SPDX-License-Identifier: GPL-3.0-or-later
#include "camera_graph.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace tenter {

namespace {

/// Two estimates of a camera's pose agree within this angle and this part of the board's distance.
constexpr double kSameAngle_rad = 0.06, kSameDistance = 0.08;

struct Difference {
  double angle_rad, distance_m;
};

Difference difference(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::AngleAxisd rotation(Mat3(a.linear() * b.linear().transpose()));
  return {std::abs(rotation.angle()),
          (a.inverse().translation() - b.inverse().translation()).norm()};
}

/// How two cameras, one of them placed, see one set: b_from_a under each turn of the board in b.
struct CommonSet {
  int set;
  double depth_m;  ///< Of the board before the camera that is placed.
  std::vector<Eigen::Isometry3d> b_from_a;
};

struct Vote {
  std::size_t agreeing = 0;
  double spread = 0.0;
  Eigen::Isometry3d b_from_a = Eigen::Isometry3d::Identity();
  std::map<int, std::size_t> turns;  ///< Best turn of each set.
};

Vote vote(const std::vector<CommonSet>& common, const Eigen::Isometry3d& candidate) {
  Vote out;
  out.b_from_a = candidate;
  for (const CommonSet& set : common) {
    double best = 1e300;
    for (std::size_t turn = 0; turn < set.b_from_a.size(); ++turn) {
      const Difference d = difference(set.b_from_a[turn], candidate);
      const double size =
          std::max(d.angle_rad / kSameAngle_rad, d.distance_m / (kSameDistance * set.depth_m));
      if (size >= best) continue;
      best = size;
      out.turns[set.set] = turn;
    }
    if (best > 1.0) continue;
    ++out.agreeing;
    out.spread += best;
  }
  return out;
}

Vote bestVote(const std::vector<CommonSet>& common) {
  Vote best;
  for (const CommonSet& set : common) {
    for (const Eigen::Isometry3d& candidate : set.b_from_a) {
      Vote now = vote(common, candidate);
      const bool better = now.agreeing > best.agreeing ||
                          (now.agreeing == best.agreeing && now.spread < best.spread);
      if (better) best = std::move(now);
    }
  }
  return best;
}

std::vector<CommonSet> commonSets(const BoardPoses& poses, const std::vector<BoardTurn>& turns,
                                  const CameraPlacement& placed, std::size_t a, std::size_t b) {
  std::vector<CommonSet> common;
  for (const auto& [set, b_from_board] : poses[b]) {
    const auto seen = poses[a].find(set);
    const auto turn = placed.turns[a].find(set);
    if (seen == poses[a].end() || turn == placed.turns[a].end()) continue;
    const Eigen::Isometry3d a_from_board = seen->second * turns[turn->second].board_from_turned;
    CommonSet row{set, a_from_board.translation().norm(), {}};
    for (const BoardTurn& other : turns) {
      row.b_from_a.push_back(b_from_board * other.board_from_turned * a_from_board.inverse());
    }
    common.push_back(std::move(row));
  }
  return common;
}

struct Link {
  std::size_t a = 0, b = 0;
  std::vector<CommonSet> common;
};

/// The unplaced camera that shares most sets with a placed one.
std::optional<Link> strongestLink(const BoardPoses& poses, const std::vector<BoardTurn>& turns,
                                  const CameraPlacement& placed, const std::vector<bool>& done) {
  std::optional<Link> best;
  for (std::size_t a = 0; a < poses.size(); ++a) {
    for (std::size_t b = 0; done[a] && b < poses.size(); ++b) {
      if (done[b]) continue;
      std::vector<CommonSet> common = commonSets(poses, turns, placed, a, b);
      if (common.empty() || (best && common.size() <= best->common.size())) continue;
      best = Link{a, b, std::move(common)};
    }
  }
  return best;
}

/// Chooses turns for the sets of camera `b` that the camera it was linked by does not show.
void turnTowardsOthers(const BoardPoses& poses, const std::vector<BoardTurn>& turns, std::size_t b,
                       const std::vector<bool>& done, CameraPlacement& placed) {
  for (std::size_t a = 0; a < poses.size(); ++a) {
    if (!done[a]) continue;
    const auto common = commonSets(poses, turns, placed, a, b);
    const Eigen::Isometry3d b_from_a =
        placed.camera_from_world[b] * placed.camera_from_world[a].inverse();
    const Vote chosen = vote(common, b_from_a);
    placed.turns[b].insert(chosen.turns.begin(), chosen.turns.end());
  }
  for (const auto& [set, pose] : poses[b]) placed.turns[b].emplace(set, 0);
}

}  // namespace

std::vector<BoardTurn> boardTurns(const Board& board) {
  const Points3 corners = board.cornerPositions();
  const Vec3 middle = corners.rowwise().mean();
  std::vector<BoardTurn> turns;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const bool exists = quarter == 0 || (board.kind == Board::Kind::kChessboard &&
                                         (quarter == 2 || board.columns == board.rows));
    if (!exists) continue;
    BoardTurn turn;
    turn.board_from_turned = Eigen::Translation3d(middle) *
                             Eigen::AngleAxisd(0.5 * std::numbers::pi * quarter, Vec3::UnitZ()) *
                             Eigen::Translation3d(-middle);
    for (Eigen::Index i = 0; i < corners.cols(); ++i) {
      const Vec3 at = turn.board_from_turned * Vec3(corners.col(i)) / board.square_m;
      turn.id.push_back(static_cast<int>(std::lround(at.y())) * board.columns +
                        static_cast<int>(std::lround(at.x())));
    }
    turns.push_back(std::move(turn));
  }
  return turns;
}

Result<CameraPlacement> placeCameras(const BoardPoses& poses, const std::vector<BoardTurn>& turns) {
  CameraPlacement placed;
  placed.camera_from_world.assign(poses.size(), Eigen::Isometry3d::Identity());
  placed.turns.resize(poses.size());
  for (const auto& [set, pose] : poses[0]) placed.turns[0][set] = 0;
  std::vector<bool> done(poses.size(), false);
  done[0] = true;
  for (std::size_t count = 1; count < poses.size(); ++count) {
    const auto link = strongestLink(poses, turns, placed, done);
    if (!link) {
      const auto lost =
          static_cast<std::size_t>(std::find(done.begin(), done.end(), false) - done.begin());
      return badInput("", std::to_string(lost), "never sees the board at the same time as another");
    }
    const Vote chosen = bestVote(link->common);
    placed.camera_from_world[link->b] = chosen.b_from_a * placed.camera_from_world[link->a];
    placed.turns[link->b] = chosen.turns;
    turnTowardsOthers(poses, turns, link->b, done, placed);
    done[link->b] = true;
  }
  return placed;
}

}  // namespace tenter
