// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/mounting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test_support::schemaErrors;
using test_support::sourceFolder;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const fs::path kSchema = sourceFolder() / "docs/formats/mounting.schema.json";

Eigen::Isometry3d tagPose() {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitX()));
  pose.rotate(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
  pose.translation() = Vec3(0.0123, 0.05, 0.0025);
  return pose;
}

Mounting example() {
  Mounting m;
  m.sample_size_m = {0.1, 0.12};
  m.sample_corner_m = {0.001, -0.002};
  m.thread_angle_rad = 0.25 * std::numbers::pi;
  m.thickness_m = 6e-4;
  m.areal_density_kg_per_m2 = 0.31;
  m.rest_frame = 0;
  MountedClip near;
  near.id = "near";
  near.shape = "bar";
  near.mass_kg = 0.0101;
  near.centre_of_mass_m = {0.0025, 0.05, 0.0};
  near.outline_uv_m = {{0.0, 0.0}, {0.005, 0.0}, {0.005, 0.1}, {0.0, 0.1}};
  near.tags = {{"apriltag_36h11", 7, 0.01, tagPose()}, {"apriltag_36h11", 8, 0.01, tagPose()}};
  near.bodies = {{Vec3(-0.01, 0.0, -0.0025), Vec3(0.005, 0.1, 0.0025)}};
  MountedClip table;
  table.id = "table";
  table.shape = "table";
  m.clips = {near, table};
  m.cords = {{"near/a", "near", Vec3(-0.008, 0.02, 0.0), 0, 3, Vec3(-0.12, 0.02, 0.02), 0.001},
             {"near/b", "near", Vec3(-0.008, 0.08, 0.0), 1, 3, std::nullopt, 0.001}};
  m.table = MountedTable{"table", Vec3(0.1, 0.0, 0.0), Vec3::UnitX(), 0};
  return m;
}

TEST(MountingTest, ReadsBackToTheLastBit) {
  const TemporaryFolder folder;
  const Mounting m = example();
  const auto file = folder.write("mounting.json", mountingJson(m).value());
  const Mounting read = readMounting(file).value();
  EXPECT_EQ(mountingJson(read).value(), mountingJson(m).value());
  EXPECT_EQ(read.sample_size_m, m.sample_size_m);
  EXPECT_EQ(read.thread_angle_rad, m.thread_angle_rad);
  EXPECT_EQ(read.rest_frame, m.rest_frame);
  ASSERT_NE(read.findClip("near"), nullptr);
  EXPECT_EQ(read.findClip("far"), nullptr);
  const MountedClip& clip = *read.findClip("near");
  EXPECT_EQ(clip.outline_uv_m, m.clips[0].outline_uv_m);
  EXPECT_EQ(clip.tags[1].id, 8);
  EXPECT_EQ(clip.tags[1].clip_from_tag.matrix(), tagPose().matrix());
  EXPECT_EQ(clip.bodies[0].max_m, m.clips[0].bodies[0].max_m);
  EXPECT_EQ(read.cords[0].pulley_m, m.cords[0].pulley_m);
  EXPECT_FALSE(read.cords[1].pulley_m.has_value());
  EXPECT_EQ(read.cords[1].actuator, 3);
  EXPECT_EQ(read.table->push, m.table->push);
}

TEST(MountingTest, WhatMayBeAbsentIsAbsent) {
  const TemporaryFolder folder;
  Mounting m = example();
  m.rest_frame.reset();
  m.table->push_actuator.reset();
  const Mounting read = readMounting(folder.write("m.json", mountingJson(m).value())).value();
  EXPECT_FALSE(read.rest_frame.has_value());
  EXPECT_FALSE(read.table->push_actuator.has_value());
}

