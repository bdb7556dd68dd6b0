// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/twin/image_source.h"

namespace tenter {

struct VirtualCamerasOptions {
  static constexpr int kMostCameras = 16;
  int count = 4;
  int width_px = 1936, height_px = 1210;
  std::uint64_t seed = 1;  ///< Of which packets are lost.
  /// How long a set of images may take; a source that has to render them takes its time.
  std::chrono::milliseconds set_timeout{2000};
  std::shared_ptr<ImageSource> source;
};

/// GigE Vision cameras, "cam-1" and so on, each at an address of its own of this machine's
/// loopback, that any GigE Vision program sees. They take software triggers, or run freely. All
/// members from any thread.
class VirtualCameras {
 public:
  /// Error: no free addresses.
  static Result<std::unique_ptr<VirtualCameras>> serve(const VirtualCamerasOptions& options);
  ~VirtualCameras();
  VirtualCameras(const VirtualCameras&) = delete;
  VirtualCameras& operator=(const VirtualCameras&) = delete;

  int count() const;
  std::string name(int camera) const;
  std::string address(int camera) const;
  std::string serial(int camera) const;
  /// Table `cameras` of a rig's file.
  std::string configuration() const;

  /// So many of the camera's packets do not arrive, 0 to 1.
  void losePackets(int camera, double share);
  void unplug(int camera);
  /// Error: its address is not free any more.
  Result<void> replug(int camera);
  /// It goes on sending the image that it sent last.
  void freeze(int camera, bool frozen);
  /// Eight times the light.
  void overexpose(int camera, bool overexposed);
  /// A blur of so many pixels (one sigma); 0: sharp.
  void defocus(int camera, double sigma_px);
  /// The two cameras' cables are exchanged: each comes back at the other's address.
  Result<void> exchange(int camera, int other);

 private:
  struct State;
  explicit VirtualCameras(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tenter
