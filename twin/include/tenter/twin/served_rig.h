// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/twin/virtual_modbus.h"
#include "tenter/twin/virtual_usb.h"

namespace tenter {

struct ServedRigOptions {
  std::string fabric = "knit-12";  ///< One of fabrics().
  std::filesystem::path state;     ///< Folder for rig.toml and, with RTU, the bus.
  bool tcp = true;
  std::uint64_t seed = 1;  ///< Of the cells' noise.
};

/// Eight virtual actuators and load cells with springs between them, behind their real protocols.
/// axis-1 and axis-2 pull one bar along the weft, axis-3 and axis-4 the opposite one; axis-5 to
/// axis-8 do so along the warp. The two directions do not feel each other: this is a rig to try the
/// daemon on, not the cloth of `captureMeasurement`.
class ServedRig {
 public:
  static constexpr int kAxes = 8;
  static constexpr double kMetresPerMicrostep = 1e-6;
  static constexpr double kSlack_m = 0.004;  ///< Of a direction, with all axes at home.
  static constexpr double kCord_N_per_m = 500.0;

  /// Writes `state`/rig.toml. Precondition: VirtualUsb::preload() has returned.
  static Result<std::unique_ptr<ServedRig>> start(const ServedRigOptions& options);
  ~ServedRig();
  ServedRig(const ServedRig&) = delete;
  ServedRig& operator=(const ServedRig&) = delete;

  VirtualUsb& usb() { return *usb_; }
  VirtualCell& cell(int index) { return *cells_.at(static_cast<std::size_t>(index)); }
  std::filesystem::path configFile() const { return options_.state / "rig.toml"; }
  /// What the cord truly pulls, added force included.
  double tension_N(int axis) const;
  /// A force on one cell from outside, as of a hand on the cord.
  void addForce(int cell, double force_N);

 private:
  explicit ServedRig(ServedRigOptions options) : options_(std::move(options)) {}
  Result<void> serve();
  std::string configuration() const;

  ServedRigOptions options_;
  std::array<double, 2> fabric_N_per_m_{};
  std::array<std::atomic<double>, kAxes> position_m_{};
  std::array<std::atomic<double>, kAxes> added_N_{};
  std::vector<std::shared_ptr<VirtualCell>> cells_;
  std::vector<std::unique_ptr<VirtualModbus>> servers_;
  std::unique_ptr<VirtualUsb> usb_;
};

}  // namespace tenter
