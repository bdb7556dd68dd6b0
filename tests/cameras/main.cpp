// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <string_view>

#include "served_cameras.h"

int main(int argc, char** argv) {
  if (argc == 5 && std::string_view(argv[1]) == "--serve") {
    return tenter::test::serveCameras(std::stoi(argv[2]), std::stoi(argv[3]), std::stoi(argv[4]));
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
