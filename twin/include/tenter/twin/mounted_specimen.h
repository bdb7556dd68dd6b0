// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/twin/sheet_shape.h"

namespace tenter {

struct MountOptions {
  std::string fabric = "knit-12";         ///< One of fabrics().
  std::string protocol = "stretch-weft";  ///< How the sample hangs: one of protocols().
  std::uint64_t seed = 1;                 ///< Of the disturbance that lets the sheet buckle.
  std::uint64_t specimen = 0;             ///< Which piece of the fabric; 0: as `seed`.
  int nodes = 25;                         ///< Of the simulated sheet, per side; 15 to 200.
  /// "free": the sample hangs on them. "held": fixed where they are with the sample at rest, so
  /// that cords alone give way. "unhooked": every cord is hooked to the frame instead.
  std::string clips = "free";
};

/// The options as a file that says what hung in a rig, and back. Errors name the field.
nlohmann::json mountToJson(const MountOptions& options);
Result<MountOptions> readMount(const std::filesystem::path& file);

/// The sample of a protocol with an actuator on every cord, as quasi-static as cloth is at a
/// millimetre a second: at every moment it is in equilibrium with the actuators, and its internal
/// friction remembers the path. The sample, clips and cords are those of `captureMeasurement`; at
/// home each cord is let out by some millimetres from where the protocol begins. Axes are numbered
/// as the shipped protocols take them: first those that a protocol works, then those that only
/// hold. The table tests have no cords: axis-1 pushes the sample, no force is felt, and nothing is
/// simulated. One instance serves one thread.
class MountedSpecimen {
 public:
  static constexpr int kAxes = 8;
  static constexpr double kHookSlack_m = 0.004, kHook_N_per_m = 60.0;
  /// Of the actuators, growing as they draw in [m]; 0 at home.
  using Positions = std::array<double, kAxes>;

  /// One equilibrium and what is near it.
  struct Moment {
    Positions at_m{};
    std::array<double, kAxes> tension_N{};  ///< 0 for an actuator without a cord.
    Eigen::Matrix<double, kAxes, kAxes> stiffness_N_per_m =
        Eigen::Matrix<double, kAxes, kAxes>::Zero();  ///< d(tension)/d(position).

    /// To first order, and never below 0; the error is of second order in the way from `at_m`.
    double tensionNear_N(int axis, const Positions& positions_m) const;
  };

  struct Statistics {
    int solves = 0, newton_steps = 0, failures = 0;
    /// Of what the moment before foretold, against the equilibrium found [N].
    double largest_error_N = 0.0, sum_of_squares_N2 = 0.0;
    double largest_residual_N = 0.0;
    double rmsError_N() const;
  };

  /// Hangs the sample and lets it down to home. Errors: unknown fabric or protocol, options out of
  /// range, kNotConverged.
  static Result<std::unique_ptr<MountedSpecimen>> hang(const MountOptions& options);
  ~MountedSpecimen();

  /// Follows the actuators, in as many steps as it takes. False if there is no equilibrium to be
  /// found on the way: the specimen then stays where it was last.
  bool follow(const Positions& positions_m);

  const Moment& moment() const;
  /// The sheet and its clips at that moment; nothing if no sample hangs on cords.
  std::optional<SheetShape> shape() const;
  const Statistics& statistics() const;
  bool hasCord(int axis) const;
  /// Whether anything hangs on cords at all; otherwise the sample lies on the table.
  bool hasCords() const;
  /// Of an actuator whose cord is hooked to the frame by a soft spring, because the protocol has no
  /// other use for it. 0 for the others.
  double hookTension_N(int axis, double position_m) const;
  std::string cordName(int axis) const;  ///< "near/a"; empty without a cord.
  /// Whether cord runs over the axis' pulley.
  bool hasPulley(int axis) const;
  /// Free cord between clip and pulley, at that moment's tension; of a cord that is hooked to the
  /// frame, but for a constant.
  double cordLength_m(int axis, double position_m, double tension_N) const;
  const MountOptions& options() const;

 private:
  struct Impl;
  explicit MountedSpecimen(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
