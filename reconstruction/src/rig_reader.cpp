// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_reader.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "subset_centres.h"
#include "tenter/core/median.h"
#include "tenter/reconstruction/cord_finder.h"

namespace tenter {

namespace {

/// A sample farther from its images than this is not of their moment.
constexpr std::int64_t kSameMoment_ns = 500'000'000;
/// Travel of all actuators together below which nothing moved.
constexpr double kStill_m = 1e-6;
/// Vertices this far from the edge tell where cloth on the table lies.
constexpr double kWellOnTable_m = 3e-3;
/// A line of the mesh that lies on the edge is held.
constexpr double kOnEdge_m = 0.05e-3;
/// Fewer vertices do not tell where it lies.
constexpr std::size_t kLeastOnTable = 20;
/// Cloth on a table lies flat while heights scatter about a plane by less than this many of their
/// standard deviations.
constexpr double kFlat = 2.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
constexpr double kSigmaOfMedianDeviation = 1.4826;

std::vector<MountedClip> taggedClips(const Mounting& mounting) {
  std::vector<MountedClip> tagged;
  for (const MountedClip& clip : mounting.clips) {
    if (!clip.tags.empty()) tagged.push_back(clip);
  }
  return tagged;
}

/// Drops what stands across the sample at rest, and across the table: both are level.
Mat3 alongRest() { return Vec3(1.0, 1.0, 0.0).asDiagonal(); }

/// Heights of cloth that lies flat on a level table: z = coefficients . (1, x, y). Nothing if it
/// does not lie flat to within what its vertices' heights err by at rest, or if too few of them are
/// seen.
std::optional<Vec3> tablePlane(const RestSurface& rest, const std::vector<int>& lying) {
  std::vector<int> seen;
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  const auto terms = [&](int i) {
    return Vec3(1.0, rest.mesh.positions(0, i), rest.mesh.positions(1, i));
  };
  for (const int i : lying) {
    if (rest.vertices[i].state != PointState::kValid) continue;
    seen.push_back(i);
    normal.noalias() += terms(i) * terms(i).transpose();
    right += rest.mesh.positions(2, i) * terms(i);
  }
  if (seen.size() < kLeastOnTable) return std::nullopt;
  const Vec3 plane = normal.ldlt().solve(right);
  std::vector<double> off;
  for (const int i : seen) {
    const double sigma = std::sqrt(rest.vertices[i].point.covariance_m2(2, 2));
    off.push_back(std::abs(rest.mesh.positions(2, i) - plane.dot(terms(i))) / sigma);
  }
  const bool flat = kSigmaOfMedianDeviation * medianOf(std::move(off)) < kFlat;
  return flat ? std::optional<Vec3>(plane) : std::nullopt;
}

/// The part of a convex polygon with normal . x <= limit.
std::vector<Vec2> cut(const std::vector<Vec2>& polygon, const Vec2& normal, double limit) {
  std::vector<Vec2> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = normal.dot(a) - limit, db = normal.dot(b) - limit;
    if (da <= 0.0) part.push_back(a);
    if (da * db < 0.0) part.push_back(a + da / (da - db) * (b - a));
  }
  return part;
}

}  // namespace

RigReader::RigReader(const ImageSession& session, const RestSurface& rest,
                     const TensionErrors& errors)
    : session_(session),
      rest_(rest),
      errors_(errors),
      tagged_(taggedClips(session.mounting)),
      tracker_(session.views, tagged_),
      last_(tagged_.size(), Eigen::Isometry3d::Identity()) {
  for (const MountedClip& clip : tagged_) {
    std::vector<int> vertices;
    for (int i = 0; i < rest.mesh.vertexCount(); ++i) {
      if (holds(clip.outline_uv_m, rest.mesh.uv.col(i))) vertices.push_back(i);
    }
    held_.push_back(std::move(vertices));
  }
}

/// Of a vertex that moved rigidly from where it was seen at rest; zero where it was not.
Mat3 RigReader::carriedCovariance(int vertex, const Vec3& at, const Mat3& turn) const {
  if (rest_.vertices[vertex].state != PointState::kValid) return Mat3::Zero();
  return rest_.vertices[vertex].point.covariance_m2 +
         rest_.systematicAt(vertex, at, rest_.sightingsOf(vertex), turn * alongRest());
}

void RigReader::hold(const MountedClip& clip, const ClipPose& pose, Reading& reading) const {
  const auto index =
      static_cast<std::size_t>(std::find_if(tagged_.begin(), tagged_.end(),
                                            [&](const MountedClip& c) { return c.id == clip.id; }) -
                               tagged_.begin());
  reading.clips.push_back({clip.id, pose.rig_from_clip, held_[index], clip.outline_uv_m});
  Vec3 middle = Vec3::Zero();
  for (const ClipTag& tag : clip.tags) {
    middle += tag.clip_from_tag.translation() / static_cast<double>(clip.tags.size());
  }
  for (const int vertex : held_[index]) {
    const Vec3 rest = rest_.mesh.positions.col(vertex);
    const double sigma =
        std::hypot(pose.position_sigma_m, pose.rotation_sigma_rad * (rest - middle).norm());
    const Vec3 at = pose.rig_from_clip * rest;
    reading.held.push_back({vertex, at,
                            sigma * sigma * Mat3::Identity() +
                                carriedCovariance(vertex, at, pose.rig_from_clip.linear())});
  }
  reading.clip_position_sigma_m = std::max(reading.clip_position_sigma_m, pose.position_sigma_m);
  reading.clip_rotation_sigma_rad =
      std::max(reading.clip_rotation_sigma_rad, pose.rotation_sigma_rad);
}

