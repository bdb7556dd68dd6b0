// SPDX-License-Identifier: GPL-3.0-or-later
// Programs of others see the virtual cameras as GigE Vision cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "served_cameras.h"

namespace tenter::test {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

std::string outputOf(const std::string& command) {
  std::FILE* pipe = popen(("timeout 20 " + command + " 2>&1").c_str(), "r");
  std::string output;
  std::array<char, 4096> piece{};
  while (pipe != nullptr && std::fgets(piece.data(), piece.size(), pipe) != nullptr) {
    output += piece.data();
  }
  if (pipe != nullptr) pclose(pipe);
  return output;
}

TEST(CameraPeers, AravisToolReadsAndWritesFeatures) {
  const ServedCameras served(2, 320, 240);
  const std::string tool = "arv-tool-0.8 -a " + served.address(1) + " control ";
  EXPECT_THAT(
      outputOf(tool + "DeviceID Width Height"),
      testing::AllOf(HasSubstr("TWIN-2"), HasSubstr("Width = 320"), HasSubstr("Height = 240")));
  EXPECT_THAT(outputOf(tool + "ExposureTimeAbs=7000"), HasSubstr("7000"));
  EXPECT_THAT(outputOf("arv-tool-0.8 -a " + served.address(0) + " features"),
              HasSubstr("AcquisitionStart"));
}

TEST(CameraPeers, AravisCameraTestGetsImages) {
  const ServedCameras served(1, 640, 480);
  const std::string output = outputOf("arv-camera-test-0.8 -n " + served.address(0) +
                                      " -r -w 640 -h 480 -f 10 --duration 2");
  EXPECT_THAT(output, ContainsRegex("n_completed_buffers *= *[1-9]"));
  EXPECT_THAT(output, Not(ContainsRegex("n_failures *= *[1-9][0-9]")));
}

}  // namespace
}  // namespace tenter::test
