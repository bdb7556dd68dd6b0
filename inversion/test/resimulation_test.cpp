// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/resimulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "shell_samples.h"
#include "tenter/core/mesh_io.h"
#include "tenter/inversion/inversion_files.h"
#include "tenter/inversion/material_directions.h"
#include "tenter/inversion/resimulation_files.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

Material twoConstants(double factor) {
  Material material;
  material.law = "edge-hinge";
  material.areal_density_kg_per_m2 = 0.1;
  const auto add = [&](const char* name, double value) {
    MaterialComponent component;
    component.name = name;
    component.curve = StiffnessCurve::constant(value);
    material.components.push_back(std::move(component));
  };
  add("edge_stretch", 3.0 * factor);
  add("hinge_bend", 5e-3 * factor);
  return material;
}

/// A half cylinder that stands on its two long edges, with uv.
TriangleMesh arch(int n) {
  TriangleMesh mesh = test::bentTarget(n, n);
  const double radius = 1.0 / std::numbers::pi;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double a = std::numbers::pi * i / (n - 1);
      mesh.positions.col(j * n + i) = Vec3(-radius * std::cos(a), double(j) / (n - 1),
                                           i == 0 || i == n - 1 ? 0.0 : radius * std::sin(a));
      mesh.uv.col(j * n + i) = Vec2(radius * a, double(j) / (n - 1));
    }
  }
  return mesh;
}

/// An arch on a floor, inverted once and written to a folder.
class ResimulationTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test_support::TemporaryFolder;
    store("arch", RestKind::kMesh);
  }
  static void store(const char* name, RestKind rest) {
    const ProblemFile file{twoConstants(2.0), kDefaultGravity, 0.4, {}, {"plane:0,0,0,0,0,1"}};
    InversionProblem problem;
    problem.target = arch(10);
    const ClothModel* model = findClothModel("edge-hinge").value();
    problem.material = {model, makeLaws(*model, file.material).value(),
                        file.material.areal_density_kg_per_m2, kDefaultGravity};
    std::vector<std::unique_ptr<Obstacle>> floor;
    floor.push_back(makeObstacle(file.obstacles[0]).value());
    problem.contacts = findContacts(problem.target, floor, {}, {0.4, 1e-4}).value();
    InversionOptions options;
    options.rest = rest;
    const auto result = invert(problem, options).value();
    ASSERT_EQ(result.status, InversionStatus::kCertified);
    ASSERT_TRUE(
        writeInversion(*folder_ / name, problem, result, {}, problemToJson(file).value()).ok());
  }
  static void TearDownTestSuite() { delete folder_; }

  static StoredInversion stored() { return readInversion(*folder_ / "arch").value(); }
  static ResimulationSummary run(const ResimulationOptions& options) {
    return resimulate(stored(), options,
                      [](const ResimulationFrame& frame) -> Result<void> {
                        EXPECT_TRUE(frame.positions.allFinite());
                        return {};
                      })
        .value();
  }

  static test_support::TemporaryFolder* folder_;
};
test_support::TemporaryFolder* ResimulationTest::folder_ = nullptr;

TEST_F(ResimulationTest, TheProblemReadsBackAsItWasAsked) {
  const StoredInversion s = stored();
  EXPECT_EQ(s.problem.target.positions, arch(10).positions);
  EXPECT_EQ(s.problem.contacts.size(), 20u);
  EXPECT_EQ(s.obstacles.size(), 1u);
  EXPECT_EQ(s.friction, 0.4);
  EXPECT_EQ(s.problem.material.areal_density_kg_per_m2, 0.1);
  EXPECT_EQ(s.problem.material.gravity_m_per_s2, kDefaultGravity);
  const auto json = nlohmann::json::parse(test_support::slurp(*folder_ / "arch/problem.json"));
  EXPECT_EQ(test_support::schemaErrors(
                json, test_support::sourceFolder() / "docs/formats/problem.schema.json"),
            std::vector<std::string>{});
}

TEST_F(ResimulationTest, InvertedItStandsStill) {
  ResimulationOptions options;
  const ResimulationSummary s = run(options);
  EXPECT_EQ(s.end, ResimulationEnd::kComplete);
  EXPECT_DOUBLE_EQ(s.simulated_s, 5.0);
  EXPECT_LE(s.max_displacement_rel, 1e-8);
  EXPECT_EQ(s.stuck, 20);
  EXPECT_EQ(s.sliding + s.off + s.landed, 0);
  EXPECT_EQ(s.frames, 126);
}

