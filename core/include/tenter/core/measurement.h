// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/mesh.h"

namespace tenter {

/// Version of measurement folders that this program writes; older ones are migrated on reading.
inline constexpr int kMeasurementSchemaVersion = 1;

/// One cord at one moment: it pulls its clip along `direction` with `tension_N`.
struct CordReading {
  std::string cord;                  ///< Identity, as the rig names it.
  std::string clip;                  ///< Clip that it is tied to.
  Vec3 attachment_m = Vec3::Zero();  ///< Point of attachment in the clip's frame.
  Vec3 direction =
      Vec3::UnitX();  ///< Unit vector in the rig's frame, from the clip towards the pulley.
  double tension_N = 0.0;
  double tension_sigma_N = 0.0;  ///< Standard deviation.
};

/// One clip at one moment. A table that carries part of the cloth is a clip too (held, without
/// cords).
struct ClipReading {
  std::string clip;
  Eigen::Isometry3d rig_from_clip =
      Eigen::Isometry3d::Identity();  ///< Identity when the cloth lies at rest.
  std::vector<int> clamped_vertices;  ///< Ids of rest vertices that it holds; sorted.
  std::vector<Vec2>
      outline_uv_m;  ///< Convex polygon in material coordinates that it covers; may be empty.
};

enum class Branch { kUnknown, kLoading, kUnloading };

/// One static moment of a test. Which parts are present depends on the kind of measurement.
struct MeasurementFrame {
  std::int64_t time_ns = 0;          ///< Since the session's start.
  Branch branch = Branch::kUnknown;  ///< Loading and unloading differ in cloth and are kept apart.
  std::vector<ClipReading> clips;    ///< Cloth captures.
  std::vector<CordReading> cords;    ///< Cloth captures.
  Points3 positions;  ///< Cloth captures: 3 x n tracked vertices [m]; 3 x 0 if the frame has none.
  Eigen::VectorXd position_sigma_m;  ///< n standard deviations per axis [m].
  Points3 position_sigma_axes_m;     ///< 3 x n, of x, y and z apart; 3 x 0 if they are not known.
  std::vector<std::uint8_t> valid;   ///< n; 0 where a vertex was not seen.
  double displacement_m = 0.0;       ///< Tensile: travel of the moving clamp.
  double force_N = 0.0;              ///< Tensile: total force over all strips.
  double force_sigma_N = 0.0;        ///< Tensile: its standard deviation.
  double reach_m = 0.0,
         drop_m = 0.0;  ///< Cantilever: horizontal and downward distance of the tip from the clamp.
  double tip_sigma_m = 0.0;  ///< Cantilever: standard deviation of each.
};

struct ClipInfo {
  std::string id;
  double mass_kg = 0.0;
  std::string shape;  ///< "bar", "corner", "table"; free text.
};

/// A clamped strip pulled along its length. Rest gauge length is at zero force.
struct TensileSetup {
  double length_m = 0.0;       ///< Between clamps, at displacement 0 of the file.
  double width_m = 0.0;        ///< Of one strip.
  int strips = 1;              ///< Equal strips side by side; the force is the sum over them.
  double angle_rad = 0.0;      ///< From the fabric's first axis (weft) to the pulling direction.
  double zero_offset_m = 0.0;  ///< Stretch that the strip already had at displacement 0.
  std::string
      zero_strain_rule;  ///< How `zero_offset_m` came about: "first-row", "extrapolate", "given".
};

/// A strip clamped horizontally and hanging under its own weight.
struct CantileverSetup {
  double length_m = 0.0;
  double width_m = 0.0;
  double angle_rad = 0.0;  ///< From weft to the strip's length.
};

/// What a session hands to a fit [Est12] sec. 3: the only input of a fit. A folder on disk
/// (docs/formats/measurement.md).
struct Measurement {
  std::string name;  ///< Shown in reports; the folder's name when read.
  std::string fabric;
  std::string specimen;  ///< Which piece of the fabric; repeats share it.
  std::string protocol;  ///< "stretch-weft", "shear", "bend-warp", "tensile", "cantilever" ...
  double areal_density_kg_per_m2 = 0.0;
  double thickness_m = 0.0;           ///< 0 if not measured.
  Vec2 sample_size_m = Vec2::Zero();  ///< Extent along weft and warp.
  Vec3 gravity_m_per_s2 = kDefaultGravity;
  std::vector<ClipInfo> clips;
  double clip_position_sigma_m = 0.0;  ///< Standard deviation of clip poses per axis.
  double clip_rotation_sigma_rad = 0.0;
  std::optional<TriangleMesh> rest;  ///< Cloth captures: tracked mesh at rest with uv.
  std::optional<TensileSetup> tensile;
  std::optional<CantileverSetup> cantilever;
  std::vector<MeasurementFrame> frames;
  std::string content_sha256;  ///< Filled when read.
};

/// Reads and validates a measurement folder. Every error names file, line or field, and the reason.
Result<Measurement> readMeasurement(const std::filesystem::path& folder);

/// Writes a folder that is complete or absent; replaces an older measurement there.
Result<void> writeMeasurement(const std::filesystem::path& folder, const Measurement& measurement);

/// The checks that reading makes, for measurements made in memory: finite numbers, positive masses,
/// SI magnitudes (a 100 m sample or a 4,000 kg/m^2 cloth is a swapped unit), ids in range, unit
/// directions, ordered times.
Result<void> validateMeasurement(const Measurement& measurement, const std::string& file = "");

}  // namespace tenter
