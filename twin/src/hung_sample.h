// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "rig_setup.h"
#include "virtual_cloth.h"

namespace tenter {

/// A sample of cloth in free clips on cords, as a protocol hangs it: what captures and the served
/// rig have in common.
class HungSample {
 public:
  /// Of `options` counts what the sheet is made of and how it hangs: protocol, nodes, diagonals,
  /// friction, seed. Precondition: the protocol has cords.
  HungSample(const CaptureOptions& options, const Fabric& specimen, const ClothSource& cloth);
  HungSample(const HungSample&) = delete;
  HungSample& operator=(const HungSample&) = delete;

  /// Puts the flat sheet into the clips, with the seeded disturbance that lets it buckle.
  Result<void> build();

  const RigSetup& rig() const { return rig_; }
  const GridLines& lines() const { return lines_; }
  /// Edges of the clips along x (0) and y (1).
  const std::vector<double>& stops(int axis) const { return stops_[axis]; }
  ClothSystem& system() { return *system_; }
  const ClothSystem& system() const { return *system_; }
  EquilibriumSolver& solver() { return *solver_; }
  ClothState& state() { return state_; }
  const ClothState& state() const { return state_; }

  /// A cord's free length as the protocol begins, less what its actuator has drawn in.
  void draw(int clip, int cord, double drawn_m);
  double tension_N(int clip, int cord) const { return system_->cordTension_N(state_, clip, cord); }
  /// True if the state is now a stable equilibrium; otherwise it is as it was.
  bool solve(CaptureStatistics& statistics, const std::function<bool()>& cancelled = {});
  /// Brings every slider of the cloth's friction to where the strain has carried it.
  void commit();

 private:
  void disturb();

  RigSetup rig_;
  ClothSource cloth_;
  std::uint64_t seed_;
  std::string protocol_;
  double areal_density_;
  std::vector<double> stops_[2];
  GridLines lines_;
  std::shared_ptr<FrictionalLaw> friction_;
  std::optional<ClothSystem> system_;
  std::optional<EquilibriumSolver> solver_;
  ClothState state_;
};

/// Vertices of a flat mesh that lie under a clip.
std::vector<int> heldBy(const Eigen::AlignedBox2d& area, const Points3& rest);

}  // namespace tenter