TEST(MountingTest, RefusesWhatCannotBe) {
  const std::vector<std::pair<std::string, std::function<void(Mounting&)>>> damages = {
      {"sample_size_m", [](Mounting& m) { m.sample_size_m.x() = 100.0; }},
      {"sample_size_m", [](Mounting& m) { m.sample_size_m.y() = std::nan(""); }},
      {"sample_corner_m", [](Mounting& m) { m.sample_corner_m.x() = 50.0; }},
      {"thread_angle_rad", [](Mounting& m) { m.thread_angle_rad = 45.0; }},
      {"thickness_m", [](Mounting& m) { m.thickness_m = -1e-3; }},
      {"areal_density_kg_per_m2", [](Mounting& m) { m.areal_density_kg_per_m2 = 310.0; }},
      {"gravity_m_per_s2",
       [](Mounting& m) { m.gravity_m_per_s2.z() = std::numeric_limits<double>::infinity(); }},
      {"rest_frame", [](Mounting& m) { m.rest_frame = -1; }},
      {"clips[1].id", [](Mounting& m) { m.clips[1].id = "near"; }},
      {"clips[0].id", [](Mounting& m) { m.clips[0].id = ""; }},
      {"clips[0].mass_kg", [](Mounting& m) { m.clips[0].mass_kg = 10.1; }},
      {"clips[0].outline_uv_m", [](Mounting& m) { m.clips[0].outline_uv_m.resize(2); }},
      {"clips[0].outline_uv_m",
       [](Mounting& m) { std::swap(m.clips[0].outline_uv_m[0], m.clips[0].outline_uv_m[1]); }},
      {"clips[0].tags[1].id", [](Mounting& m) { m.clips[0].tags[1].id = 7; }},
      {"clips[0].tags[0].size_m", [](Mounting& m) { m.clips[0].tags[0].size_m = 10.0; }},
      {"clips[0].tags[0].clip_from_tag.rotation",
       [](Mounting& m) { m.clips[0].tags[0].clip_from_tag.linear() *= 1.01; }},
      {"clips[0].tags[0].clip_from_tag.rotation",
       [](Mounting& m) { m.clips[0].tags[0].clip_from_tag.linear().col(2) *= -1.0; }},
      {"clips[0].bodies[0]", [](Mounting& m) { m.clips[0].bodies[0].max_m.z() = -0.01; }},
      {"cords[0].clip", [](Mounting& m) { m.cords[0].clip = "nowhere"; }},
      {"cords[1].cord", [](Mounting& m) { m.cords[1].cord = "near/a"; }},
      {"cords[1].cell", [](Mounting& m) { m.cords[1].cell = 0; }},
      {"cords[0].actuator", [](Mounting& m) { m.cords[0].actuator = 256; }},
      {"cords[0].diameter_m", [](Mounting& m) { m.cords[0].diameter_m = 1.0; }},
      {"cords[0].pulley_m", [](Mounting& m) { m.cords[0].pulley_m = Vec3(120.0, 0.0, 0.0); }},
      {"table.clip", [](Mounting& m) { m.table->clip = "nowhere"; }},
      {"table.push", [](Mounting& m) { m.table->push *= 2.0; }},
  };
  ASSERT_TRUE(validateMounting(example()).ok());
  for (const auto& [place, damage] : damages) {
    Mounting m = example();
    damage(m);
    const auto valid = validateMounting(m, "m.json");
    ASSERT_FALSE(valid.ok()) << place;
    EXPECT_EQ(valid.error().place, place);
    EXPECT_EQ(valid.error().file, "m.json");
    EXPECT_FALSE(mountingJson(m).ok()) << place;
  }
}

TEST(MountingTest, AReaderNeverTrustsAFile) {
  const TemporaryFolder folder;
  const json good = json::parse(mountingJson(example()).value());
  for (const auto& [field, value] : good.items()) {
    if (field == "rest_frame" || field == "table") continue;
    json damaged = good;
    damaged.erase(field);
    EXPECT_FALSE(readMounting(folder.write("m.json", damaged.dump())).ok()) << field;
    damaged[field] = {{"not", "this"}};
    EXPECT_FALSE(readMounting(folder.write("m.json", damaged.dump())).ok()) << field;
  }
  json newer = good;
  newer["schema_version"] = kMountingSchemaVersion + 1;
  const auto refused = readMounting(folder.write("m.json", newer.dump()));
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("newer than"));
  EXPECT_FALSE(readMounting(folder / "absent.json").ok());
  EXPECT_FALSE(readMounting(folder.write("m.json", "{\"clips\":[")).ok());
}

TEST(MountingSchemaTest, WrittenFilesAreValidAndDamagedOnesAreNot) {
  const json good = json::parse(mountingJson(example()).value());
  EXPECT_THAT(schemaErrors(good, kSchema), IsEmpty());
  for (const auto& [field, value] : good.items()) {
    json damaged = good;
    damaged[field] = {{"not", "this"}};
    EXPECT_THAT(schemaErrors(damaged, kSchema), Not(IsEmpty())) << field;
  }
}

TEST(MountingPythonTest, TheReaderSeesTheSameCorners) {
  if (!fs::exists("/usr/bin/python3")) GTEST_SKIP() << "/usr/bin/python3 is not installed";
  const TemporaryFolder folder;
  const Mounting m = example();
  const auto file = folder.write("m.json", mountingJson(m).value());
  const std::string command = "PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 '" +
                              (sourceFolder() / "docs/formats/python/read_mounting.py").string() +
                              "' '" + file.string() + "'";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string output;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) output += static_cast<char>(c);
  ASSERT_EQ(pclose(pipe), 0);
  std::istringstream in(output);
  std::string clip, family;
  int id = -1;
  Vec3 corner = Vec3::Zero();
  in >> clip >> family >> id >> corner.x() >> corner.y() >> corner.z();
  EXPECT_EQ(clip, "near");
  EXPECT_EQ(id, 7);
  const Vec3 expected = tagPose() * Vec3(-0.005, -0.005, 0.0);
  EXPECT_NEAR((corner - expected).norm(), 0.0, 1e-15);
}

}  // namespace
}  // namespace tenter
