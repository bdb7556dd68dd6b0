// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "tenter/inversion/contacts.h"
#include "tenter/inversion/inverse_shell.h"
#include "tenter/inversion/moving_obstacle.h"

namespace tenter {

/// Air that blows steadily, and how it pulls at a triangle (docs/resimulation.md).
struct AirSetup {
  Vec3 wind_m_per_s = Vec3::Zero();
  double density_kg_per_m3 = 1.2;
  double normal_drag = 1.2;       ///< Of the wind through the triangle.
  double tangential_drag = 0.02;  ///< Of the wind past it.
};

struct DynamicsOptions {
  double step_s = 0.01;               ///< Longest time step.
  double mass_damping_per_s = 0.5;    ///< Rayleigh's: force -alpha M v.
  double stiffness_damping_s = 2e-3;  ///< Rayleigh's: force -beta K v, K without negative parts.
  std::optional<AirSetup> air;        ///< None: vacuum.
  /// Second order in time where contacts do not change; otherwise backward Euler throughout.
  bool second_order = true;
  std::function<bool()> stop;  ///< Polled once a step and once an iteration.
};

/// Where a shell starts, at rest.
struct ShellStart {
  Points3 rest, pose;
  std::vector<int> fixed;
  std::vector<Contact> contacts;  ///< Touch at their present distance, with their own friction.
};

enum class ContactMode { kOff, kStuck, kSliding };

/// What one vertex does at an obstacle.
struct VertexContact {
  ContactMode mode = ContactMode::kOff;
  Vec3 force_N = Vec3::Zero();       ///< On the shell.
  Vec3 slip_m_per_s = Vec3::Zero();  ///< Tangential, relative to the obstacle.
  int obstacle = -1;
  double gap_m = std::numeric_limits<double>::infinity();  ///< Infinite where nothing is near.
};

enum class AdvanceEnd { kReached, kStopped, kStuckInTime };

/// A shell that moves: implicit time steps, each solved to a stated force together with Coulomb's
/// law on every contact (docs/resimulation.md). Not safe to share between threads.
class ShellDynamics {
 public:
  /// `shell` gives material and gravity and is not kept. Error: rest shape or supports that the
  /// forward problem refuses; a contact of an obstacle that is not there; everything is fixed.
  static Result<ShellDynamics> create(const InverseShell& shell, ShellStart start,
                                      std::vector<MovingObstacle> obstacles,
                                      DynamicsOptions options);
  ShellDynamics(ShellDynamics&&) noexcept;
  ~ShellDynamics();

  /// Steps until the time, the last step shortened to meet it. kStuckInTime: not even the shortest
  /// step could be solved; the state is that of the last good step.
  AdvanceEnd advanceTo(double time_s);

  double time_s() const;
  Points3 positions() const;                     ///< 3 x vertices [m].
  Points3 velocities() const;                    ///< 3 x vertices [m/s].
  Eigen::VectorXd coordinates() const;           ///< Positions, then edge rotations (InverseShell).
  void displace(const Points3& displacement_m);  ///< Of free vertices; before the first step.
  void setVelocities(const Points3& velocities_m_per_s);  ///< Of free vertices.
  const std::vector<VertexContact>& contacts() const;     ///< One a vertex.
  double energy_J() const;                                ///< Kinetic, elastic and of weight.
  double kineticEnergy_J() const;

  struct Counts {
    int steps = 0, rejected = 0, iterations = 0, factorizations = 0;
    double worst_residual_N = 0.0;  ///< Over all steps; of free vertices and contacts.
    double shortest_step_s = 0.0;
    double largest_displacement_m = 0.0;  ///< Of any vertex from the start, at the end of any step.
    double deepest_m = 0.0;               ///< Largest penetration at the end of any step.
  };
  const Counts& counts() const;
  double tolerance_N() const;  ///< That the residual of a step meets.

 private:
  struct Impl;
  explicit ShellDynamics(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
