// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "metric_elements.h"
#include "shell_samples.h"
#include "tenter/inversion/feasible_range.h"
#include "tenter/inversion/inversion_files.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

ShellMaterial constants(double k_stretch, double k_bend) {
  const ClothModel* model = findClothModel("edge-hinge").value();
  std::vector<ComponentCurve> curves(2);
  curves[0].curve = StiffnessCurve::constant(k_stretch);
  curves[1].curve = StiffnessCurve::constant(k_bend);
  return {model, makeLaws(*model, curves), 0.1, kDefaultGravity};
}

/// A half cylinder that stands on its two long edges.
InversionProblem arch(int n, double factor) {
  InversionProblem problem;
  problem.target = test::bentTarget(n, n);
  const double radius = 1.0 / std::numbers::pi;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double a = std::numbers::pi * i / (n - 1);
      problem.target.positions.col(j * n + i) =
          Vec3(-radius * std::cos(a), double(j) / (n - 1),
               i == 0 || i == n - 1 ? 0.0 : radius * std::sin(a));
    }
  problem.material = constants(3.0 * factor, 5e-3 * factor);
  std::vector<std::unique_ptr<Obstacle>> floor;
  floor.push_back(makeObstacle("plane:0,0,0,0,0,1").value());
  problem.contacts = findContacts(problem.target, floor, {}, {0.6, 1e-4}).value();
  return problem;
}

InversionResult inverted(const InversionProblem& problem, RestKind kind, bool explain = false) {
  InversionOptions options;
  options.rest = kind;
  options.explain = explain;
  return invert(problem, options).value();
}

/// A shell whose elements have these rest values, and its gradient and Hessian at the target.
struct Strained {
  InverseShell shell;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;

  Strained(const InversionProblem& problem, const ElementRest& rest)
      : shell(InverseShell::create(problem.target, problem.material).value()) {
    shell.setElementRest(rest);
    const auto system = shell.system(problem.target.positions, {});
    ClothState state = system.value().restState();
    state.q = shell.coordinates(problem.target.positions, {});
    system.value().gradient(state, gradient);
    const SparseLower& h = system.value().hessian(state, Projection::kNone);
    hessian = Eigen::MatrixXd::Zero(h.size, h.size);
    for (int c = 0; c < h.size; ++c)
      for (int k = h.column_begin[c]; k < h.column_begin[c + 1]; ++k)
        hessian(h.row[k], c) = hessian(c, h.row[k]) = h.value[k];
  }
};

Eigen::VectorXd randomState(const MetricElements& elements, std::mt19937& random) {
  Eigen::VectorXd z(elements.count());
  for (int i = 0; i < elements.count(); ++i) {
    const MetricElement& e = elements.all()[i];
    z[i] = e.lower + (e.upper - e.lower) * static_cast<double>(random()) / 4294967296.0;
  }
  return z;
}

TEST(MetricRestTest, GradientAndHessianAreLinearInRestValues) {
  const InversionProblem problem = arch(5, 1.0);
  const InverseShell shell = InverseShell::create(problem.target, problem.material).value();
  const MetricElements elements = MetricElements::create(shell).value();
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(elements.count());
  const Strained plain(problem, elements.restOf(none));
  const Eigen::MatrixXd identity =
      Eigen::MatrixXd::Identity(plain.hessian.rows(), plain.hessian.cols());
  std::mt19937 random(7);
  for (int trial = 0; trial < 5; ++trial) {
    const Eigen::VectorXd z = randomState(elements, random);
    const Strained strained(problem, elements.restOf(z));
    const Eigen::VectorXd force = plain.gradient + elements.forces(z);
    EXPECT_LE((strained.gradient - force).norm(), 1e-12 * force.norm());
    const Eigen::MatrixXd hessian = plain.hessian + elements.stiffened(z, identity);
    EXPECT_LE((strained.hessian - hessian).norm(), 1e-9 * hessian.norm());
  }
  // Elastic energies are 1/2 stiffness z^2.
  Eigen::MatrixXd elastic = Eigen::MatrixXd::Zero(identity.rows(), identity.cols());
  for (int i = 0; i < elements.count(); ++i) {
    const Eigen::VectorXd g = elements.forces(Eigen::VectorXd::Unit(elements.count(), i));
    elastic += g * g.transpose() / elements.all()[i].stiffness;
  }
  EXPECT_LE((plain.hessian - elastic).norm(), 1e-9 * elastic.norm());
}

