// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <thread>

#include "cord_friction.h"
#include "tenter/twin/mounted_specimen.h"

namespace tenter {

/// A mounted specimen in real time. A thread of its own solves for where the actuators are; in
/// between, tensions follow its last equilibrium to first order, so that readers never wait for a
/// solution and a late one costs an error of second order only. All members from any thread.
class LiveSpecimen {
 public:
  using Positions = MountedSpecimen::Positions;

  /// @param truth  file that gets a line for every equilibrium; empty: none.
  LiveSpecimen(std::unique_ptr<MountedSpecimen> specimen, const std::filesystem::path& truth);
  ~LiveSpecimen();
  LiveSpecimen(const LiveSpecimen&) = delete;
  LiveSpecimen& operator=(const LiveSpecimen&) = delete;

  /// To be called every few milliseconds: where all actuators are.
  void moveTo(const Positions& positions_m);
  /// What the cord pulls at the clip or at the frame's hook.
  double tension_N(int axis) const;
  /// What the cell behind the pulley feels: with the pulley's friction, and none below 0.
  double felt_N(int axis) const;
  /// The last equilibrium, and the actuators' positions that it is of; null if none hangs on cords.
  /// Until an actuator first moves, the sample as it lies flat: so it is looked at before it is
  /// hung.
  struct Still {
    Positions at_m{};
    SheetShape shape;
  };
  std::shared_ptr<const Still> still() const;

 private:
  void run();
  void writeTruth();
  std::shared_ptr<const Still> makeStill() const;
  double pull_N(int axis) const;  ///< Precondition: the lock is held.

  std::unique_ptr<MountedSpecimen> specimen_;  ///< Of the thread, but for what never changes.
  std::ofstream truth_;
  mutable std::mutex mutex_;
  std::condition_variable moved_;
  Positions positions_m_{};
  MountedSpecimen::Moment moment_;
  std::shared_ptr<const Still> still_, flat_;
  Positions found_m_{};  ///< Where each actuator was when it was first heard of.
  bool hung_ = false;
  std::array<CordFriction, MountedSpecimen::kAxes> friction_;
  bool quitting_ = false;
  std::thread thread_;
};

}  // namespace tenter
