// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inversion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "shell_samples.h"
#include "tenter/core/files.h"
#include "tenter/core/mesh_io.h"
#include "tenter/inversion/inversion_files.h"
#include "tenter/inversion/material_directions.h"
#include "tenter/mechanics/equilibrium.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test::shellMaterial;

/// The two constants of [Inv18] at its reference, times `factor`.
ShellMaterial reference(double factor = 1.0) {
  const ClothModel* model = findClothModel("edge-hinge").value();
  std::vector<ComponentCurve> curves(2);
  curves[0].curve = StiffnessCurve::constant(3.0 * factor);
  curves[1].curve = StiffnessCurve::constant(5e-3 * factor);
  return {model, makeLaws(*model, curves), 0.1, kDefaultGravity};
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

InversionProblem standing(int n, ShellMaterial material, double friction = 0.4) {
  InversionProblem problem;
  problem.target = arch(n);
  problem.material = std::move(material);
  std::vector<std::unique_ptr<Obstacle>> floor;
  floor.push_back(makeObstacle("plane:0,0,0,0,0,1").value());
  problem.contacts = findContacts(problem.target, floor, {}, {friction, 1e-4}).value();
  return problem;
}

void expectCertified(const Result<InversionResult>& result) {
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->status, InversionStatus::kCertified) << result->reason;
  const Certificate& c = result->certificate;
  EXPECT_LE(c.force_residual_rel, 1e-10);
  EXPECT_EQ(c.cone_violations, 0);
  EXPECT_GT(c.cone_margin_min, 0.0);
  EXPECT_GT(c.lambda_min_per_s2, 0.0);
  EXPECT_EQ(c.negative_eigenvalues, 0);
  EXPECT_EQ(c.redrape_rel.size(), 20u);
  EXPECT_LE(c.redrape_max_rel, 1e-6);
}

TEST(InversionTest, AnArchStandsOnFrictionAlone) {
  expectCertified(invert(standing(10, reference(2.0)), {}));
}

TEST(InversionTest, ForcesKeepOffTheConesBordersWhereTheyCan) {
  // As far inside as is asked for first, less what the balance may take of that.
  constexpr double kRoom = 0.05;
  const auto arch = invert(standing(10, reference(2.0)), {});
  expectCertified(arch);
  EXPECT_GE(arch->certificate.cone_margin_min, kRoom - 1e-6);
}

TEST(InversionTest, WithoutInversionTheArchSags) {
  const InversionProblem problem = standing(10, reference(2.0));
  const InverseShell shell = InverseShell::create(problem.target, problem.material).value();
  const auto c = certify(shell, problem.target.positions, problem.target.positions,
                         Eigen::VectorXd(0), {}, problem.contacts, {});
  ASSERT_TRUE(c.ok());
  EXPECT_FALSE(c->balanced());
  EXPECT_FALSE(c->holds());
}

/// Satin: stretch 1e4 N/m, bending 5e-6 N m, with stiffening curves.
ShellMaterial satin(const std::string& law) {
  const ClothModel* model = findClothModel(law).value();
  std::vector<ComponentCurve> curves;
  for (int i = 0; i < model->componentCount(); ++i) {
    const ComponentInfo& info = model->component(i);
    const bool bending = info.stiffness_unit == "N m", shear = info.name == "shear";
    const double k = bending ? 5e-6 : shear ? 40.0 : 1e4;
    const double end = bending ? 100.0 : 0.02;
    ComponentCurve c;
    if (info.constant_only)
      c.curve = StiffnessCurve::constant(info.may_be_negative ? 0.1 * k : k);
    else if (info.even)
      c.curve = StiffnessCurve::fromKnots({0.0, end}, {k, 0.8 * k}, {0.0, 0.0}, true).value();
    else
      c.curve = StiffnessCurve::fromKnots({0.0, end}, {k, 1.5 * k}, {0.0, k / end}).value();
    curves.push_back(std::move(c));
  }
  return {model, makeLaws(*model, curves), 0.12, kDefaultGravity};
}

/// A sheet over the upper half of a cylinder of 0.1 m that hangs 5 cm beyond it on both sides.
InversionProblem overCylinder(ShellMaterial material) {
  constexpr int kCount = 9;
  constexpr double kRadius_m = 0.1, kHang_m = 0.05;
  const double quarter = 0.5 * std::numbers::pi * kRadius_m, reach = quarter + kHang_m;
  InversionProblem problem;
  problem.target = test::bentTarget(kCount, kCount);
  for (int j = 0; j < kCount; ++j) {
    for (int i = 0; i < kCount; ++i) {
      const double s = reach * (2.0 * i / (kCount - 1) - 1.0), y = 0.15 * j / (kCount - 1);
      const double over = std::min(std::abs(s), quarter), down = std::abs(s) - over;
      problem.target.positions.col(j * kCount + i) =
          Vec3(std::copysign(kRadius_m * std::sin(over / kRadius_m), s), y,
               kRadius_m * std::cos(over / kRadius_m) - down);
      problem.target.uv.col(j * kCount + i) = Vec2(s, y);
    }
  }
  problem.material = std::move(material);
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  obstacles.push_back(makeObstacle("cylinder:0,0,0,0,1,0,0.1").value());
  problem.contacts = findContacts(problem.target, obstacles, {}, {0.3, 0.0}).value();
  return problem;
}