TEST(MetricRestTest, HoldsWhatNoRestMeshWasFoundFor) {
  const InversionProblem problem = arch(8, 0.65);
  EXPECT_EQ(inverted(problem, RestKind::kMesh).status, InversionStatus::kNotConverged);
  const InversionResult metric = inverted(problem, RestKind::kMetric);
  ASSERT_EQ(metric.status, InversionStatus::kCertified) << metric.reason;
  ASSERT_TRUE(metric.element_rest);
  EXPECT_LE(metric.certificate.force_residual_rel, 1e-10);
  EXPECT_EQ(metric.certificate.negative_eigenvalues, 0);
  EXPECT_LE(metric.certificate.redrape_max_rel, 1e-6);
  const InversionResult explained = inverted(problem, RestKind::kMesh, true);
  EXPECT_EQ(explained.status, InversionStatus::kNotConverged);
  EXPECT_NE(explained.reason.find("--rest metric"), std::string::npos) << explained.reason;
}

TEST(MetricRestTest, IsTheRestMeshsMetricWhereThatIsStable) {
  const InversionResult metric = inverted(arch(8, 4.0), RestKind::kMetric);
  const InversionResult mesh = inverted(arch(8, 4.0), RestKind::kMesh);
  ASSERT_EQ(metric.status, InversionStatus::kCertified);
  ASSERT_EQ(mesh.status, InversionStatus::kCertified);
  // To first order in the load; hinge weights and masses of the mesh are its own.
  EXPECT_NEAR(metric.certificate.stretch.cwiseAbs().maxCoeff() /
                  mesh.certificate.stretch.cwiseAbs().maxCoeff(),
              1.0, 0.2);
}

class SoftArch : public ::testing::Test {
 protected:
  const InversionProblem problem_ = arch(6, 0.5);
  const InverseShell shell_ = InverseShell::create(problem_.target, problem_.material).value();
  const InversionResult result_ = inverted(problem_, RestKind::kMetric);

  bool proven(const SoftnessProof& proof) const {
    return proves(proof, shell_, problem_.fixed, problem_.contacts);
  }
};

TEST_F(SoftArch, IsProvedInfeasible) {
  ASSERT_EQ(result_.status, InversionStatus::kInfeasible) << result_.reason;
  ASSERT_TRUE(result_.softness_proof);
  const SoftnessProof& proof = *result_.softness_proof;
  EXPECT_FALSE(proof.modes.empty());
  EXPECT_LT(proof.bound, 0.0);
  EXPECT_TRUE(proven(proof));
  EXPECT_TRUE(proves(proof, shell_, {}, problem_.contacts, 0.9 * proof.weight_change));
  EXPECT_FALSE(proves(proof, shell_, {}, problem_.contacts, 1.1 * proof.weight_change + 1e-3));
  // No rest mesh is found either, and the proof is why.
  EXPECT_EQ(inverted(problem_, RestKind::kMesh, true).status, InversionStatus::kInfeasible);
}

/// What the proof says of every state: sum of v' H v + y . (dE/dx - f) is at most the bound; and no
/// force in a cone has y . f < 0. The largest value over all states is the bound itself.
TEST_F(SoftArch, BoundIsTheLargestValueOfAnyState) {
  ASSERT_TRUE(result_.softness_proof);
  const SoftnessProof& proof = *result_.softness_proof;
  const MetricElements elements = MetricElements::create(shell_).value();
  const Eigen::VectorXd motion = proof.motion.reshaped();
  const auto valueAt = [&](const Eigen::VectorXd& z) {
    const Strained state(problem_, elements.restOf(z));
    double value = motion.dot(state.gradient);
    for (const Points3& mode : proof.modes)
      value += mode.reshaped().dot(state.hessian * mode.reshaped());
    return value;
  };
  const double scale = std::abs(valueAt(Eigen::VectorXd::Zero(elements.count())));
  std::mt19937 random(11);
  for (int trial = 0; trial < 20; ++trial)
    EXPECT_LE(valueAt(randomState(elements, random)), proof.bound + 1e-9 * scale);
  Eigen::VectorXd slope = elements.works(motion);
  for (const Points3& mode : proof.modes)
    slope += elements.curvatures(Eigen::VectorXd(mode.reshaped()));
  Eigen::VectorXd worst(elements.count());
  for (int i = 0; i < elements.count(); ++i)  // an angle of pi itself would wrap
    worst[i] = (1.0 - 1e-12) * (slope[i] > 0.0 ? elements.all()[i].upper : elements.all()[i].lower);
  EXPECT_NEAR(valueAt(worst), proof.bound, 1e-6 * scale);
  for (const Contact& c : problem_.contacts) {
    const Vec3 along = c.normal.unitOrthogonal();
    for (int k = 0; k < 16; ++k) {
      const Vec3 edge = c.normal + c.friction * (Eigen::AngleAxisd(0.4 * k, c.normal) * along);
      EXPECT_GE(edge.dot(proof.motion.col(c.vertex)), -1e-9 * proof.motion.cwiseAbs().maxCoeff());
    }
  }
}

