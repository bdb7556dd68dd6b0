// SPDX-License-Identifier: GPL-3.0-or-later
#include "device_preload.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tenter/twin/virtual_usb.h"

namespace tenter::app {

Result<void> preloadDevices() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::string all((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::vector<char*> arguments;
  for (auto at = all.begin(); at != all.end(); at = std::next(std::find(at, all.end(), '\0'))) {
    arguments.push_back(&*at);
  }
  arguments.push_back(nullptr);
  return VirtualUsb::preload(arguments.data());
}

}  // namespace tenter::app
