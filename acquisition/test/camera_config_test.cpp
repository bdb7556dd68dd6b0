// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/acquisition/camera_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tenter {
namespace {

using testing::HasSubstr;

constexpr const char* kCamera = "[[cameras.camera]]\nname = \"left\"\naddress = \"10.0.0.2\"\n";

std::string refusal(const std::string& toml) {
  const auto section = parseCameraSection(toml, "rig.toml");
  return section ? "" : section.error().message();
}

TEST(CameraSection, AFileWithoutItHasNoCameras) {
  const auto section = parseCameraSection("schema_version = 1\n", "rig.toml");
  ASSERT_TRUE(section);
  EXPECT_TRUE(section->cameras.empty());
}

TEST(CameraSection, SettingsOfAllAreThoseOfEachUnlessItHasItsOwn) {
  const auto section = parseCameraSection(
      std::string("[cameras]\nexposure_us = 4000\npixel_format = \"Mono12\"\nretakes = 5\n") +
          kCamera + "[[cameras.camera]]\nname = \"right\"\nserial = \"S2\"\nexposure_us = 9000.5\n",
      "rig.toml");
  ASSERT_TRUE(section) << section.error().message();
  ASSERT_EQ(section->cameras.size(), 2U);
  EXPECT_EQ(section->retakes, 5);
  EXPECT_EQ(section->cameras[0].exposure_us, 4000.0);
  EXPECT_EQ(section->cameras[0].pixel_format, "Mono12");
  EXPECT_EQ(section->cameras[1].exposure_us, 9000.5);
  EXPECT_EQ(section->cameras[1].serial, "S2");
  EXPECT_FALSE(section->cameras[1].gain_dB);
}

TEST(CameraSection, WhatIsWrongIsNamed) {
  const std::string head = "[cameras]\n";
  EXPECT_THAT(refusal(head), HasSubstr("camera"));
  EXPECT_THAT(refusal(head + "camera = []\n"), HasSubstr("1 to 16 times"));
  EXPECT_THAT(refusal(head + "shutter = 1\n" + kCamera), HasSubstr("shutter"));
  EXPECT_THAT(refusal(head + "trigger = \"loud\"\n" + kCamera), HasSubstr("software or hardware"));
  EXPECT_THAT(refusal(head + "exposure_us = -1.0\n" + kCamera), HasSubstr("exposure_us"));
  EXPECT_THAT(refusal(head + "pixel_format = \"BayerRG8\"\n" + kCamera), HasSubstr("Mono8"));
  EXPECT_THAT(refusal(head + "set_timeout_ms = 5\n" + kCamera), HasSubstr("set_timeout_ms"));
  EXPECT_THAT(refusal(head + "packet_bytes = 100000\n" + kCamera), HasSubstr("packet_bytes"));
  EXPECT_THAT(refusal(head + kCamera + kCamera), HasSubstr("another camera has it"));
  EXPECT_THAT(
      refusal(head + kCamera + "[[cameras.camera]]\nname = \"b\"\naddress = \"10.0.0.2\"\n"),
      HasSubstr("camera left has it"));
  EXPECT_THAT(refusal(head + "[[cameras.camera]]\nname = \"a\"\n"), HasSubstr("address or serial"));
  EXPECT_THAT(refusal(head + "[[cameras.camera]]\nname = \"../a\"\naddress = \"b\"\n"),
              HasSubstr("file names"));
}

}  // namespace
}  // namespace tenter
