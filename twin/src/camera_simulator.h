// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tenter/twin/virtual_cameras.h"

namespace tenter {

/// One GigE Vision simulator. Plugging, moving and losses: from one thread at a time.
class CameraSimulator {
 public:
  CameraSimulator(int index, std::string address, const VirtualCamerasOptions& options);
  ~CameraSimulator();
  CameraSimulator(const CameraSimulator&) = delete;
  CameraSimulator& operator=(const CameraSimulator&) = delete;

  /// Which packets are lost is drawn by the simulators' library, for all cameras of the process.
  static void seedLosses(std::uint64_t seed);

  /// False: its address is taken.
  bool plugIn();
  void pullOut();
  /// Precondition: pulled out.
  void moveTo(const std::string& address) { address_ = address; }

  std::string name() const { return "cam-" + std::to_string(index_ + 1); }
  std::string serial() const { return "TWIN-" + std::to_string(index_ + 1); }
  const std::string& address() const { return address_; }

  void losePackets(double share);
  void freeze(bool frozen) { frozen_ = frozen; }
  void overexpose(bool overexposed) { overexposed_ = overexposed; }
  void defocus(double sigma_px) { blur_px_ = sigma_px; }

 private:
  struct Simulator;
  void fill(int width_px, int height_px, double exposure_us, double gain_dB, std::uint8_t* pixels);

  const int index_;
  std::string address_;
  const VirtualCamerasOptions options_;
  double lost_share_ = 0.0;
  std::atomic<bool> frozen_{false}, overexposed_{false};
  std::atomic<double> blur_px_{0.0};
  std::uint64_t frame_ = 0;  ///< Of the simulator's thread, as the next one.
  std::vector<std::uint8_t> last_;
  std::unique_ptr<Simulator> simulator_;
};

}  // namespace tenter
