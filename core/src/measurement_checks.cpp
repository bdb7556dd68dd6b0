// SPDX-License-Identifier: GPL-3.0-or-later
#include "measurement_checks.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

#include "measurement_format.h"

namespace tenter {

namespace {

// Bounds far outside any bench of cloth, close enough that a swapped unit (mm, g, cN, degrees)
// falls beyond them.
constexpr double kMinArealDensity_kg_per_m2 = 0.005, kMaxArealDensity_kg_per_m2 = 5.0;
constexpr double kMinSample_m = 0.005, kMaxSample_m = 2.0;
constexpr double kMaxThickness_m = 0.05;
constexpr double kMaxGravity_m_per_s2 = 20.0;
constexpr double kMaxClipMass_kg = 50.0;
constexpr double kMaxPositionSigma_m = 0.05;
constexpr double kMaxRotationSigma_rad = 0.5;
constexpr double kMaxRestStretch = 2.0;
constexpr int kMaxStrips = 10'000;
constexpr std::size_t kMaxClips = 1000;

constexpr const char* kCheckUnit = "check the unit: files are in SI";

std::string indexed(const std::string& list, std::size_t i) {
  return list + "[" + std::to_string(i) + "]";
}

void checkTensile(const TensileSetup& setup, Complaint& out) {
  out.range(setup.length_m, kMinSample_m, kMaxSample_m, "tensile.length_m", kCheckUnit);
  out.range(setup.width_m, 1e-4, kMaxSample_m, "tensile.width_m", kCheckUnit);
  out.check(setup.strips >= 1 && setup.strips <= kMaxStrips, "tensile.strips",
            "must lie between 1 and 10000");
  out.range(setup.angle_rad, -std::numbers::pi, std::numbers::pi, "tensile.angle_rad",
            "angles are in radians");
  out.range(setup.zero_offset_m, -0.5 * setup.length_m, 0.5 * setup.length_m,
            "tensile.zero_offset_m", kCheckUnit);
}

void checkCantilever(const CantileverSetup& setup, Complaint& out) {
  out.range(setup.length_m, kMinSample_m, kMaxSample_m, "cantilever.length_m", kCheckUnit);
  out.range(setup.width_m, 1e-4, kMaxSample_m, "cantilever.width_m", kCheckUnit);
  out.range(setup.angle_rad, -std::numbers::pi, std::numbers::pi, "cantilever.angle_rad",
            "angles are in radians");
}

void checkClips(const Measurement& m, Complaint& out) {
  out.check(m.clips.size() <= kMaxClips, "clips", "lists more than 1000 clips");
  std::set<std::string> ids;
  for (std::size_t i = 0; i < m.clips.size() && out.ok(); ++i) {
    const std::string place = indexed("clips", i);
    out.check(!m.clips[i].id.empty(), place + ".id", "is empty");
    out.check(ids.insert(m.clips[i].id).second, place + ".id",
              "\"" + m.clips[i].id + "\" appears twice");
    out.range(m.clips[i].mass_kg, 0.0, kMaxClipMass_kg, place + ".mass_kg",
              "masses are in kilograms and not negative");
  }
}

Vec2 extentOf(const Points2& uv) { return uv.rowwise().maxCoeff() - uv.rowwise().minCoeff(); }

double signedUvArea(const TriangleMesh& mesh, const Triangle& triangle) {
  const Vec2 a = mesh.uv.col(triangle[1]) - mesh.uv.col(triangle[0]);
  const Vec2 b = mesh.uv.col(triangle[2]) - mesh.uv.col(triangle[0]);
  return 0.5 * (a.x() * b.y() - a.y() * b.x());
}

void checkUvTriangles(const TriangleMesh& mesh, Complaint& out) {
  const double first = signedUvArea(mesh, mesh.triangles.front());
  for (std::size_t t = 0; t < mesh.triangles.size() && out.ok(); ++t) {
    const double area = signedUvArea(mesh, mesh.triangles[t]);
    out.check(area * first > 0.0, "triangle " + std::to_string(t),
              "is folded over or has no area in (u, v)", "material coordinates must not overlap");
  }
}

/// Lengths over all triangle sides: positions per material coordinates.
double meanStretch(const TriangleMesh& mesh) {
  double length = 0.0, uv_length = 0.0;
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = triangle[i], b = triangle[(i + 1) % 3];
      length += (mesh.positions.col(a) - mesh.positions.col(b)).norm();
      uv_length += (mesh.uv.col(a) - mesh.uv.col(b)).norm();
    }
  }
  return length / uv_length;
}

}  // namespace