TEST_F(ResimulationTest, AMetricRestStateStandsStillToo) {
  store("metric", RestKind::kMetric);
  const auto json = nlohmann::json::parse(test_support::slurp(*folder_ / "metric/metric.json"));
  EXPECT_EQ(test_support::schemaErrors(
                json, test_support::sourceFolder() / "docs/formats/metric.schema.json"),
            std::vector<std::string>{});
  const auto stands = [](bool as_target) {
    ResimulationOptions options;
    options.seconds = 0.5;
    options.rest_is_target = as_target;
    const auto none = [](const ResimulationFrame&) -> Result<void> { return {}; };
    return resimulate(readInversion(*folder_ / "metric").value(), options, none)
        .value()
        .max_displacement_rel;
  };
  EXPECT_LE(stands(false), 1e-8);
  EXPECT_GT(stands(true), 1e-3) << "rest.obj is the target, which sags";
}

TEST_F(ResimulationTest, OtherMetricsAreRefusedByPlace) {
  store("spoiled", RestKind::kMetric);
  const auto file = *folder_ / "spoiled/metric.json";
  const auto good = nlohmann::json::parse(test_support::slurp(file));
  const auto refusal = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json spoiled = good;
    spoiled[key][3] = value;
    folder_->write("spoiled/metric.json", spoiled.dump());
    const auto read = readInversion(*folder_ / "spoiled");
    EXPECT_FALSE(read.ok());
    return read.ok() ? std::string() : read.error().message();
  };
  EXPECT_NE(refusal("edges", {0, 55}).find("edges[3]"), std::string::npos);
  EXPECT_NE(refusal("rest_length_m", 0.0).find("rest_length_m[3]"), std::string::npos);
  EXPECT_NE(refusal("rest_length_m", "x").find("rest_length_m"), std::string::npos);
  EXPECT_NE(refusal("rest_angle_rad", 4.0).find("rest_angle_rad[3]"), std::string::npos);
  EXPECT_NE(refusal("rest_length_m", 1e-300).find("rest_length_m[3]"), std::string::npos);
  std::filesystem::remove(file);
  const auto without = readInversion(*folder_ / "spoiled");
  ASSERT_FALSE(without.ok());
  EXPECT_NE(without.error().message().find("metric.json"), std::string::npos);
}

TEST_F(ResimulationTest, WithMoreGravityItMovesAsLinearlyPredicted) {
  ResimulationOptions options;
  options.gravity_scale = 1.01;
  const ResimulationSummary s = run(options);
  ASSERT_TRUE(s.linear);
  EXPECT_GT(s.linear->displacement_rel, 1e-5);
  // A load that sets in at once swings to no more than twice, and comes to rest at once.
  EXPECT_GT(s.linear->ratio, 1.0);
  EXPECT_LT(s.linear->ratio, 2.0);
  EXPECT_NEAR(s.end_displacement_rel, s.linear->displacement_rel, 0.2 * s.linear->displacement_rel);
}

TEST_F(ResimulationTest, WithoutInversionItSags) {
  ResimulationOptions options;
  options.seconds = 1.0;
  options.rest_is_target = true;
  EXPECT_GT(run(options).max_displacement_rel, 1e-2);
}

TEST_F(ResimulationTest, AGaleTakesItOff) {
  ResimulationOptions options;
  options.seconds = 1.0;
  options.dynamics.air.emplace();
  options.dynamics.air->wind_m_per_s = Vec3(8.0, 0.0, 4.0);
  const ResimulationSummary s = run(options);
  EXPECT_EQ(s.end, ResimulationEnd::kComplete);
  EXPECT_EQ(s.off, 20);
  EXPECT_LT(s.counts.deepest_m, 1e-3 * s.size_m);
}

TEST_F(ResimulationTest, FilesAreCompleteAndAStoppedRunKeepsItsFrames) {
  ResimulationOptions options;
  options.seconds = 0.4;
  int frames = 0;
  options.dynamics.stop = [&] { return frames >= 4; };
  const auto places = resimulationPlaces(*folder_ / "out.pvd").value();
  const auto summary = resimulateToFiles(stored(), options, places, {{"program", "test"}},
                                         [&](const ResimulationFrame&) -> Result<void> {
                                           ++frames;
                                           return {};
                                         });
  ASSERT_TRUE(summary.ok()) << summary.error().message();
  EXPECT_EQ(summary->end, ResimulationEnd::kStopped);
  EXPECT_EQ(summary->frames, 4);
  const auto frame = readMesh(places.frames / "000003.vtp");
  ASSERT_TRUE(frame.ok());
  EXPECT_TRUE(frame->data.point.contains("velocity_m_per_s"));
  EXPECT_EQ(frame->data.point.at("contact_mode").sum(), 20.0);
  const std::string cache = test_support::slurp(places.pc2);
  EXPECT_EQ(cache.size(), 32u + 4u * 100u * 12u);
  float x = 0.0F;
  std::memcpy(&x, cache.data() + 32, sizeof x);
  EXPECT_FLOAT_EQ(x, -1.0F / std::numbers::pi_v<float>);
  const auto json = nlohmann::json::parse(test_support::slurp(places.frames / "resimulation.json"));
  EXPECT_EQ(test_support::schemaErrors(
                json, test_support::sourceFolder() / "docs/formats/resimulation.schema.json"),
            std::vector<std::string>{});
  EXPECT_NE(test_support::slurp(places.pvd).find(places.first_frame), std::string::npos);
}

