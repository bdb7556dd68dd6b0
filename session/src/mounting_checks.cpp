// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>
#include <set>

#include "mounting_format.h"
#include "tenter/session/mounting.h"

namespace tenter {

namespace format = mounting_format;

namespace {

constexpr double kMinSample_m = 0.005, kMaxSample_m = 2.0;
constexpr double kMaxPlace_m = 10.0;  ///< A rig is no larger; a number in mm is.
constexpr double kMaxThickness_m = 0.05, kMaxMass_kg = 10.0, kMaxDiameter_m = 0.02;
constexpr double kMinArealDensity_kg_per_m2 = 0.005, kMaxArealDensity_kg_per_m2 = 5.0;
constexpr double kMaxGravity_m_per_s2 = 100.0;
constexpr double kMinTag_m = 5e-4, kMaxTag_m = 0.5;
constexpr double kRotationTolerance = 1e-6, kUnitTolerance = 1e-6;
constexpr double kOutlineTolerance_m = 1e-9;

std::string at(const char* list, std::size_t index, const std::string& field = "") {
  return std::string(list) + "[" + std::to_string(index) + "]" + (field.empty() ? "" : "." + field);
}

bool within(double value, double min, double max) { return value >= min && value <= max; }

template <class Vector>
bool isPlace(const Vector& place) {
  return place.allFinite() && place.cwiseAbs().maxCoeff() <= kMaxPlace_m;
}

bool isName(const std::string& name) { return !name.empty() && name.size() <= format::kMaxName; }

bool isRotation(const Mat3& matrix) {
  return matrix.allFinite() &&
         (matrix * matrix.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() <=
             kRotationTolerance &&
         matrix.determinant() > 0.0;
}

bool isUnit(const Vec3& vector) {
  return vector.allFinite() && std::abs(vector.norm() - 1.0) <= kUnitTolerance;
}

/// Convex, and turning counter-clockwise or clockwise all along.
bool isConvex(const std::vector<Vec2>& outline) {
  const std::size_t n = outline.size();
  int left = 0, right = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 a = outline[(i + 1) % n] - outline[i],
               b = outline[(i + 2) % n] - outline[(i + 1) % n];
    const double turn = a.x() * b.y() - a.y() * b.x();
    if (turn > kOutlineTolerance_m * kOutlineTolerance_m) ++left;
    if (turn < -kOutlineTolerance_m * kOutlineTolerance_m) ++right;
  }
  return (left == 0) != (right == 0);
}

class Checker {
 public:
  Checker(const Mounting& mounting, const std::string& file) : m_(mounting), file_(file) {}

  Result<void> run() {
    sample();
    for (std::size_t i = 0; i < m_.clips.size() && !error_; ++i) clip(i);
    for (std::size_t i = 0; i < m_.cords.size() && !error_; ++i) cord(i);
    if (m_.table && !error_) table(*m_.table);
    return error_ ? Result<void>(*error_) : Result<void>();
  }

 private:
  void demand(bool good, const std::string& place, const std::string& reason,
              const std::string& advice = "") {
    if (!good && !error_) error_ = badInput(file_, place, reason, advice);
  }

  void sample() {
    for (int axis = 0; axis < 2; ++axis) {
      demand(within(m_.sample_size_m[axis], kMinSample_m, kMaxSample_m), "sample_size_m",
             "must be 5 mm to 2 m", "check the unit");
    }
    demand(isPlace(m_.sample_corner_m), "sample_corner_m", "lies more than 10 m off",
           "check the unit");
    demand(within(m_.thread_angle_rad, -std::numbers::pi, std::numbers::pi), "thread_angle_rad",
           "must lie between -pi and pi", "check the unit");
    demand(within(m_.thickness_m, 0.0, kMaxThickness_m), "thickness_m", "must be 0 to 50 mm",
           "check the unit");
    demand(
        within(m_.areal_density_kg_per_m2, kMinArealDensity_kg_per_m2, kMaxArealDensity_kg_per_m2),
        "areal_density_kg_per_m2", "must lie between 0.005 and 5", "check the unit");
    demand(m_.gravity_m_per_s2.allFinite() && m_.gravity_m_per_s2.norm() <= kMaxGravity_m_per_s2,
           "gravity_m_per_s2", "must be shorter than 100 m/s^2");
    demand(!m_.rest_frame || within(static_cast<double>(*m_.rest_frame), 0.0,
                                    static_cast<double>(format::kMaxFrame)),
           "rest_frame", "is no number of a frame");
    demand(m_.clips.size() <= format::kMaxClips, "clips", "are more than 64");
    demand(m_.cords.size() <= format::kMaxCords, "cords", "are more than 256");
  }

