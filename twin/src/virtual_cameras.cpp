// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/virtual_cameras.h"

#include <mutex>
#include <sstream>

#include "camera_simulator.h"

namespace tenter {

struct VirtualCameras::State {
  std::mutex mutex;
  std::chrono::milliseconds set_timeout{};
  std::vector<std::unique_ptr<CameraSimulator>> cameras;
};

namespace {

constexpr int kNetworks = 250;

/// Whoever serves cameras too has taken some of the addresses.
std::string addressIn(int network, int camera) {
  return "127.77." + std::to_string(network) + "." + std::to_string(camera + 1);
}

}  // namespace

Result<std::unique_ptr<VirtualCameras>> VirtualCameras::serve(
    const VirtualCamerasOptions& options) {
  require(options.source != nullptr, "VirtualCameras: a source of images");
  require(options.count >= 1 && options.count <= VirtualCamerasOptions::kMostCameras,
          "VirtualCameras: 1 to 16 cameras");
  CameraSimulator::seedLosses(options.seed);
  for (int network = 1; network <= kNetworks; ++network) {
    auto state = std::make_unique<State>();
    state->set_timeout = options.set_timeout;
    for (int i = 0; i < options.count; ++i) {
      auto camera = std::make_unique<CameraSimulator>(i, addressIn(network, i), options);
      if (!camera->plugIn()) break;
      state->cameras.push_back(std::move(camera));
    }
    if (static_cast<int>(state->cameras.size()) == options.count) {
      return std::unique_ptr<VirtualCameras>(new VirtualCameras(std::move(state)));
    }
  }
  return Error{ErrorKind::kHardware, "", "virtual cameras", "no free address on the loopback",
               "does another program serve GigE Vision cameras?"};
}

VirtualCameras::VirtualCameras(std::unique_ptr<State> state) : state_(std::move(state)) {}
VirtualCameras::~VirtualCameras() = default;

int VirtualCameras::count() const { return static_cast<int>(state_->cameras.size()); }

std::string VirtualCameras::name(int camera) const {
  return state_->cameras.at(static_cast<std::size_t>(camera))->name();
}

std::string VirtualCameras::address(int camera) const {
  const std::lock_guard lock(state_->mutex);
  return state_->cameras.at(static_cast<std::size_t>(camera))->address();
}

std::string VirtualCameras::serial(int camera) const {
  return state_->cameras.at(static_cast<std::size_t>(camera))->serial();
}

std::string VirtualCameras::configuration() const {
  std::ostringstream toml;
  toml << "\n[cameras]\ntrigger = \"software\"\nexposure_us = " << kNominalExposure_us
       << "\nset_timeout_ms = " << state_->set_timeout.count()
       << "\nresend = false\ncommon_clock = true\n";
  for (int i = 0; i < count(); ++i) {
    toml << "\n[[cameras.camera]]\nname = \"" << name(i) << "\"\naddress = \"" << address(i)
         << "\"\nserial = \"" << serial(i) << "\"\n";
  }
  return toml.str();
}

void VirtualCameras::losePackets(int camera, double share) {
  const std::lock_guard lock(state_->mutex);
  state_->cameras.at(static_cast<std::size_t>(camera))->losePackets(share);
}

void VirtualCameras::unplug(int camera) {
  const std::lock_guard lock(state_->mutex);
  state_->cameras.at(static_cast<std::size_t>(camera))->pullOut();
}

Result<void> VirtualCameras::replug(int camera) {
  const std::lock_guard lock(state_->mutex);
  CameraSimulator& it = *state_->cameras.at(static_cast<std::size_t>(camera));
  if (it.plugIn()) return {};
  return Error{ErrorKind::kHardware, "", it.name(), "its address is not free any more", ""};
}

void VirtualCameras::freeze(int camera, bool frozen) {
  state_->cameras.at(static_cast<std::size_t>(camera))->freeze(frozen);
}

void VirtualCameras::overexpose(int camera, bool overexposed) {
  state_->cameras.at(static_cast<std::size_t>(camera))->overexpose(overexposed);
}

void VirtualCameras::defocus(int camera, double sigma_px) {
  state_->cameras.at(static_cast<std::size_t>(camera))->defocus(sigma_px);
}

Result<void> VirtualCameras::exchange(int camera, int other) {
  const std::lock_guard lock(state_->mutex);
  CameraSimulator& a = *state_->cameras.at(static_cast<std::size_t>(camera));
  CameraSimulator& b = *state_->cameras.at(static_cast<std::size_t>(other));
  const std::string address = a.address();
  a.pullOut();
  b.pullOut();
  a.moveTo(b.address());
  b.moveTo(address);
  if (a.plugIn() && b.plugIn()) return {};
  return Error{ErrorKind::kHardware, "", a.name(), "its address is not free any more", ""};
}

}  // namespace tenter
