// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/calibration_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::slurp;
using test_support::TemporaryFolder;
using testing::HasSubstr;

const cv::Matx33d kMatrix1(1200.5, 0, 641.25, 0, 1201.5, 479.75, 0, 0, 1);
const cv::Matx33d kMatrix2(1190.25, 0, 630.5, 0, 1191.5, 485.0, 0, 0, 1);
const cv::Mat kLens1 = (cv::Mat_<double>(1, 5) << -0.25, 0.11, 0.001, -0.002, 0.03);
const cv::Mat kLens2 = (cv::Mat_<double>(5, 1) << -0.26, 0.12, 0.0, 0.0, 0.0);
const cv::Matx33d kRotation(0.96, 0, -0.28, 0, 1, 0, 0.28, 0, 0.96);
const cv::Vec3d kTranslation(-83.0, 1.5, 12.0);

/// A pair as OpenCV itself writes it.
void writePair(const std::string& file) {
  cv::FileStorage out(file, cv::FileStorage::WRITE);
  out << "image_width" << 1280 << "image_height" << 960;
  out << "M1" << cv::Mat(kMatrix1) << "D1" << kLens1 << "M2" << cv::Mat(kMatrix2) << "D2" << kLens2;
  out << "R" << cv::Mat(kRotation) << "T" << cv::Mat(kTranslation);
  out << "note"
      << "a text that is none of our business";
}

void expectPair(const Result<CameraCalibration>& c) {
  ASSERT_TRUE(c.ok()) << c.error().message();
  ASSERT_EQ(c->cameras.size(), 2u);
  EXPECT_EQ(c->cameras[0].name, "left");
  EXPECT_EQ(c->cameras[0].model.widthPx(), 1280);
  EXPECT_EQ(c->cameras[0].model.lens().fx_px, 1200.5);
  EXPECT_EQ(c->cameras[0].model.lens().distortion[4], 0.03);
  EXPECT_EQ(c->cameras[1].model.lens().cx_px, 630.5);
  EXPECT_EQ(c->cameras[1].model.lens().distortion[1], 0.12);
  EXPECT_NEAR(c->cameras[1].camera_from_world.translation().x(), -0.083, 1e-12);
  EXPECT_NEAR(c->cameras[1].camera_from_world.linear()(0, 2), -0.28, 1e-12);
  EXPECT_TRUE(c->warnings.empty()) << testing::PrintToString(c->warnings);
}

TEST(CalibrationImportTest, ReadsWhatOpenCvWritesInAllItsFormats) {
  const TemporaryFolder folder;
  for (const char* name : {"pair.yml", "pair.xml", "pair.json"}) {
    SCOPED_TRACE(name);
    writePair((folder / name).string());
    expectPair(importCalibration({folder / name}, {}));
  }
}

TEST(CalibrationImportTest, TwoFilesAreReadAsOne) {
  const std::string inside =
      "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1200., "
      "0., "
      "640.,\n       0., 1201., 480., 0., 0., 1. ]\nD1: !!opencv-matrix\n   rows: 1\n   cols: 4\n  "
      " "
      "dt: d\n   data: [ -.1, 0., 0., 0. ]\nM2: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: "
      "d\n  "
      " data: [ 1200., 0., 640., 0., 1201., 480., 0., 0., 1. ]\n";
  const std::string outside =
      "%YAML:1.0\n---\nR: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ 0., 0.1, "
      "0. "
      "]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ -0.1, 0., 0. ]\n";
  const auto alone = importCalibrationTexts({{"intrinsics.yml", inside}}, {});
  ASSERT_FALSE(alone.ok());
  EXPECT_THAT(alone.error().message(), HasSubstr("extrinsics.yml"));
  CalibrationImportOptions metres;
  metres.unit_m = 1.0;
  const auto c =
      importCalibrationTexts({{"intrinsics.yml", inside}, {"extrinsics.yml", outside}}, metres);
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_NEAR(baseline_m(c->cameras[0], c->cameras[1]), 0.1, 1e-12);
  EXPECT_EQ(c->cameras[0].model.widthPx(), 1281);  // guessed, and said so
  EXPECT_THAT(c->warnings.at(0), HasSubstr("--size"));
}

