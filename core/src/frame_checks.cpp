// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "measurement_checks.h"
#include "measurement_format.h"

namespace tenter {

namespace {

// As for the header: wide enough for any bench, narrow enough that a swapped unit shows.
constexpr double kMaxTension_N = 1000.0;
constexpr double kMaxMachineForce_N = 20'000.0;
constexpr double kMaxPlace_m = 10.0;
constexpr double kMaxSigma_m = 0.05;
constexpr std::size_t kMaxCords = 1000;
/// A load cell that drifts may read a little below zero; a cord cannot push.
constexpr double kMinTension_N = -1.0;
/// Rotations and directions come from text with at least seven digits.
constexpr double kUnitTolerance = 1e-6;
/// A taut strip's tip may seem to lie beyond its length by its error, but never by more than this
/// fraction.
constexpr double kMaxChordExcess = 0.02;

constexpr const char* kCheckUnit = "check the unit: files are in SI";

bool isRotation(const Mat3& r) {
  return ((r * r.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() <= kUnitTolerance) &&
         r.determinant() > 0.0;
}

bool isPlace(const Vec3& x) { return x.cwiseAbs().maxCoeff() <= kMaxPlace_m && x.allFinite(); }

/// Convex, turning one way round, with some area.
bool isConvexPolygon(const std::vector<Vec2>& outline) {
  if (outline.size() < 3) return false;
  double turn = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[(i + 1) % outline.size()] - outline[i];
    const Vec2 b = outline[(i + 2) % outline.size()] - outline[(i + 1) % outline.size()];
    const double cross = a.x() * b.y() - a.y() * b.x();
    // Corners in a row (180 degrees) are fine up to rounding.
    if (std::abs(cross) <= 1e-9 * a.norm() * b.norm()) continue;
    if (turn != 0.0 && cross * turn < 0.0) return false;
    turn = cross;
  }
  return turn != 0.0;
}

bool outlineTouches(const std::vector<Vec2>& outline, const Points2& uv) {
  Eigen::AlignedBox2d clip, cloth;
  for (const Vec2& corner : outline) clip.extend(corner);
  cloth.extend(Vec2(uv.rowwise().minCoeff()));
  cloth.extend(Vec2(uv.rowwise().maxCoeff()));
  const Vec2 rounding = 1e-9 * cloth.sizes();
  return clip.intersects(Eigen::AlignedBox2d(cloth.min() - rounding, cloth.max() + rounding));
}

void checkClamped(const std::vector<int>& ids, int vertices, const std::string& place,
                  std::set<int>& taken, Complaint& out) {
  for (std::size_t i = 0; i < ids.size() && out.ok(); ++i) {
    const std::string here = place + "[" + std::to_string(i) + "]";
    const std::string id = std::to_string(ids[i]);
    out.check(ids[i] >= 0 && ids[i] < vertices, here,
              "names vertex " + id + " of a rest mesh with " + std::to_string(vertices));
    out.check(i == 0 || ids[i] > ids[i - 1], here, "is not sorted or appears twice: " + id);
    out.check(taken.insert(ids[i]).second, here, "vertex " + id + " is held by two clips");
  }
}

void checkClipReadings(const Measurement& m, const MeasurementFrame& frame,
                       std::set<std::string>& present, Complaint& out) {
  std::set<int> taken;
  for (std::size_t i = 0; i < frame.clips.size() && out.ok(); ++i) {
    const ClipReading& clip = frame.clips[i];
    const std::string place = "clips[" + std::to_string(i) + "]";
    const bool known = std::any_of(m.clips.begin(), m.clips.end(),
                                   [&clip](const ClipInfo& info) { return info.id == clip.clip; });
    out.check(known, place + ".clip", "\"" + clip.clip + "\" is not in measurement.json");
    out.check(present.insert(clip.clip).second, place + ".clip",
              "\"" + clip.clip + "\" appears twice in the frame");
    out.check(isRotation(clip.rig_from_clip.linear()), place + ".rotation",
              "is not a rotation: rows must be orthonormal and right-handed");
    out.check(isPlace(clip.rig_from_clip.translation()), place + ".translation_m",
              "lies more than 10 m away or is not finite", kCheckUnit);
    checkClamped(clip.clamped_vertices, m.rest->vertexCount(), place + ".clamped_vertices", taken,
                 out);
    if (clip.outline_uv_m.empty() || !out.ok()) continue;
    out.check(isConvexPolygon(clip.outline_uv_m), place + ".outline_uv_m",
              "is not a convex polygon");
    out.check(outlineTouches(clip.outline_uv_m, m.rest->uv), place + ".outline_uv_m",
              "the clip lies outside the mesh", "outlines are in material coordinates, in metres");
  }
}

void checkCords(const MeasurementFrame& frame, const std::set<std::string>& present,
                Complaint& out) {
  out.check(frame.cords.size() <= kMaxCords, "cords", "lists more than 1000 cords");
  std::set<std::string> ids;
  for (std::size_t i = 0; i < frame.cords.size() && out.ok(); ++i) {
    const CordReading& cord = frame.cords[i];
    const std::string place = "cords[" + std::to_string(i) + "]";
    out.check(ids.insert(cord.cord).second, place + ".cord",
              "\"" + cord.cord + "\" appears twice in the frame");
    out.check(present.contains(cord.clip), place + ".clip",
              "\"" + cord.clip + "\" is no clip of this frame");
    out.check(isPlace(cord.attachment_m), place + ".attachment_m",
              "lies more than 10 m away or is not finite", kCheckUnit);
    out.check(std::abs(cord.direction.norm() - 1.0) <= kUnitTolerance, place + ".direction",
              "is not a unit vector");
    out.range(cord.tension_N, kMinTension_N, kMaxTension_N, place + ".tension_N",
              "tensions are in newtons");
    out.range(cord.tension_sigma_N, 0.0, kMaxTension_N, place + ".tension_sigma_N", kCheckUnit);
  }
}

void checkTensileFrame(const TensileSetup& setup, const MeasurementFrame& frame, Complaint& out) {
  out.range(frame.displacement_m, -setup.length_m, setup.length_m, "tensile.displacement_m",
            "lengths are in metres, and a strip does not stretch to twice its length");
  out.range(frame.force_N, -kMaxMachineForce_N, kMaxMachineForce_N, "tensile.force_N", kCheckUnit);
  out.range(frame.force_sigma_N, 0.0, kMaxMachineForce_N, "tensile.force_sigma_N", kCheckUnit);
}

void checkCantileverFrame(const CantileverSetup& setup, const MeasurementFrame& frame,
                          Complaint& out) {
  out.range(frame.tip_sigma_m, 0.0, kMaxSigma_m, "cantilever.tip_sigma_m", kCheckUnit);
  const double excess = std::min(3.0 * frame.tip_sigma_m, kMaxChordExcess * setup.length_m);
  const double limit = setup.length_m * (1.0 + 1e-9) + excess;
  out.range(frame.reach_m, -limit, limit, "cantilever.reach_m", "it cannot exceed the length");
  out.range(frame.drop_m, -excess, limit, "cantilever.drop_m",
            "it is measured downwards and cannot exceed the length");
  out.check(std::hypot(frame.reach_m, frame.drop_m) <= limit, "cantilever.drop_m",
            "clamp and tip are farther apart than the strip is long",
            "measure reach, drop and length again");
}

Result<void> checkPositions(const Measurement& m, const MeasurementFrame& frame,
                            const std::string& mesh_file) {
  Complaint out(mesh_file);
  const Eigen::Index count = frame.positions.cols();
  const std::string wanted = " instead of " + std::to_string(count);
  out.check(count == m.rest->vertexCount(), "Points",
            "has " + std::to_string(count) + " vertices but the rest mesh has " +
                std::to_string(m.rest->vertexCount()));
  out.check(frame.position_sigma_m.size() == count, "point array \"sigma_m\"",
            "has " + std::to_string(frame.position_sigma_m.size()) + " entries" + wanted);
  out.check(static_cast<Eigen::Index>(frame.valid.size()) == count, "point array \"valid\"",
            "has " + std::to_string(frame.valid.size()) + " entries" + wanted);
  const Points3& axes = frame.position_sigma_axes_m;
  out.check(axes.cols() == 0 || axes.cols() == count, "point array \"sigma_axes_m\"",
            "has " + std::to_string(axes.cols()) + " entries" + wanted);
  for (Eigen::Index v = 0; v < axes.cols() && out.ok(); ++v)
    out.check((axes.col(v).array() >= 0.0 && axes.col(v).array() <= kMaxSigma_m).all(),
              "vertex " + std::to_string(v), "sigma_axes_m must lie between 0 and 0.05 m",
              kCheckUnit);
  for (Eigen::Index v = 0; v < count && out.ok(); ++v) {
    const std::uint8_t valid = frame.valid[static_cast<std::size_t>(v)];
    const double sigma = frame.position_sigma_m[v];
    const bool good_sigma = sigma >= 0.0 && sigma <= kMaxSigma_m;
    if (isPlace(frame.positions.col(v)) && good_sigma && valid <= 1) continue;
    const std::string place = "vertex " + std::to_string(v);
    out.check(valid <= 1, place, "valid must be 0 or 1");
    out.check(good_sigma, place, "sigma_m must lie between 0 and 0.05 m", kCheckUnit);
    out.check(false, place, "lies more than 10 m away or is not finite", kCheckUnit);
  }
  return out.result();
}

}  // namespace

Result<void> checkFrame(const Measurement& m, std::size_t index, const std::string& file,
                        const std::string& mesh_file) {
  const MeasurementFrame& frame = m.frames[index];
  Complaint out(file, measurement_format::lineOfFrame(index) + ": ");
  out.check(frame.time_ns >= 0, "time_ns", "is negative");
  out.check(index == 0 || frame.time_ns >= m.frames[index - 1].time_ns, "time_ns",
            "the frame is earlier than the one before", "frames must be in order of time");
  if (m.tensile) checkTensileFrame(*m.tensile, frame, out);
  if (m.cantilever) checkCantileverFrame(*m.cantilever, frame, out);
  const bool has_cloth = !frame.clips.empty() || !frame.cords.empty() || frame.positions.cols() > 0;
  out.check(!has_cloth || m.rest.has_value(), "clips", "a cloth frame needs rest.vtp");
  if (!m.rest || !out.ok()) return out.result();

  std::set<std::string> present;
  checkClipReadings(m, frame, present, out);
  checkCords(frame, present, out);
  if (!out.ok() || frame.positions.cols() == 0) return out.result();
  return checkPositions(m, frame, mesh_file);
}

}  // namespace tenter
