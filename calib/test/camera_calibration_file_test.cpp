// SPDX-License-Identifier: GPL-3.0-or-later
// What is written, what the documents say of it, and what the reader in Python makes of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tenter/calib/camera_calibration.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"
#include "virtual_rig.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test_support::schemaErrors;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const fs::path kFormats = test_support::sourceFolder() / "docs/formats";
const fs::path kSchema = kFormats / "camera-calibration.schema.json";

CameraCalibration sample() {
  std::mt19937_64 random(1);
  const Board board = virtual_rig::chessboard();
  auto photos = virtual_rig::photograph(board, virtual_rig::cameras(2),
                                        virtual_rig::boardPoses(board, 8, random), 0.1, random);
  photos[1].rejected.push_back({"c1-9.png", "cannot be read"});
  CameraCalibrationOptions options;
  options.rig_index = 2;
  return *calibrateCameras(board, photos, options);
}

TEST(CameraCalibrationFileTest, ReadsBackEveryNumber) {
  const TemporaryFolder folder;
  const CameraCalibration c = sample();
  ASSERT_TRUE(writeCalibration(folder / "cal.json", c).ok());
  const auto back = readCalibration(folder / "cal.json");
  ASSERT_TRUE(back.ok()) << back.error().message();
  ASSERT_EQ(back->cameras.size(), 2u);
  const CalibratedCamera& was = c.cameras[1];
  const CalibratedCamera& is = *back->find("c1");
  EXPECT_EQ(is.model.lens().distortion, was.model.lens().distortion);
  EXPECT_EQ(is.camera_from_world.matrix(), was.camera_from_world.matrix());
  EXPECT_EQ(is.lens_sigma, was.lens_sigma);
  EXPECT_EQ(is.used.size(), was.used.size());
  EXPECT_EQ(is.rejected.back().reason, "cannot be read");
  EXPECT_EQ(back->covariance, c.covariance);
  EXPECT_EQ(back->parameters, c.parameters);
  EXPECT_EQ(back->quality.distance_rms_m, c.quality.distance_rms_m);
  EXPECT_EQ(back->rig->gravity_world_m_per_s2, c.rig->gravity_world_m_per_s2);
  EXPECT_EQ(*back->warp_m, *c.warp_m);
  EXPECT_EQ(back->board->columns, 8);
}

TEST(CameraCalibrationFileTest, AgreesWithTheSchemaAndTheSchemaSeesDamage) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeCalibration(folder / "cal.json", sample()).ok());
  const json good = json::parse(slurp(folder / "cal.json"));
  EXPECT_THAT(schemaErrors(good, kSchema), IsEmpty());
  for (const auto& [field, value] : good.items()) {
    json damaged = good;
    damaged[field] = 3.5;
    EXPECT_THAT(schemaErrors(damaged, kSchema), Not(IsEmpty())) << field;
    folder.write("damaged.json", damaged.dump());
    const auto read = readCalibration(folder / "damaged.json");
    ASSERT_FALSE(read.ok()) << field;
    EXPECT_THAT(read.error().message(), HasSubstr(field));
  }
}

TEST(CameraCalibrationFileTest, RefusesWhatIsNoCamera) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeCalibration(folder / "cal.json", sample()).ok());
  const json good = json::parse(slurp(folder / "cal.json"));
  const auto complaint = [&](const std::function<void(json&)>& damage) {
    json damaged = good;
    damage(damaged);
    folder.write("damaged.json", damaged.dump());
    const auto read = readCalibration(folder / "damaged.json");
    return read.ok() ? std::string() : read.error().message();
  };
  EXPECT_THAT(complaint([](json& j) { j["cameras"][0]["fx_px"] = -1; }),
              HasSubstr("cameras[0].fx_px"));
  EXPECT_THAT(
      complaint([](json& j) { j["cameras"][1]["camera_from_world"]["rotation"][0][0] = 2; }),
      HasSubstr("is not a rotation"));
  EXPECT_THAT(complaint([](json& j) { j["cameras"][1]["name"] = "c0"; }), HasSubstr("two cameras"));
  EXPECT_THAT(complaint([](json& j) { j["covariance"]["matrix"][0][1] = 1e9; }),
              HasSubstr("symmetric"));
  EXPECT_THAT(complaint([](json& j) { j["schema_version"] = 2; }), HasSubstr("newer"));
  EXPECT_THAT(complaint([](json& j) { j["cameras"] = json::array(); }), HasSubstr("1 to 64"));
}

TEST(CameraCalibrationFileTest, ARejectedOneIsReadOnlyOnRequest) {
  const TemporaryFolder folder;
  CameraCalibration c = sample();
  c.accepted = false;
  c.reasons = {"the board moved"};
  ASSERT_TRUE(writeCalibration(folder / "cal.json", c).ok());
  const auto refused = readCalibration(folder / "cal.json");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kCalibrationRejected);
  EXPECT_THAT(refused.error().message(), HasSubstr("the board moved"));
  EXPECT_TRUE(readCalibration(folder / "cal.json", true).ok());
}

TEST(CameraCalibrationPythonTest, ProjectsAsTheModelDoes) {
  if (!fs::exists("/usr/bin/python3")) GTEST_SKIP() << "/usr/bin/python3 is not installed";
  const TemporaryFolder folder;
  const CameraCalibration c = sample();
  ASSERT_TRUE(writeCalibration(folder / "cal.json", c).ok());
  const std::string script = (kFormats / "python/read_camera_calibration.py").string();
  const std::string command = "PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 '" + script + "' '" +
                              (folder / "cal.json").string() + "' 0.05 -0.04 0.8 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string output;
  for (int ch = std::fgetc(pipe); ch != EOF; ch = std::fgetc(pipe)) output += static_cast<char>(ch);
  ASSERT_EQ(pclose(pipe), 0) << output;
  std::istringstream in(output);
  for (const CalibratedCamera& camera : c.cameras) {
    std::string name;
    double x = 0.0, y = 0.0;
    in >> name >> x >> y;
    const auto pixel = camera.model.project(camera.camera_from_world * Vec3(0.05, -0.04, 0.8));
    EXPECT_EQ(name, camera.name);
    EXPECT_NEAR(x, pixel->x(), 1e-8);
    EXPECT_NEAR(y, pixel->y(), 1e-8);
  }
}

}  // namespace
}  // namespace tenter
