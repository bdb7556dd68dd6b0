// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/twin/mounted_specimen.h"
#include "tenter/twin/scene_renderer.h"
#include "tenter/twin/virtual_cameras.h"
#include "tenter/twin/virtual_modbus.h"
#include "tenter/twin/virtual_usb.h"

namespace tenter {

struct ServedRigOptions {
  MountOptions mount;           ///< What hangs in it; the seed is also that of the cells' noise.
  std::filesystem::path state;  ///< Folder for rig.toml, the truth and, with RTU, the bus.
  bool tcp = true;
  std::optional<VirtualCamerasOptions> cameras;  ///< Nothing: it has none.
  /// Cameras that look at the sample: their number and size, and how it is rendered; in place of
  /// `cameras`. Protocol, seeds and piece are those of `mount`.
  struct Scene {
    RigCameraOptions cameras;
    RenderOptions render;
    double calibration_error_px = 0.02;  ///< Of calibration.json in the state folder.
  };
  std::optional<Scene> scene;
};

class LiveSpecimen;

/// rig.toml of the served rig without cameras. `slack_N`: nothing: of a cloth that weighs nothing.
/// Cell i answers at addresses[i] as unit units[i]; empty: at places that nobody serves.
std::string servedRigToml(const std::string& name, std::optional<double> slack_N = {},
                          const std::vector<std::string>& addresses = {},
                          const std::vector<int>& units = {});

/// Eight virtual actuators and load cells behind their real protocols, and between them a sample of
/// cloth on cords (MountedSpecimen says which actuator has which).
class ServedRig {
 public:
  static constexpr int kAxes = 8;
  static constexpr double kMetresPerMicrostep = 1e-6;

  /// Writes `state`/rig.toml, mount.json and truth.jsonl, what hangs there and how it truly pulls;
  /// with a scene also mounting.json, calibration.json and images.jsonl, what each image truly
  /// shows.
  /// Precondition: VirtualUsb::preload() has returned.
  static Result<std::unique_ptr<ServedRig>> start(const ServedRigOptions& options);
  ~ServedRig();
  ServedRig(const ServedRig&) = delete;
  ServedRig& operator=(const ServedRig&) = delete;

  VirtualUsb& usb() { return *usb_; }
  VirtualCameras* cameras() { return cameras_.get(); }  ///< Null without any.
  VirtualCell& cell(int index) { return *cells_.at(static_cast<std::size_t>(index)); }
  std::filesystem::path configFile() const { return options_.state / "rig.toml"; }
  /// What the cord truly pulls at the clip or hook.
  double tension_N(int axis) const;
  /// What its cell feels: friction of the pulley and added force included.
  double felt_N(int axis) const;
  /// A force on one cell from outside, as of a hand on the cord.
  void addForce(int cell, double force_N);

 private:
  ServedRig(ServedRigOptions options, std::unique_ptr<MountedSpecimen> specimen);
  Result<void> serve();
  Result<void> serveCameras();
  void follow(int device, double position_m);
  std::string configuration() const;

  ServedRigOptions options_;
  double home_N_ = 0.0;  ///< Highest tension with all axes at home.
  std::unique_ptr<LiveSpecimen> specimen_;
  std::array<std::atomic<double>, kAxes> position_m_{};
  std::array<std::atomic<double>, kAxes> added_N_{};
  std::vector<std::shared_ptr<VirtualCell>> cells_;
  std::vector<std::unique_ptr<VirtualModbus>> servers_;
  std::unique_ptr<VirtualUsb> usb_;
  std::unique_ptr<VirtualCameras> cameras_;
};

}  // namespace tenter
