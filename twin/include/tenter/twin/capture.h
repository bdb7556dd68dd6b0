// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tenter/calib/camera_calibration.h"
#include "tenter/core/measurement.h"
#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/sheet_mesh.h"
#include "tenter/twin/fabrics.h"
#include "tenter/twin/protocol.h"
#include "tenter/twin/sheet_shape.h"

namespace tenter {

struct FolderKind;

/// A fitted model in the specimen's place, for tests of recovery: components in the registry's
/// order.
struct OwnLaw {
  std::string model;
  std::vector<ComponentCurve> components;
};

struct CaptureOptions {
  std::string fabric = "knit-12";
  std::string protocol = "stretch-weft";
  std::uint64_t seed = 1;  ///< Noise, and the tiny disturbance that lets sheets buckle.
  std::uint64_t specimen =
      0;  ///< Which piece of the fabric: 0 takes `seed`; repeats of one piece share the number.
  bool scatter = true;  ///< Specimens differ; false: the nominal fabric.
  int nodes = 50;       ///< Of the simulated sheet, per side; 15 to 200.
  int frames = 60;      ///< 2 to 1000.
  DiagonalPattern diagonals = DiagonalPattern::kUniform;
  int tracked = 100;                       ///< Tracked vertices per side.
  bool noise = true;                       ///< Of positions, poses, tensions and directions.
  bool cord_friction = true;               ///< Only with noise.
  bool friction = true;                    ///< Internal friction of the cloth; never with own_law.
  bool keep_moments = false;               ///< For a renderer.
  std::optional<OwnLaw> own_law;           ///< With nodes = 25 the sheet is that of a fit.
  std::function<void(int, int)> progress;  ///< Frames done, frames in all.
  std::function<bool()> cancelled;         ///< Polled between Newton steps.
};

/// One frame as the rig was in it.
struct RigMoment {
  SheetShape shape;
  std::vector<double> positions_m;  ///< Of the actuators (MountedSpecimen), from home.
};

/// What nothing but tests and `evaluate --truth` may open.
struct CaptureTruth {
  Measurement exact;        ///< Without noise or friction of cords; same frames, same sigmas.
  nlohmann::json specimen;  ///< Constants, seed, options.
  std::optional<CameraCalibration> cameras = {};  ///< As they truly are, where there were any.
};

struct CaptureStatistics {
  int newton_steps = 0, factorizations = 0, subdivisions = 0;
  double largest_residual_N = 0.0;
  double seconds = 0.0;
};

struct CaptureResult {
  Measurement measurement;
  CaptureTruth truth;
  CaptureStatistics statistics;
  std::vector<RigMoment> moments;  ///< One a frame, if they were to be kept.
};

/// Simulates a protocol on the virtual rig and returns what cameras and load cells would have seen.
/// Equal options give equal results to the last bit, whatever the number of threads. Errors:
/// unknown fabric or protocol, options out of range, kNotConverged naming the frame.
Result<CaptureResult> captureMeasurement(const CaptureOptions& options);

/// What tells a truth's folder from others.
const FolderKind& truthFolder();

/// truth.json, exact/ (a measurement folder) and, if there were cameras, cameras.json. Complete or
/// absent; replaces an older one.
Result<void> writeTruth(const std::filesystem::path& folder, const CaptureTruth& truth);

/// A strip of the same cloth between the clamps of a tensile machine.
struct TensileOptions {
  std::string fabric = "denim-14";
  double angle_rad = 0.0;  ///< From weft to the pulling direction.
  double length_m = 0.1;   ///< Between the clamps.
  double width_m = 0.025;
  double max_force_N = 10.0;  ///< Of one strip; or until max_strain.
  double max_strain = 0.25;
  int rows = 40;
  std::uint64_t seed = 1, specimen = 0;
  bool scatter = true;
  bool noise = true;  ///< 3 mN on the force.
};

/// Loading branch, elastic: displacement and force rows as a measurement with `tensile` set.
Result<Measurement> captureTensile(const TensileOptions& options);

/// A strip clamped horizontally and hanging under its weight: reach and drop of its tip, 0.2 mm
/// noise.
struct CantileverOptions {
  std::string fabric = "denim-14";
  double angle_rad = 0.0;
  double length_m = 0.075, width_m = 0.025;
  std::uint64_t seed = 1, specimen = 0;
  bool scatter = true;
  bool noise = true;
};
Result<Measurement> captureCantilever(const CantileverOptions& options);

}  // namespace tenter
