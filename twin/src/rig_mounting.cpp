// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/rig_mounting.h"

#include <cmath>
#include <numbers>

#include "rig_setup.h"
#include "tenter/twin/protocol.h"
#include "virtual_cloth.h"

namespace tenter {
namespace {

constexpr const char* kFamily = "apriltag_36h11";
constexpr double kBarReach_m = 0.011, kCornerReach_m = 0.014;  // of a clip beyond the cloth
constexpr double kHalfHeight_m = 0.0025;
constexpr double kBarTag_m = 0.010, kCornerTag_m = 0.009;
constexpr double kTagLift_m = 2e-5;  // of a label's print above the clip
constexpr double kEarHalfWidth_m = 0.002, kEarHalfHeight_m = 0.0015;
constexpr double kCordDiameter_m = 0.001;

/// The area that it holds, and on outwards from the sample.
ClipBox bodyOf(const RigClip& clip) {
  const double reach = clip.shape == "corner" ? kCornerReach_m : kBarReach_m;
  ClipBox body;
  for (int axis = 0; axis < 2; ++axis) {
    const double low = clip.area_m.min()[axis], high = clip.area_m.max()[axis];
    const bool outwards = high - low < 0.5 * kSampleSide_m;
    body.min_m[axis] = outwards && low <= 0.0 ? low - reach : low;
    body.max_m[axis] = outwards && high >= kSampleSide_m ? high + reach : high;
  }
  body.min_m.z() = -kHalfHeight_m;
  body.max_m.z() = kHalfHeight_m;
  return body;
}

/// A tongue out to a cord that is tied beside the body.
std::optional<ClipBox> earOf(const ClipBox& body, const Vec3& attachment) {
  const Vec3 nearest = attachment.cwiseMax(body.min_m).cwiseMin(body.max_m);
  if ((nearest - attachment).norm() == 0.0) return std::nullopt;
  const Vec3 half(kEarHalfWidth_m, kEarHalfWidth_m, kEarHalfHeight_m);
  return ClipBox{nearest.cwiseMin(attachment) - half, nearest.cwiseMax(attachment) + half};
}

/// Tags in rows over the top of a body, facing up.
void addTags(const RigClip& clip, const ClipBox& body, int& next_id, MountedClip& out) {
  const bool corner = clip.shape == "corner";
  const Vec3 extent = body.max_m - body.min_m;
  const auto along = [&](int axis) {
    return corner ? 2 : (extent[axis] > extent[1 - axis] ? 3 : 1);
  };
  const int columns = along(0), rows = along(1);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      ClipTag tag{kFamily, next_id++, corner ? kCornerTag_m : kBarTag_m, {}};
      tag.clip_from_tag.linear() = Vec3(1.0, -1.0, -1.0).asDiagonal();
      tag.clip_from_tag.translation() =
          Vec3(body.min_m.x() + (column + 0.5) / columns * extent.x(),
               body.min_m.y() + (row + 0.5) / rows * extent.y(), body.max_m.z() + kTagLift_m);
      out.tags.push_back(tag);
    }
  }
}

MountedClip mountedClip(const RigClip& clip, int& next_id) {
  MountedClip out;
  out.id = clip.id;
  out.shape = clip.shape;
  out.mass_kg = clip.mass_kg;
  const Vec2 low = clip.area_m.min(), high = clip.area_m.max();
  out.centre_of_mass_m.head<2>() = clip.area_m.center();
  out.outline_uv_m = {low, Vec2(high.x(), low.y()), high, Vec2(low.x(), high.y())};
  out.bodies = {bodyOf(clip)};
  for (const RigCord& cord : clip.cords) {
    if (auto ear = earOf(out.bodies.front(), cord.cord.attachment_m)) out.bodies.push_back(*ear);
  }
  addTags(clip, out.bodies.front(), next_id, out);
  return out;
}

void hangOnCords(const std::string& protocol, const Fabric& fabric, Mounting& m) {
  const RigSetup rig = makeRig(protocol, fabric, 2);
  int next_id = 0;
  for (const RigClip& clip : rig.clips) m.clips.push_back(mountedClip(clip, next_id));
  int axis = 0;
  for (const CordPlace& place : actuatorOrder(rig)) {
    const RigClip& clip = rig.clips[static_cast<std::size_t>(place.clip)];
    const RigCord& cord = clip.cords[static_cast<std::size_t>(place.cord)];
    m.cords.push_back({cord.id, clip.id, cord.cord.attachment_m, axis, axis, cord.cord.pulley_m,
                       kCordDiameter_m});
    ++axis;
  }
}

void layOnTable(const std::string& protocol, Mounting& m) {
  MountedClip table;
  table.id = table.shape = "table";
  m.clips.push_back(table);
  MountedTable edge;
  edge.clip = table.id;
  edge.push = protocol == "bend-warp" ? Vec3::UnitY() : Vec3::UnitX();
  edge.edge_m = kSampleSide_m * edge.push;
  edge.push_actuator = 0;
  m.table = edge;
  if (protocol == "bend-bias") m.thread_angle_rad = 0.25 * std::numbers::pi;
}

}  // namespace

Result<Mounting> rigMounting(const std::string& fabric_id, const std::string& protocol_id) {
  const auto fabric = findFabric(fabric_id);
  if (!fabric) return fabric.error();
  const auto protocol = findProtocol(protocol_id);
  if (!protocol) return protocol.error();
  Mounting m;
  m.sample_size_m = Vec2::Constant(kSampleSide_m);
  m.thickness_m = (*fabric)->thickness_m;
  m.areal_density_kg_per_m2 = (*fabric)->areal_density_kg_per_m2;
  if ((*protocol)->has_cords) {
    hangOnCords(protocol_id, **fabric, m);
  } else {
    layOnTable(protocol_id, m);
  }
  return m;
}

}  // namespace tenter