TEST(InversionTest, ClothFarStifferInStretchThanInBendingHangsOverACylinder) {
  for (const char* law : {"soft", "stvk", "stvk-coupled"}) {
    SCOPED_TRACE(law);
    const InversionProblem problem = overCylinder(satin(law));
    ASSERT_LT(problem.contacts.size(), 81u);
    expectCertified(invert(problem, {}));
  }
}

TEST(InversionTest, FixedVerticesMayPull) {
  InversionProblem problem = standing(10, reference(2.0));
  for (const Contact& c : problem.contacts) problem.fixed.push_back(c.vertex);
  problem.contacts.clear();
  expectCertified(invert(problem, {}));
}

/// A sheet that lies on a plane of that slope.
InversionProblem onSlope(double tangent, double friction) {
  InversionProblem problem;
  problem.target = test::bentTarget(5, 5);
  const double angle = std::atan(tangent);
  for (int v = 0; v < problem.target.vertexCount(); ++v) {
    const Vec2 uv = problem.target.uv.col(v);
    problem.target.positions.col(v) = Vec3(uv[0] * std::cos(angle), uv[1], uv[0] * std::sin(angle));
    Contact c;
    c.vertex = v;
    c.normal = Vec3(-std::sin(angle), 0.0, std::cos(angle));
    c.friction = friction;
    problem.contacts.push_back(c);
  }
  problem.material = reference(10.0);
  return problem;
}

TEST(InversionTest, ASheetSticksToASlopeUpToItsFrictionAndSlidesBeyond) {
  for (const double share : {0.3, 0.97, 0.999}) {
    const auto result = invert(onSlope(0.4 * share, 0.4), {});
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->status, InversionStatus::kCertified) << share << result->reason;
  }
  const auto result = invert(onSlope(0.4 * 1.001, 0.4), {});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->status, InversionStatus::kInfeasible);
  ASSERT_TRUE(result->proof);
  EXPECT_NEAR(result->proof->friction_factor_min, 1.001, 1e-4);
}

TEST(InversionTest, WhatIsTooSoftIsNeverCalledGood) {
  for (const double factor : {0.5, 1.0 / 16, 1.0 / 64}) {
    InversionOptions options;
    options.time_budget_s = 1.0;
    const InversionProblem problem = standing(8, reference(factor));
    const auto result = invert(problem, options);
    ASSERT_TRUE(result.ok());
    const InverseShell shell = InverseShell::create(problem.target, problem.material).value();
    EXPECT_EQ(result->status == InversionStatus::kInfeasible,
              result->softness_proof &&
                  proves(*result->softness_proof, shell, problem.fixed, problem.contacts));
    EXPECT_EQ(result->status == InversionStatus::kCertified, result->certificate.holds());
    EXPECT_TRUE(result->rest.allFinite());
  }
}

TEST(InversionTest, RangeEndsWhereAnArchBuckles) {
  const auto range = findFeasibleRange(standing(7, reference()), {});
  ASSERT_TRUE(range.ok()) << range.error().message();
  EXPECT_TRUE(range->complete);
  ASSERT_TRUE(range->stiffness_min && range->stiffness_below && range->friction_min);
  EXPECT_LE(*range->stiffness_min, kRangeRatio * *range->stiffness_below);
  EXPECT_EQ(*range->stiffness_max, kStiffestFactor);
  EXPECT_LE(*range->friction_min, 1.0);
  EXPECT_EQ(range->result.status, InversionStatus::kCertified);
  for (const RangePoint& p : range->points) {
    if (p.friction_factor != 1.0) continue;
    const bool inside = p.stiffness_factor >= *range->stiffness_min;
    EXPECT_EQ(p.status == InversionStatus::kCertified, inside) << p.stiffness_factor;
  }
  // What it says of the softest holds when it is asked again.
  InversionProblem again = standing(7, reference());
  again.material = scaled(again.material, *range->stiffness_min);
  expectCertified(invert(again, {}));
}