void RigReader::readCord(const MountedCord& cord, const std::vector<GrayImage>& images,
                         const SessionMoment& moment, Reading& reading) const {
  const auto clip = std::find_if(reading.clips.begin(), reading.clips.end(),
                                 [&](const ClipReading& c) { return c.clip == cord.clip; });
  if (clip == reading.clips.end()) return;
  const std::string name = "cord '" + cord.cord + "'";
  if (!cord.pulley_m) {
    reading.warnings.push_back(name + " was not looked for: its pulley's place is not known");
    return;
  }
  const auto cell = static_cast<std::size_t>(cord.cell);
  if (cell >= moment.sample.tensions.size() || moment.sample_apart_ns > kSameMoment_ns) {
    reading.warnings.push_back(name + " has no tension: no sample of that moment");
    return;
  }
  const TensionReading& tension = moment.sample.tensions[cell];
  if (tension.status != TensionStatus::kOk || !tension.tension_N) {
    reading.warnings.push_back(name + " has no tension: its cell is " +
                               std::string(nameOf(tension.status)));
    return;
  }
  const CordGuess guess{clip->rig_from_clip * cord.attachment_m, *cord.pulley_m,
                        cord.diameter_m > 0.0 ? cord.diameter_m : 1e-3};
  const auto line = findCord(session_.views, images, guess);
  if (!line) {
    reading.warnings.push_back(name + " was not found in two views");
    return;
  }
  reading.cords.push_back({cord.cord, cord.clip, cord.attachment_m, line->direction,
                           *tension.tension_N, std::hypot(errors_.cell_N, errors_.friction_N)});
}

Result<RigReader::Reading> RigReader::read(const std::vector<GrayImage>& images,
                                           const SessionMoment& moment) {
  Reading reading;
  const auto poses = tracker_.find(images, last_);
  if (!poses) return poses.error();
  for (std::size_t c = 0; c < tagged_.size(); ++c) {
    if (!(*poses)[c]) {
      reading.warnings.push_back("clip '" + tagged_[c].id +
                                 "' was not found: too few of its tags in two views");
      continue;
    }
    last_[c] = (*poses)[c]->rig_from_clip;
    hold(tagged_[c], *(*poses)[c], reading);
  }
  for (const MountedCord& cord : session_.mounting.cords) readCord(cord, images, moment, reading);
  return reading;
}

void RigReader::addTable(ClothFrame& cloth, Reading& reading) const {
  if (!session_.mounting.table) return;
  const MountedTable& table = *session_.mounting.table;
  const double edge = table.push.dot(table.edge_m);
  std::vector<double> moved;
  for (int i = 0; i < rest_.mesh.vertexCount(); ++i) {
    if (cloth.states[i] != PointState::kValid) continue;
    const Vec3 at = cloth.positions_m.col(i), before = rest_.mesh.positions.col(i);
    if (table.push.dot(at) > edge - kWellOnTable_m) continue;
    moved.push_back(table.push.dot(at - before));
  }
  if (moved.size() < kLeastOnTable) {
    reading.warnings.push_back("the cloth on the table was not seen: the table is left out");
    return;
  }
  const double push = medianOf(moved);
  for (double& value : moved) value = std::abs(value - push);
  const double scatter = kSigmaOfMedianDeviation * medianOf(std::move(moved));
  ClipReading clip;
  clip.clip = table.clip;
  clip.rig_from_clip.translation() = push * table.push;
  for (int i = 0; i < rest_.mesh.vertexCount(); ++i) {
    const double along = table.push.dot(rest_.mesh.positions.col(i)) + push;
    if (along <= edge + kOnEdge_m) clip.clamped_vertices.push_back(i);
  }
  const std::optional<Vec3> plane = tablePlane(rest_, clip.clamped_vertices);
  for (const int i : clip.clamped_vertices) {
    // Seen or hidden, it lies on the table as it did, pushed with the rest. One that was not seen
    // at rest either stays what it is: filled.
    Vec3 at = rest_.mesh.positions.col(i);
    if (plane) at.z() = plane->dot(Vec3(1.0, at.x(), at.y()));
    at += push * table.push;
    cloth.positions_m.col(i) = at;
    if (rest_.vertices[i].state != PointState::kValid) continue;
    cloth.covariances_m2[i] =
        scatter * scatter * Mat3::Identity() + carriedCovariance(i, at, Mat3::Identity());
    cloth.states[i] = PointState::kValid;
  }
  // The sample's outline in its plane, cut at the edge, then in material coordinates.
  const Mounting& m = session_.mounting;
  const Vec2 low = m.sample_corner_m, high = low + m.sample_size_m;
  const std::vector<Vec2> part = cut({low, Vec2(high.x(), low.y()), high, Vec2(low.x(), high.y())},
                                     table.push.head<2>(), edge - push);
  const Mat2 turn = Eigen::Rotation2Dd(m.thread_angle_rad).toRotationMatrix();
  for (const Vec2& corner : part) clip.outline_uv_m.push_back(turn * (corner - low));
  if (part.size() < 3) clip.outline_uv_m.clear();
  reading.clips.push_back(std::move(clip));
}

Branch RigReader::branchBetween(const SessionMoment* before, const SessionMoment& now) const {
  if (session_.mounting.table) return Branch::kLoading;
  if (!before) return Branch::kUnknown;
  double travel = 0.0;
  for (const MountedCord& cord : session_.mounting.cords) {
    const auto axis = static_cast<std::size_t>(cord.actuator);
    const auto& a = before->sample.positions_m;
    const auto& b = now.sample.positions_m;
    if (axis < a.size() && axis < b.size() && a[axis] && b[axis]) travel += *b[axis] - *a[axis];
  }
  if (std::abs(travel) < kStill_m) return Branch::kUnknown;
  return travel > 0.0 ? Branch::kLoading : Branch::kUnloading;
}

}  // namespace tenter
