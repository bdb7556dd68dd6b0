// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/rest_preference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "shell_samples.h"
#include "tenter/inversion/inversion.h"

namespace tenter {
namespace {

constexpr double kEdge_m = 0.01;

/// A sheet of n x n vertices with z = height(u).
template <class Height>
TriangleMesh sheetOf(int n, Height height) {
  TriangleMesh mesh = test::bentTarget(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      mesh.positions.col(j * n + i) = Vec3(kEdge_m * i, kEdge_m * j, height(kEdge_m * i));
  return mesh;
}

/// Part of a prism, and the same unrolled: lengths are equal, angles are not.
struct Rolled {
  TriangleMesh mesh;
  Points3 flat;
  explicit Rolled(int n) : mesh(test::bentTarget(n, n)), flat(3, n * n) {
    constexpr double kTurn_rad = 0.2;
    for (int j = 0; j < n; ++j) {
      Vec3 at(0.0, kEdge_m * j, 0.0);
      for (int i = 0; i < n; ++i) {
        mesh.positions.col(j * n + i) = at;
        flat.col(j * n + i) = Vec3(kEdge_m * i, kEdge_m * j, 0.0);
        mesh.uv.col(j * n + i) = Vec2(kEdge_m * i, kEdge_m * j);
        at += kEdge_m * Vec3(std::cos(kTurn_rad * i), 0.0, -std::sin(kTurn_rad * i));
      }
    }
  }
};

TEST(RestPreference, FairingTakesShortWavesAndLeavesLongOnes) {
  constexpr int n = 41;
  constexpr double kLength_m = 0.02, kHeight_m = 1e-4;
  const TriangleMesh flat = sheetOf(n, [](double) { return 0.0; });
  EXPECT_LE((faired(flat, kLength_m) - flat.positions).cwiseAbs().maxCoeff(), 1e-12);
  for (const double wave_m : {0.08, 0.4}) {
    const double k = 2.0 * std::numbers::pi / wave_m;
    const TriangleMesh waves =
        sheetOf(n, [&](double u) { return kHeight_m * std::cos(k * (u - 0.2)); });
    const double left = faired(waves, kLength_m)(2, n / 2 * n + n / 2) / kHeight_m;
    EXPECT_NEAR(left, 1.0 / (1.0 + std::pow(kLength_m * k, 4)), 0.02) << wave_m;
  }
}

TEST(RestPreference, MomentsAreThoseOfTheUnrolledShell) {
  const Rolled rolled(6);
  for (const char* law : {"edge-hinge", "stvk", "soft"}) {
    const InverseShell shell = InverseShell::create(rolled.mesh, test::shellMaterial(law)).value();
    const Eigen::VectorXd q =
        shell.coordinates(rolled.mesh.positions, Eigen::VectorXd::Zero(shell.rotationCount()));
    Eigen::VectorXd of_target, of_flat;
    shell.gradient(q, rolled.mesh.positions, of_target);  // the weight
    shell.gradient(q, rolled.flat, of_flat);
    const Eigen::VectorXd wish =
        bendingGradient(shell, wantedAngles(shell, {.kind = RestShapeKind::kFlat}));
    EXPECT_GT(wish.norm(), 1e-6) << law;
    EXPECT_LE((of_flat - of_target - wish).norm(), 1e-9 * wish.norm()) << law;
    const Eigen::VectorXd none =
        bendingGradient(shell, wantedAngles(shell, {.kind = RestShapeKind::kFlat, .share = 0.0}));
    EXPECT_LE(none.norm(), 1e-12 * wish.norm()) << law;
  }
}

TEST(RestPreference, MeasuresTellAnglesFoldsAndDefects) {
  const Rolled rolled(6);
  const InverseShell shell =
      InverseShell::create(rolled.mesh, test::shellMaterial("edge-hinge")).value();
  const Eigen::VectorXd smooth =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(shell.topology().edges.size()));
  const ShapeMeasures bent =
      measureShape(shell, elementsOf(shell.topology(), rolled.mesh.positions), smooth);
  const ShapeMeasures flat = measureShape(shell, elementsOf(shell.topology(), rolled.flat), smooth);
  EXPECT_GT(bent.bend_rms_rad, 0.05);
  EXPECT_EQ(bent.bend_rms_rad, bent.fold_rms_rad);
  EXPECT_LE(bent.defect_rms_rad, 1e-12) << "it unrolls";
  EXPECT_LE(flat.bend_rms_rad, 1e-12);
}

/// A vault with or without folds. Its two straight edges are held, or stand on a floor.
InversionProblem vault(double fold_rad, bool held) {
  constexpr int n = 13;
  InversionProblem problem;
  problem.target = test::bentTarget(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double a = std::numbers::pi * i / (n - 1);
      const double radius = 0.1 + 0.1 * fold_rad * std::sin(8.0 * a);
      problem.target.positions.col(j * n + i) =
          Vec3(-radius * std::cos(a), 0.3 * j / (n - 1),
               i == 0 || i == n - 1 ? 0.0 : radius * std::sin(a));
    }
  std::vector<ComponentCurve> curves(2);
  curves[0].curve = StiffnessCurve::constant(3.0);
  curves[1].curve = StiffnessCurve::constant(5e-4);
  const ClothModel* model = findClothModel("edge-hinge").value();
  problem.material = {model, makeLaws(*model, curves), 0.05, kDefaultGravity};
  std::vector<std::unique_ptr<Obstacle>> floor;
  floor.push_back(makeObstacle("plane:0,0,0,0,0,1").value());
  problem.contacts = findContacts(problem.target, floor, {}, {0.6, 1e-4}).value();
  if (!held) return problem;
  for (const Contact& c : problem.contacts) problem.fixed.push_back(c.vertex);
  problem.contacts.clear();
  return problem;
}

InversionResult inverted(const InversionProblem& problem, RestKind rest, RestShapeKind kind) {
  InversionOptions options;
  options.rest = rest;
  options.preference.kind = kind;
  options.preference.smoothing_length_m = 0.03;  // the folds are 0.08 m long
  options.explain = false;
  return invert(problem, options).value();
}

TEST(RestPreference, MetricRestStatesAreMuchFlatterAndStillCertified) {
  const InversionProblem problem = vault(0.0, true);
  const auto near = inverted(problem, RestKind::kMetric, RestShapeKind::kNearTarget);
  const auto flat = inverted(problem, RestKind::kMetric, RestShapeKind::kFlat);
  ASSERT_EQ(near.status, InversionStatus::kCertified) << near.reason;
  ASSERT_EQ(flat.status, InversionStatus::kCertified) << flat.reason;
  EXPECT_EQ(flat.preference.kind, RestShapeKind::kFlat);
  EXPECT_LT(flat.rest_shape.bend_rms_rad, 0.8 * near.rest_shape.bend_rms_rad);
}

TEST(RestPreference, FoldsDoNotStayInAMetricRestState) {
  const InversionProblem problem = vault(0.02, true);
  const auto near = inverted(problem, RestKind::kMetric, RestShapeKind::kNearTarget);
  const auto smooth = inverted(problem, RestKind::kMetric, RestShapeKind::kSmooth);
  ASSERT_EQ(near.status, InversionStatus::kCertified) << near.reason;
  ASSERT_EQ(smooth.status, InversionStatus::kCertified) << smooth.reason;
  EXPECT_LT(smooth.rest_shape.fold_rms_rad, 0.8 * near.rest_shape.fold_rms_rad);
}

TEST(RestPreference, ARestMeshHasLittleChoiceButIsNoWorse) {
  const InversionProblem problem = vault(0.0, false);
  const auto near = inverted(problem, RestKind::kMesh, RestShapeKind::kNearTarget);
  const auto flat = inverted(problem, RestKind::kMesh, RestShapeKind::kFlat);
  ASSERT_EQ(near.status, InversionStatus::kCertified) << near.reason;
  ASSERT_EQ(flat.status, InversionStatus::kCertified) << flat.reason;
  EXPECT_LE(flat.rest_shape.bend_rms_rad, near.rest_shape.bend_rms_rad + 1e-9);
}

}  // namespace
}  // namespace tenter