TEST_F(SoftArch, SpoiledProofsProveNothing) {
  ASSERT_TRUE(result_.softness_proof);
  const SoftnessProof good = *result_.softness_proof;
  ASSERT_TRUE(proven(good));
  SoftnessProof spoiled = good;
  spoiled.motion *= -1.0;
  EXPECT_FALSE(proven(spoiled)) << "forces of cones do negative work";
  spoiled = good;
  spoiled.modes.front().col(problem_.contacts.front().vertex) = Vec3(1e-6, 0.0, 0.0);
  EXPECT_FALSE(proven(spoiled)) << "a contact moves";
  spoiled = good;
  for (Points3& mode : spoiled.modes) mode *= 2.0;
  EXPECT_FALSE(proven(spoiled)) << "motion and modes no longer cancel";
  spoiled = good;
  spoiled.motion(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(proven(spoiled));
  // Moved like this, a vertex is not fixed.
  EXPECT_FALSE(proves(good, shell_, {8}, problem_.contacts));
  // Of a stiffer shell nothing is proved.
  const InversionProblem stiff = arch(6, 4.0);
  EXPECT_FALSE(
      proves(good, InverseShell::create(stiff.target, stiff.material).value(), {}, stiff.contacts));
}

TEST_F(SoftArch, SaysWhichStiffnessWouldDo) {
  const InversionResult explained = inverted(problem_, RestKind::kMetric, true);
  ASSERT_EQ(explained.status, InversionStatus::kInfeasible);
  ASSERT_TRUE(explained.stiffness_factor_min);
  const double enough = *explained.stiffness_factor_min;
  EXPECT_LE(enough, 2.0 * explained.stiffness_factor_proved_below);
  EXPECT_GT(enough, explained.stiffness_factor_proved_below);
  EXPECT_EQ(inverted(arch(6, 0.5 * enough), RestKind::kMetric).status, InversionStatus::kCertified);
  EXPECT_EQ(
      inverted(arch(6, 0.5 * explained.stiffness_factor_proved_below), RestKind::kMetric).status,
      InversionStatus::kInfeasible);
}

TEST(MetricRestTest, TooSoftToCarryItsWeightIsProvedByForcesAlone) {
  const InversionResult result = inverted(arch(6, 0.002), RestKind::kMetric);
  ASSERT_EQ(result.status, InversionStatus::kInfeasible) << result.reason;
  ASSERT_TRUE(result.softness_proof);
  EXPECT_TRUE(result.softness_proof->modes.empty());
  EXPECT_LT(result.softness_proof->bound, 0.0);
}

TEST(MetricRestTest, HorizontalSheetHangsFromItsFixedEdge) {
  InversionProblem problem;
  problem.target = test::bentTarget(6, 6);
  for (int v = 0; v < 36; ++v) {
    problem.target.positions.col(v) = Vec3(0.04 * (v % 6), 0.04 * (v / 6), 0.0);
    if (v % 6 < 2) problem.fixed.push_back(v);
  }
  problem.material = constants(3.0, 5e-3);
  EXPECT_EQ(inverted(problem, RestKind::kMetric).status, InversionStatus::kCertified);
  problem.material = constants(3.0, 5e-6);
  const InversionResult soft = inverted(problem, RestKind::kMetric);
  EXPECT_EQ(soft.status, InversionStatus::kInfeasible) << soft.reason;
}

/// A flat sheet that is fixed at one edge and rests on a smooth rail.
InversionProblem onARail(double k_stretch, double k_bend) {
  InversionProblem problem;
  problem.target = test::bentTarget(7, 7);
  for (int v = 0; v < 49; ++v) {
    problem.target.positions.col(v) = Vec3(0.04 * (v % 7), 0.04 * (v / 7), 0.0);
    if (v % 7 == 0) problem.fixed.push_back(v);
    if (v % 7 == 4) problem.contacts.push_back({v, Vec3::UnitZ(), 0.0, 0.0, 0});
  }
  problem.material = constants(k_stretch, k_bend);
  return problem;
}

TEST(MetricRestTest, WithoutFrictionForcesStayNormal) {
  const InversionResult result = inverted(onARail(3.0, 5e-3), RestKind::kMetric);
  EXPECT_EQ(result.status, InversionStatus::kCertified) << result.reason;
  EXPECT_EQ(result.certificate.cone_violations, 0);
}

TEST(MetricRestTest, WithoutFrictionTooSoftIsProvedWithForcesThatAreRays) {
  const InversionProblem problem = onARail(3.0 * 0.002, 5e-3 * 0.002);
  const InversionResult result = inverted(problem, RestKind::kMetric);
  ASSERT_EQ(result.status, InversionStatus::kInfeasible) << result.reason;
  ASSERT_TRUE(result.softness_proof);
  for (const Contact& c : problem.contacts)
    EXPECT_GE(c.normal.dot(result.softness_proof->motion.col(c.vertex)), 0.0);
}

/// Nothing free to be unstable: contacts everywhere, and fixed vertices everywhere.
TEST(MetricRestTest, HeldEverywhereItIsBalancedOrRefused) {
  InversionProblem problem;
  problem.target = test::bentTarget(4, 4);
  for (int v = 0; v < 16; ++v) {
    problem.target.positions.col(v) = Vec3(0.04 * (v % 4), 0.04 * (v / 4), 0.0);
    problem.contacts.push_back({v, Vec3::UnitZ(), 0.5, 0.0, 0});
  }
  problem.material = constants(3.0, 5e-3);
  EXPECT_EQ(inverted(problem, RestKind::kMetric).status, InversionStatus::kCertified);
  problem.contacts.clear();
  for (int v = 0; v < 16; ++v) problem.fixed.push_back(v);
  InversionOptions options;
  options.rest = RestKind::kMetric;
  EXPECT_FALSE(invert(problem, options).ok());
}

TEST(MetricRestTest, ASingleTriangleHangs) {
  InversionProblem problem;
  problem.target.positions.resize(3, 3);
  problem.target.positions << 0.0, 0.1, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, -0.1;
  problem.target.triangles = {{0, 1, 2}};
  problem.fixed = {0, 1};
  problem.material = constants(3.0, 5e-3);
  const InversionResult result = inverted(problem, RestKind::kMetric, true);
  // A triangle without hinges swings about its fixed edge: a pendulum.
  EXPECT_EQ(result.status, InversionStatus::kCertified) << result.reason;
}

TEST(MetricRestTest, TheBudgetHoldsInTheExplanationToo) {
  InversionOptions options;
  options.time_budget_s = 0.6;
  const auto result = invert(arch(12, 0.53), options);
  ASSERT_TRUE(result.ok());
  EXPECT_LE(result->seconds, 1.5);
  EXPECT_FALSE(result->reason.empty());
}

TEST(MetricRestTest, LawsOfOtherElementsAreRefused) {
  InversionProblem problem = arch(5, 1.0);
  problem.material = test::shellMaterial("stvk");
  InversionOptions options;
  options.rest = RestKind::kMetric;
  const auto result = invert(problem, options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().kind, ErrorKind::kUsage);
  problem.material = constants(3.0, 0.0);
  problem.material.laws.bending = nullptr;
  const auto limp = invert(problem, options);
  ASSERT_FALSE(limp.ok());
  EXPECT_NE(limp.error().message().find("--k-bend"), std::string::npos);
}

TEST(MetricRestTest, ProofAndCertificateFitTheirSchema) {
  const test_support::TemporaryFolder folder;
  for (const double factor : {0.5, 0.002, 4.0}) {
    const InversionProblem problem = arch(6, factor);
    const InversionResult result = inverted(problem, RestKind::kMetric);
    EXPECT_EQ(test_support::schemaErrors(
                  certificateToJson(problem, result, nullptr),
                  test_support::sourceFolder() / "docs/formats/certificate.schema.json"),
              std::vector<std::string>{});
    ASSERT_TRUE(writeInversion(folder / "out", problem, result, nullptr).ok());
    EXPECT_EQ(std::filesystem::exists(folder / "out/proof.vtp"), factor < 1.0);
    EXPECT_EQ(std::filesystem::exists(folder / "out/metric.json"), factor > 1.0);
  }
}

}  // namespace
}  // namespace tenter