  void clip(std::size_t i) {
    const MountedClip& c = m_.clips[i];
    demand(isName(c.id), at("clips", i, "id"), "is empty or too long");
    demand(clips_.insert(c.id).second, at("clips", i, "id"),
           "is '" + c.id + "' for the second time");
    demand(c.shape.size() <= format::kMaxName, at("clips", i, "shape"), "is too long");
    demand(within(c.mass_kg, 0.0, kMaxMass_kg), at("clips", i, "mass_kg"), "must be 0 to 10 kg",
           "check the unit");
    demand(isPlace(c.centre_of_mass_m), at("clips", i, "centre_of_mass_m"),
           "lies more than 10 m off", "check the unit");
    outline(c, at("clips", i, "outline_uv_m"));
    demand(c.tags.size() <= format::kMaxTags, at("clips", i, "tags"), "are more than 256");
    demand(c.bodies.size() <= format::kMaxBodies, at("clips", i, "bodies"), "are more than 64");
    for (std::size_t t = 0; t < c.tags.size() && !error_; ++t) {
      tag(c.tags[t], at("clips", i, at("tags", t)));
    }
    for (std::size_t b = 0; b < c.bodies.size() && !error_; ++b) {
      const ClipBox& body = c.bodies[b];
      demand(isPlace(body.min_m) && isPlace(body.max_m) &&
                 (body.max_m.array() > body.min_m.array()).all(),
             at("clips", i, at("bodies", b)), "is no box of positive size");
    }
  }

  void outline(const MountedClip& c, const std::string& place) {
    if (c.outline_uv_m.empty()) return;
    demand(c.outline_uv_m.size() >= 3 && c.outline_uv_m.size() <= format::kMaxOutline, place,
           "must have 3 to 64 points, or none");
    for (const Vec2& point : c.outline_uv_m) {
      demand(isPlace(point), place, "has a point more than 10 m off", "check the unit");
    }
    if (!error_) demand(isConvex(c.outline_uv_m), place, "is not convex");
  }

  void tag(const ClipTag& t, const std::string& place) {
    demand(isName(t.family), place + ".family", "is empty or too long");
    demand(t.id >= 0 && t.id <= format::kMaxTagId, place + ".id", "must be 0 to 100000");
    demand(tags_.insert({t.family, t.id}).second, place + ".id",
           "is " + std::to_string(t.id) + " for the second time");
    demand(within(t.size_m, kMinTag_m, kMaxTag_m), place + ".size_m", "must be 0.5 mm to 0.5 m",
           "check the unit");
    demand(isRotation(t.clip_from_tag.linear()), place + ".clip_from_tag.rotation",
           "is no right-handed rotation");
    demand(isPlace(t.clip_from_tag.translation()), place + ".clip_from_tag.translation_m",
           "lies more than 10 m off", "check the unit");
  }

  void cord(std::size_t i) {
    const MountedCord& c = m_.cords[i];
    demand(isName(c.cord), at("cords", i, "cord"), "is empty or too long");
    demand(cords_.insert(c.cord).second, at("cords", i, "cord"),
           "is '" + c.cord + "' for the second time");
    demand(clips_.contains(c.clip), at("cords", i, "clip"), "there is no clip '" + c.clip + "'");
    demand(isPlace(c.attachment_m), at("cords", i, "attachment_m"), "lies more than 10 m off",
           "check the unit");
    channel(c.cell, at("cords", i, "cell"));
    channel(c.actuator, at("cords", i, "actuator"));
    demand(cells_.insert(c.cell).second, at("cords", i, "cell"), "belongs to another cord already");
    demand(!c.pulley_m || isPlace(*c.pulley_m), at("cords", i, "pulley_m"),
           "lies more than 10 m off", "check the unit");
    demand(c.diameter_m > 0.0 && c.diameter_m <= kMaxDiameter_m, at("cords", i, "diameter_m"),
           "must lie between 0 and 20 mm", "check the unit");
  }

  void table(const MountedTable& t) {
    demand(clips_.contains(t.clip), "table.clip", "there is no clip '" + t.clip + "'");
    demand(isPlace(t.edge_m), "table.edge_m", "lies more than 10 m off", "check the unit");
    demand(isUnit(t.push), "table.push", "is not of unit length");
    if (t.push_actuator) channel(*t.push_actuator, "table.push_actuator");
  }

  void channel(int index, const std::string& place) {
    demand(index >= 0 && index <= format::kMaxChannel, place, "must be 0 to 255");
  }

  const Mounting& m_;
  std::string file_;
  std::set<std::string> clips_, cords_;
  std::set<std::pair<std::string, int>> tags_;
  std::set<int> cells_;
  std::optional<Error> error_;
};

}  // namespace

const MountedClip* Mounting::findClip(const std::string& id) const {
  for (const MountedClip& clip : clips) {
    if (clip.id == id) return &clip;
  }
  return nullptr;
}

Result<void> validateMounting(const Mounting& mounting, const std::string& file) {
  return Checker(mounting, file).run();
}

}  // namespace tenter