TEST(CalibrationImportTest, ReadsTheNamesOfOtherPrograms) {
  const auto ros = importCalibrationTexts(
      {{"camera.yaml",
        "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  "
        "cols: "
        "3\n  data: [600.5, 0, 320, 0, 601, 240, 0, 0, 1]\ndistortion_model: plumb_bob\n"
        "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0, 0, 0]\n"}},
      {});
  ASSERT_TRUE(ros.ok()) << ros.error().message();
  EXPECT_EQ(ros->cameras[0].model.lens().fx_px, 600.5);
  EXPECT_EQ(ros->cameras[0].model.lens().distortion[1], -0.2);
  const auto json = importCalibrationTexts(
      {{"c.json",
        R"({"imageSize":[640,480],"K":[[600,0,320],[0,601,240],[0,0,1]],"dist":[[0.1,0,0,0]]})"}},
      {});
  ASSERT_TRUE(json.ok()) << json.error().message();
  EXPECT_EQ(json->cameras[0].model.lens().fy_px, 601.0);
  EXPECT_EQ(json->cameras[0].model.lens().distortion[0], 0.1);
}

std::string dice(const std::string& model, const std::string& more, const std::string& second) {
  const std::string camera =
      "<Parameter name=\"CX\" type=\"double\" value=\"640.5\"/><Parameter name=\"CY\" "
      "type=\"double\" "
      "value=\"480\"/><Parameter name=\"FX\" type=\"double\" value=\"2.0e3\"/><Parameter "
      "name=\"FY\" "
      "type=\"double\" value=\"2010\"/><Parameter name=\"IMAGE_HEIGHT_WIDTH\" type=\"string\" "
      "value=\"{ 960, 1280 }\"/><Parameter name=\"LENS_DISTORTION_MODEL\" type=\"string\" "
      "value=\"" +
      model + "\"/>" + more;
  return "<ParameterList><!-- a comment --><Parameter name=\"xml_file_format\" type=\"string\" "
         "value=\"DICe_xml_camera_system_file\"/><ParameterList name=\"CAMERA 0\">" +
         camera + "</ParameterList><ParameterList name=\"CAMERA 1\">" + camera + second +
         "</ParameterList></ParameterList>";
}

std::string parameter(const std::string& name, const std::string& value) {
  return "<Parameter name=\"" + name + "\" type=\"double\" value=\"" + value + "\"/>";
}

