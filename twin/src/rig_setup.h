// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/mechanics/cloth_system.h"
#include "tenter/twin/fabrics.h"
#include "tenter/twin/sheet_shape.h"

namespace tenter {

inline constexpr double kSampleSide_m = 0.1;

/// A cord, its pulley and, if an actuator works it during the test, its channel.
struct RigCord {
  std::string id;
  ElasticCord cord;
  int channel = -1;  ///< -1: set once and left.
  /// How much longer it is when its actuator of a served rig is at home.
  double slack_m = 0.0;
};

struct RigClip {
  std::string id, shape;
  double mass_kg = 0.0;
  Eigen::AlignedBox2d area_m;  ///< What it covers of the flat sample.
  std::vector<RigCord> cords;
};

/// One captured moment: the actuators of a channel are moved until its cords' mean tension is this.
struct RigStep {
  int channel = 0;
  double tension_N = 0.0;
  Branch branch = Branch::kLoading;
};

struct RigSetup {
  std::vector<RigClip> clips;
  std::vector<RigStep> steps;
};

/// A cord by its places in RigSetup::clips and RigClip::cords.
struct CordPlace {
  int clip, cord;
};

/// Cords in the order of the actuators that have them: first those that the protocol works, then
/// those that only hold, each in the order of the clips.
std::vector<CordPlace> actuatorOrder(const RigSetup& rig);

/// The sample as it lies flat before clips are put on.
SheetShape flatSample();

/// Names of the rig's channels, in the order of a session's lists: "axis-1", "cell-1".
std::string axisName(int axis);
std::string cellName(int axis);

/// Clips, cords and script of a protocol with cords. The sample lies over [0, kSampleSide_m]^2 in
/// the plane z = 0.
RigSetup makeRig(std::string_view protocol, const Fabric& fabric, int frames);

}  // namespace tenter