TEST_F(ResimulationTest, AMeshObstacleGoesWithTheFolder) {
  test_support::TemporaryFolder copy;
  std::filesystem::copy(*folder_ / "arch", copy / "arch");
  const auto floor =
      copy.write("floor.obj", "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3\nf 1 3 4\n");
  const auto json =
      problemToJson({twoConstants(2.0), kDefaultGravity, 0.4, {}, {floor.string()}}).value();
  EXPECT_EQ(test_support::schemaErrors(
                json, test_support::sourceFolder() / "docs/formats/problem.schema.json"),
            std::vector<std::string>{});
  ASSERT_TRUE(writeFileAtomically(copy / "arch/problem.json", json.dump()).ok());
  std::filesystem::remove(floor);
  auto read = readInversion(copy / "arch");
  ASSERT_TRUE(read.ok()) << read.error().message();
  ResimulationOptions options;
  options.seconds = 0.5;
  const auto summary = resimulate(std::move(read).value(), options,
                                  [](const ResimulationFrame&) { return Result<void>(); });
  ASSERT_TRUE(summary.ok());
  EXPECT_LE(summary->max_displacement_rel, 1e-8);
  EXPECT_EQ(summary->stuck, 20);
}

/// Without material coordinates, or with others, directions are in the pose.
TEST_F(ResimulationTest, DirectionsOfTheWarpGoWithTheFolder) {
  test_support::TemporaryFolder copy;
  std::filesystem::copy(*folder_ / "arch", copy / "arch");
  const auto pose = copy / "arch/pose.vtp";
  auto file = readMesh(pose).value();
  const auto frames = framesAlong(file.mesh, {Vec3(1.0, 2.0, 0.0)}).value();
  file.data.cell["warp"] = warpOf(file.mesh, frames);
  ASSERT_TRUE(writeVtp(pose, file.mesh, file.data).ok());
  const auto read = readInversion(copy / "arch");
  ASSERT_TRUE(read.ok()) << read.error().message();
  ASSERT_EQ(read->problem.frames.size(), frames.size());
  for (std::size_t t = 0; t < frames.size(); ++t)
    EXPECT_LE((read->problem.frames[t] - frames[t]).norm(), 1e-12 * frames[t].norm());
  file.data.cell["warp"](0, 0) = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(writeVtp(pose, file.mesh, file.data).ok());
  EXPECT_FALSE(readInversion(copy / "arch").ok());
}

TEST_F(ResimulationTest, FoldersThatDoNotFitTogetherAreRefused) {
  const auto brokenBy = [&](const char* file, const auto& change) {
    test_support::TemporaryFolder copy;
    std::filesystem::copy(*folder_ / "arch", copy / "arch");
    auto json = nlohmann::json::parse(test_support::slurp(copy / "arch" / file));
    change(json);
    EXPECT_TRUE(writeFileAtomically(copy / "arch" / file, json.dump()).ok());
    const auto read = readInversion(copy / "arch");
    return read ? std::string() : read.error().message();
  };
  using Json = nlohmann::json;
  const auto nothing = [](Json&) {};
  EXPECT_EQ(brokenBy("problem.json", nothing), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["fixed"] = {100}; }), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["fixed"] = {1, 1}; }), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["fixed"] = {0}; }), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["schema_version"] = 2; }), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["obstacles"] = Json::array(); }), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["obstacles"][0]["body"] = "a.obj"; }), "");
  EXPECT_NE(brokenBy("problem.json", [](Json& j) { j["material"]["law"] = "magic"; }), "");
  EXPECT_NE(brokenBy("certificate.json", [](Json& j) { j["contacts"][0]["vertex"] = -1; }), "");
  EXPECT_NE(brokenBy("certificate.json",
                     [](Json& j) {
                       j["contacts"][0]["normal"] = {0, 0, 2};
                     }),
            "");
  EXPECT_NE(brokenBy("certificate.json", [](Json& j) { j["contacts"][1] = j["contacts"][0]; }), "");
  EXPECT_FALSE(readInversion(*folder_ / "nowhere").ok());
}

}  // namespace
}  // namespace tenter