TEST(CalibrationImportTest, ReadsDiceCameraSystems) {
  const auto c = importCalibrationTexts(
      {{"cal.xml",
        dice("OPENCV_LENS_DISTORTION", parameter("K1", "-0.1") + parameter("P2", "1e-3"),
             parameter("ALPHA", "10") + parameter("BETA", "-20") + parameter("GAMMA", "30") +
                 parameter("TX", "120") + parameter("TZ", "15"))}},
      {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_EQ(c->source, "DICe");
  const CalibratedCamera& right = c->cameras.at(1);
  EXPECT_EQ(right.model.widthPx(), 1280);
  EXPECT_EQ(right.model.lens().distortion[3], 1e-3);
  EXPECT_NEAR(right.camera_from_world.translation().x(), 0.120, 1e-12);
  // R(2,0) = -sin(beta), R(1,0) = cos(beta) sin(gamma), R(2,1) = sin(alpha) cos(beta).
  const double degree = std::numbers::pi / 180.0;
  const Mat3 r = right.camera_from_world.linear();
  EXPECT_NEAR(r(2, 0), std::sin(20 * degree), 1e-12);
  EXPECT_NEAR(r(1, 0), std::cos(20 * degree) * std::sin(30 * degree), 1e-12);
  EXPECT_NEAR(r(2, 1), std::sin(10 * degree) * std::cos(20 * degree), 1e-12);
}

TEST(CalibrationImportTest, ConvertsTheLensModelsOfDiceThatCanBe) {
  const auto lens = [](const std::string& model, const std::string& more) {
    return importCalibrationTexts({{"cal.xml", dice(model, more, parameter("TX", "90"))}}, {});
  };
  const auto factor = lens("K1R1_K2R2_K3R3", parameter("K1", "0.05") + parameter("K3", "0.21"));
  ASSERT_TRUE(factor.ok()) << factor.error().message();
  // x (1 + k1 + k3 r^2) at r = 0.1 along x.
  const auto pixel = factor->cameras[0].model.project({0.1, 0.0, 1.0});
  EXPECT_NEAR(pixel->x(), 640.5 + 2000.0 * 0.1 * (1.0 + 0.05 + 0.21 * 0.01), 1e-9);
  const auto odd = lens("K1R3_K2R5_K3R7", parameter("K2", "0.3"));
  ASSERT_TRUE(odd.ok());
  EXPECT_EQ(odd->cameras[0].model.lens().distortion[1], 0.3);
  EXPECT_THAT(lens("K1R2_K2R4_K3R6", parameter("K1", "0.1")).error().message(),
              HasSubstr("CAMERA 0.K1"));
  EXPECT_THAT(lens("VIC3D_LENS_DISTORTION", parameter("K1", "0.1")).error().message(),
              HasSubstr("not published"));
  EXPECT_THAT(lens("OPENCV_LENS_DISTORTION", parameter("T1", "0.1")).error().message(),
              HasSubstr("tilt"));
  EXPECT_THAT(lens("MADE_UP", "").error().message(), HasSubstr("'MADE_UP' is not known"));
}

TEST(CalibrationImportTest, HostileTextIsRefusedWithAReason) {
  const std::string bomb =
      "<?xml version=\"1.0\"?><!DOCTYPE x [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;\">]>"
      "<opencv_storage><K>&b;</K></opencv_storage>";
  const std::string outside =
      "<?xml version=\"1.0\"?><!DOCTYPE x [<!ENTITY a SYSTEM \"file:///etc/passwd\">]>"
      "<opencv_storage><K>&a;</K></opencv_storage>";
  std::string deep, deep_end;
  for (int i = 0; i < 5000; ++i) deep += "<a>";
  const std::string huge =
      "<opencv_storage><K "
      "type_id=\"opencv-matrix\"><rows>1000000</rows><cols>1000000</cols><dt>d</dt>"
      "<data>1</data></K></opencv_storage>";
  const std::string short_data =
      "<opencv_storage><K><rows>3</rows><cols>3</cols><data>1 2</data></K></opencv_storage>";
  const std::string nan =
      "<opencv_storage><K><rows>1</rows><cols>1</cols><data>.Nan</data></K></opencv_storage>";
  const std::pair<std::string, std::string> cases[] = {
      {bomb, "entities"},          {outside, "entities"},
      {deep, "nested too deeply"}, {huge, "no camera matrix"},
      {short_data, "2 numbers"},   {nan, "finite"},
      {"<a><b></a>", "XML"},       {"<nonsense/>", "no calibration of OpenCV or DICe"},
      {"", "no camera matrix"},    {"K: [ 1, 2", "3 x 3"},
      {"{\"K\":", "JSON"},         {std::string("\0\1\2", 3), "no camera matrix"},
      {"<project/>", "Vic-3D"}};
  for (const auto& [text, reason] : cases) {
    const auto c = importCalibrationTexts({{"hostile", text}}, {});
    ASSERT_FALSE(c.ok()) << text.substr(0, 80);
    EXPECT_EQ(c.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(c.error().message(), HasSubstr(reason)) << text.substr(0, 80);
  }
}

TEST(CalibrationImportTest, AnyCutOfAGoodFileIsRefusedOrRead) {
  const TemporaryFolder folder;
  for (const char* name : {"pair.yml", "pair.xml", "pair.json"}) {
    writePair((folder / name).string());
    const std::string whole = slurp(folder / name);
    for (std::size_t length = 0; length < whole.size(); length += 7) {
      const auto c = importCalibrationTexts({{name, whole.substr(0, length)}}, {});
      EXPECT_TRUE(c.ok() || !c.error().reason.empty()) << name << " " << length;
    }
  }
}

}  // namespace
}  // namespace tenter
