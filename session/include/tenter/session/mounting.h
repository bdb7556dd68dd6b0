// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// Version of mounting files that this program writes; older ones are migrated on reading.
inline constexpr int kMountingSchemaVersion = 1;

/// Where a session folder keeps its mounting, and the calibration of its cameras.
inline constexpr const char* kMountingFile = "mounting.json";
inline constexpr const char* kSessionCalibrationFile = "calibration/cameras.json";

/// A fiducial tag on a clip. Its frame: origin in the middle, x to the right and y down as the tag
/// is printed, z into the clip; corners in the order (-,-), (+,-), (+,+), (-,+) of half a side.
struct ClipTag {
  std::string family;   ///< As calibration boards name dictionaries: "apriltag_36h11".
  int id = 0;           ///< Distinct within a family, over all clips.
  double size_m = 0.0;  ///< Side of the black border.
  Eigen::Isometry3d clip_from_tag = Eigen::Isometry3d::Identity();
};

/// A solid part of a clip, for whoever wants to know what it may hide.
struct ClipBox {
  Vec3 min_m = Vec3::Zero(), max_m = Vec3::Zero();  ///< In the clip's frame.
};

/// A rigid body that holds cloth. Its frame is the rig's as it stands when the cloth lies at rest.
struct MountedClip {
  std::string id, shape;  ///< As in a measurement: "near", "bar".
  double mass_kg = 0.0;
  Vec3 centre_of_mass_m = Vec3::Zero();
  std::vector<Vec2> outline_uv_m;  ///< Convex polygon of the cloth that it holds; empty: a table,
                                   ///< whose hold changes as the cloth is pushed.
  std::vector<ClipTag> tags;
  std::vector<ClipBox> bodies;
};

/// A cord that pulls a clip.
struct MountedCord {
  std::string cord, clip;
  Vec3 attachment_m = Vec3::Zero();  ///< In the clip's frame.
  int cell = 0, actuator = 0;        ///< Places in the session's lists of cells and actuators.
  std::optional<Vec3> pulley_m;      ///< Where it leaves the pulley, in the rig's frame; if known.
  double diameter_m = 0.0;
};

/// The edge that a sample is pushed over.
struct MountedTable {
  std::string clip;                  ///< The clip that stands for it.
  Vec3 edge_m = Vec3::Zero();        ///< A point of the edge, in the rig's frame.
  Vec3 push = Vec3::UnitX();         ///< Unit vector in the table's plane, across the edge.
  std::optional<int> push_actuator;  ///< Place in the session's list of actuators.
};

/// What hangs in the rig during a session, and where: all that images and samples do not tell.
struct Mounting {
  Vec2 sample_size_m = Vec2::Zero();  ///< Along x and y of the rig as the sample lies at rest.
  /// Its corner of least x and y there, in the rig's plane.
  Vec2 sample_corner_m = Vec2::Zero();
  /// From the weft to the x axis at rest, counted towards the warp:
  /// (u, v) = R(thread_angle_rad) (position - sample_corner_m).
  double thread_angle_rad = 0.0;
  double thickness_m = 0.0;  ///< 0 if not measured.
  double areal_density_kg_per_m2 = 0.0;
  Vec3 gravity_m_per_s2 = kDefaultGravity;  ///< In the rig's frame.
  /// Session's frame that shows the sample flat and free of clips; later frames are of the test.
  std::optional<std::int64_t> rest_frame;
  std::vector<MountedClip> clips;
  std::vector<MountedCord> cords;
  std::optional<MountedTable> table;

  const MountedClip* findClip(const std::string& id) const;
};

/// Numbers finite and in range, names distinct, every reference there; the error names the field.
Result<void> validateMounting(const Mounting& mounting, const std::string& file = "");

/// The text of a mounting file (docs/formats/mounting.md). Error: not valid, or not UTF-8.
Result<std::string> mountingJson(const Mounting& mounting);

/// Reads and validates a mounting file. Error: file, field and reason.
Result<Mounting> readMounting(const std::filesystem::path& file);

}  // namespace tenter