TEST(InversionTest, RangeOfWhatSlidesStartsAtTheProvedFriction) {
  const auto range = findFeasibleRange(onSlope(0.4 * 1.5, 0.4), {});
  ASSERT_TRUE(range.ok());
  EXPECT_NEAR(range->friction_proved_below, 1.5, 1e-3);
  ASSERT_TRUE(range->friction_min);
  EXPECT_GE(*range->friction_min, range->friction_proved_below);
  EXPECT_LE(*range->friction_min, kRangeRatio * range->friction_proved_below);
  EXPECT_EQ(range->result.status, InversionStatus::kInfeasible);
}

TEST(InversionTest, TheWarpMayBeADirectionInsteadOfMaterialCoordinates) {
  InversionProblem problem = overCylinder(satin("stvk"));
  const auto along = [&](const Vec3& warp) {
    InversionProblem other = problem;
    other.target.uv.resize(2, 0);
    other.frames = framesAlong(problem.target, {warp}).value();
    return invert(other, {});
  };
  const auto by_uv = invert(problem, {}), by_direction = along(Vec3::UnitY());
  expectCertified(by_direction);
  // uv of this target is the direction's arc length, so both are one problem.
  EXPECT_LT((by_uv->rest - by_direction->rest).norm(), 1e-6);
  const Points3 warp = warpOf(problem.target, framesAlong(problem.target, {Vec3::UnitY()}).value());
  for (Eigen::Index t = 0; t < warp.cols(); ++t) EXPECT_GT(warp(1, t), 0.999999);
  EXPECT_FALSE(framesAlong(problem.target, {Vec3::UnitX()}).ok()) << "what hangs faces x";
}

TEST(InversionTest, TheReferenceMethodAgreesOnASmallArch) {
  InversionOptions options;
  options.method = InversionMethod::kReference;
  expectCertified(invert(standing(4, reference(8.0)), options));
  // They leave different room in the cones: compared where no force comes near their borders.
  const InversionProblem problem = standing(4, reference(8.0), 0.8);
  const auto theirs = invert(problem, options), ours = invert(problem, {});
  expectCertified(theirs);
  expectCertified(ours);
  EXPECT_GT(theirs->drapes, 10);
  EXPECT_LT((theirs->rest - ours->rest).norm(), 0.01 * ours->certificate.size_m);
  EXPECT_NEAR(theirs->certificate.lambda_min_per_s2, ours->certificate.lambda_min_per_s2,
              0.02 * ours->certificate.lambda_min_per_s2);
}

TEST(InversionTest, NothingThatHoldsItIsAnError) {
  InversionProblem problem = standing(5, reference());
  problem.contacts.clear();
  EXPECT_FALSE(invert(problem, {}).ok());
}

TEST(InversionTest, FilesAgreeWithTheSchemaAndReadBack) {
  const InversionProblem problem = standing(7, reference(2.0));
  const auto result = invert(problem, {});
  expectCertified(result);
  test_support::TemporaryFolder folder;
  ASSERT_TRUE(writeInversion(folder / "out", problem, *result, {{"program", "test"}}).ok());
  EXPECT_EQ(test_support::listFolder(folder / "out"),
            (std::vector<std::string>{"certificate.json", "contacts.vtp", "pose.vtp", "rest.obj",
                                      "strains.vtp"}));
  const auto range = findFeasibleRange(problem, {});
  ASSERT_TRUE(writeInversion(folder / "range", problem, range->result, {{"program", "test"}},
                             nullptr, &*range)
                  .ok());
  EXPECT_EQ(test_support::schemaErrors(
                nlohmann::json::parse(test_support::slurp(folder / "range/certificate.json")),
                test_support::sourceFolder() / "docs/formats/certificate.schema.json"),
            std::vector<std::string>{});
  const auto json = nlohmann::json::parse(test_support::slurp(folder / "out/certificate.json"));
  EXPECT_EQ(test_support::schemaErrors(
                json, test_support::sourceFolder() / "docs/formats/certificate.schema.json"),
            std::vector<std::string>{});
  const auto rest = readMesh(folder / "out/rest.obj");
  ASSERT_TRUE(rest.ok());
  EXPECT_EQ(rest->mesh.positions, result->rest);
  // Without re-running anything: the file's own numbers balance the weight.
  Vec3 sum = Vec3::Zero();
  for (const auto& c : json.at("contacts"))
    for (int k = 0; k < 3; ++k)
      sum[k] += c.at("force_N")[static_cast<std::size_t>(k)].get<double>();
  EXPECT_NEAR(sum[2], json.at("weight_N").get<double>(), 1e-9 * sum[2]);
  EXPECT_NEAR(sum.head<2>().norm(), 0.0, 1e-9 * sum[2]);
}

}  // namespace
}  // namespace tenter
