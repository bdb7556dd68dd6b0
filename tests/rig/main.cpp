// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstdio>

#include "tenter/twin/virtual_usb.h"

int main(int argc, char** argv) {
  if (const tenter::Result<void> ready = tenter::VirtualUsb::preload(argv); !ready) {
    std::fprintf(stderr, "%s\n", ready.error().message().c_str());
    return 1;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
