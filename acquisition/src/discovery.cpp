// SPDX-License-Identifier: GPL-3.0-or-later
#include "discovery.h"

#include <mutex>

#include "glib_handles.h"

namespace tenter {
namespace {

/// The list of devices is one for the whole process.
std::mutex& listMutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

std::vector<FoundCamera> discoverCameras() {
  const std::lock_guard lock(listMutex());
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    FoundCamera camera;
    camera.identity.vendor = textOf(arv_get_device_vendor(i));
    camera.identity.model = textOf(arv_get_device_model(i));
    camera.identity.serial = textOf(arv_get_device_serial_nbr(i));
    camera.identity.address = textOf(arv_get_device_address(i));
    camera.protocol = textOf(arv_get_device_protocol(i));
    found.push_back(std::move(camera));
  }
  return found;
}

Result<std::string> openableName(const CameraConfig& config) {
  if (!config.address.empty()) return config.address;
  const std::lock_guard lock(listMutex());
  arv_update_device_list();
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    if (textOf(arv_get_device_serial_nbr(i)) != config.serial) continue;
    const bool by_address = textOf(arv_get_device_protocol(i)) == "GigEVision";
    return textOf(by_address ? arv_get_device_address(i) : arv_get_device_id(i));
  }
  return Error{ErrorKind::kHardware, "", config.name,
               "no camera with serial number " + config.serial + " answers",
               "`tenter cameras list` shows those that do"};
}

}  // namespace tenter