void Complaint::range(double value, double min, double max, const std::string& place,
                      const std::string& advice) {
  if (value >= min && value <= max) return;
  if (!std::isfinite(value)) return check(false, place, "is not a finite number");
  std::ostringstream reason;
  reason << "is " << value << " but must lie between " << min << " and " << max;
  check(false, place, reason.str(), advice);
}

Result<void> checkHeader(const Measurement& m, const std::string& file, bool cloth) {
  Complaint out(file);
  out.range(m.areal_density_kg_per_m2, kMinArealDensity_kg_per_m2, kMaxArealDensity_kg_per_m2,
            "areal_density_kg_per_m2", kCheckUnit);
  out.range(m.thickness_m, 0.0, kMaxThickness_m, "thickness_m", kCheckUnit);
  for (int axis = 0; axis < 2; ++axis) {
    // Strips of a tensile test may be narrower than any sheet, and need no sample size.
    out.range(m.sample_size_m[axis], cloth ? kMinSample_m : 0.0, kMaxSample_m,
              indexed("sample_size_m", static_cast<std::size_t>(axis)), kCheckUnit);
  }
  out.check(m.gravity_m_per_s2.norm() <= kMaxGravity_m_per_s2, "gravity_m_per_s2",
            "is longer than 20 m/s^2 or not finite", kCheckUnit);
  out.range(m.clip_position_sigma_m, 0.0, kMaxPositionSigma_m, "clip_position_sigma_m", kCheckUnit);
  out.range(m.clip_rotation_sigma_rad, 0.0, kMaxRotationSigma_rad, "clip_rotation_sigma_rad",
            "angles are in radians");
  checkClips(m, out);
  if (m.tensile) checkTensile(*m.tensile, out);
  if (m.cantilever) checkCantilever(*m.cantilever, out);
  out.check(cloth || m.tensile || m.cantilever, "tensile",
            "there is neither a rest mesh nor a tensile nor a cantilever setup",
            "a measurement needs one of the three");
  out.check(!m.frames.empty(), "frame_count", "there are no frames");
  out.check(m.frames.size() <= measurement_format::kMaxFrames, "frame_count",
            "is above 100000 frames");
  return out.result();
}

Result<void> checkRest(const Measurement& m, const std::string& file) {
  if (!m.rest) return {};
  if (auto done = validateMesh(*m.rest); !done) return done.error().in(file);
  Complaint out(file);
  out.check(m.rest->hasUv(), "point array \"uv\"", "is missing",
            "the rest mesh needs material coordinates in metres");
  if (!out.ok()) return out.result();
  const Vec2 extent = extentOf(m.rest->uv);
  for (int axis = 0; axis < 2; ++axis) {
    // The tracked mesh may leave out the rim of the sample but cannot be larger than it.
    out.range(extent[axis], 0.1 * m.sample_size_m[axis], 1.2 * m.sample_size_m[axis],
              std::string("extent of ") + (axis == 0 ? "u" : "v"),
              "sample_size_m and material coordinates must agree, both in metres");
  }
  checkUvTriangles(*m.rest, out);
  if (!out.ok()) return out.result();
  out.range(meanStretch(*m.rest), 1.0 / kMaxRestStretch, kMaxRestStretch,
            "ratio of rest lengths to lengths in (u, v)", "both must be in metres");
  return out.result();
}

Result<void> checkFrames(const Measurement& m, const std::string& folder) {
  namespace format = measurement_format;
  for (std::size_t i = 0; i < m.frames.size(); ++i) {
    const std::string mesh_file = folder + format::meshFileOfFrame(i);
    if (auto done = checkFrame(m, i, folder + format::kFramesFile, mesh_file); !done) return done;
  }
  return {};
}

Result<void> validateMeasurement(const Measurement& m, const std::string& file) {
  namespace format = measurement_format;
  const std::string folder = file.empty() ? "" : file + "/";
  if (auto done = checkHeader(m, folder + format::kHeaderFile, m.rest.has_value()); !done) {
    return done;
  }
  if (auto done = checkRest(m, folder + format::kRestFile); !done) return done;
  return checkFrames(m, folder);
}

}  // namespace tenter
