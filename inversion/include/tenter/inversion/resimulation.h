// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tenter/inversion/problem_file.h"
#include "tenter/inversion/shell_dynamics.h"

namespace tenter {

struct ResimulationOptions {
  double seconds = 5.0;
  double frame_s = 0.04;  ///< Between frames; steps meet them.
  double gravity_scale = 1.0;
  bool rest_is_target = false;    ///< Without inversion: the target as its own rest shape.
  double perturbation_rel = 0.0;  ///< Displacement of free vertices at the start, of the size.
  unsigned seed = 20260109;
  std::vector<ObstacleMotion> motions;  ///< Of obstacles, in their order; missing ones rest.
  DynamicsOptions dynamics;
  double time_budget_s = 0.0;  ///< 0: none.
};

enum class ResimulationEnd { kComplete, kStopped, kBudget, kStuckInTime };
std::string name(ResimulationEnd end);  ///< "complete", "stopped", "budget", "not_converged".

/// How far a load change moves the shell to first order, H^-1 of the change with contacts held.
struct LinearResponse {
  double displacement_rel = 0.0;  ///< Largest of a vertex, of the size.
  double ratio = 0.0;             ///< Of the largest displacement of the simulation to this.
};

struct ResimulationSummary {
  ResimulationEnd end = ResimulationEnd::kComplete;
  double simulated_s = 0.0;
  int frames = 0;
  double size_m = 0.0, weight_N = 0.0;
  double max_displacement_rel = 0.0;  ///< Over vertices and steps, of the size.
  double end_displacement_rel = 0.0;
  int stuck = 0;    ///< Vertices that touch at the end without sliding.
  int sliding = 0;  ///< Vertices that touch at the end and slide.
  int off = 0;      ///< Contacts of the start that are apart from their obstacles at the end.
  int landed = 0;   ///< Vertices that touch at the end and did not at the start.
  std::optional<LinearResponse> linear;  ///< Where gravity was changed and the pose is stable.
  double energy_start_J = 0.0, energy_end_J = 0.0, kinetic_end_J = 0.0;
  double tolerance_N = 0.0;
  ShellDynamics::Counts counts;
  double seconds = 0.0;  ///< Wall clock, files included.
};

struct ResimulationFrame {
  double time_s = 0.0;
  Points3 positions, velocities;
  const std::vector<VertexContact>* contacts = nullptr;  ///< One a vertex.
};
/// An error ends the simulation.
using FrameSink = std::function<Result<void>(const ResimulationFrame&)>;

/// Runs the shell of an inversion in time from its target pose at rest and hands over a frame at
/// the start and then every frame_s. Takes the obstacles. Error: as ShellDynamics::create, or of
/// the sink.
Result<ResimulationSummary> resimulate(StoredInversion inversion,
                                       const ResimulationOptions& options, const FrameSink& sink);

}  // namespace tenter
