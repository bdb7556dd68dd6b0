// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/cloth_system.h"

#include <gtest/gtest.h>

#include <random>

#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {
namespace {

constexpr unsigned kSeed = 11;
/// Central differences with a relative step of 1e-5 leave about 1e-9 of the largest entry; two
/// orders of margin.
constexpr double kDifferenceTolerance = 1e-7;
constexpr double kStep_m = 1e-7;

struct Case {
  const char* name;
  const char* model;
  bool free_clip;
};

std::vector<ComponentCurve> linearComponents(const ClothModel& model) {
  std::vector<ComponentCurve> components;
  for (int c = 0; c < model.componentCount(); ++c) {
    const bool bending = c >= static_cast<int>(model.membrane_components.size());
    const bool even = model.component(c).even;
    ComponentCurve component;
    component.basis = std::make_shared<SplineBasis>(SplineBasis::constant(even));
    component.curve =
        StiffnessCurve::constant((!bending                                    ? 400.0
                                  : model.bending == BendingElement::kSprings ? 40.0
                                                                              : 1e-4) *
                                     (1.0 + 0.2 * c),
                                 even);
    components.push_back(component);
  }
  return components;
}

class ClothSystemTest : public testing::TestWithParam<Case> {
 protected:
  /// A 7 x 6 sheet, one edge in a prescribed clip, the other in a clip that is free and hangs on a
  /// cord, or prescribed.
  ClothSystem makeSystem() {
    const ClothModel& model = **findClothModel(GetParam().model);
    SheetMesh sheet = gridSheet({0.06, 0.05}, 7, 6, DiagonalPattern::kUniform);
    SystemSetup setup;
    setup.areal_density_kg_per_m2 = 0.2;
    ClipSetup left, right;
    left.id = "left";
    right.id = "right";
    right.free = GetParam().free_clip;
    right.mass_kg = 0.01;
    right.centre_of_mass_m = {0.062, 0.025, -0.001};
    right.forces.push_back({{0.06, 0.01, 0.0}, {0.3, 0.1, 0.05}});
    right.cords.push_back({{0.06, 0.04, 0.0}, {0.2, 0.06, 0.01}, 0.1, 50.0});
    for (int j = 0; j < 6; ++j) {
      for (int i : {0, 1}) left.nodes.push_back(sheet.grid->node(i, j));
      for (int i : {5, 6}) right.nodes.push_back(sheet.grid->node(i, j));
    }
    setup.clips = {left, right};
    auto system = ClothSystem::create(std::move(sheet), model,
                                      makeLaws(model, linearComponents(model)), setup);
    EXPECT_TRUE(system.ok()) << system.error().message();
    return std::move(*system);
  }

  /// Random small displacements, clips moved too.
  ClothState deformed(const ClothSystem& system) {
    std::mt19937 random(kSeed);
    const auto noise = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
    ClothState state = system.restState();
    for (double& v : state.q) v += 4e-3 * noise();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = Eigen::AngleAxisd(0.1, Vec3(0.3, 1.0, 0.2).normalized()).toRotationMatrix();
    pose.translation() = Vec3(0.002, 0.001, -0.003);
    system.setClipPose(state, 0, Eigen::Isometry3d::Identity());
    system.setClipPose(state, 1, pose);
    return state;
  }
};

class FreeClipTest : public ClothSystemTest {};
class PrescribedClipTest : public ClothSystemTest {};

double largest(const Eigen::MatrixXd& m) { return m.cwiseAbs().maxCoeff(); }

TEST_P(ClothSystemTest, GradientIsTheDerivativeOfTheEnergy) {
  const ClothSystem system = makeSystem();
  const ClothState state = deformed(system);
  Eigen::VectorXd g;
  system.gradient(state, g);
  for (int d = 0; d < system.dofCount(); ++d) {
    ClothState forward = state, backward = state;
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(system.dofCount(), d);
    system.advance(forward, unit, kStep_m);
    system.advance(backward, unit, -kStep_m);
    const double difference = (system.energy(forward) - system.energy(backward)) / (2 * kStep_m);
    EXPECT_NEAR(g[d], difference, 1e-6 * largest(g)) << "dof " << d;
  }
}

TEST_P(ClothSystemTest, HessianIsTheDerivativeOfTheGradient) {
  const ClothSystem system = makeSystem();
  const ClothState state = deformed(system);
  const SparseLower h = system.hessian(state, Projection::kNone);
  const int clip_begin = system.dofCount() - (GetParam().free_clip ? 6 : 0);
  double worst = 0.0;
  for (int d = 0; d < system.dofCount(); ++d) {
    ClothState forward = state, backward = state;
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(system.dofCount(), d);
    Eigen::VectorXd g_forward, g_backward, column;
    system.advance(forward, unit, kStep_m);
    system.gradient(forward, g_forward);
    system.advance(backward, unit, -kStep_m);
    system.gradient(backward, g_backward);
    multiply(h, unit, column);
    const Eigen::VectorXd defect = column - (g_forward - g_backward) / (2 * kStep_m);
    // Rotations do not commute: the gradient in the moved frame differs from the second derivative
    // by a skew-symmetric part, which only the clip's own rotation block shows. There the symmetric
    // part counts.
    worst = std::max(worst, largest(defect.head(clip_begin)));
    if (d < clip_begin) worst = std::max(worst, largest(defect));
  }
  Eigen::Map<const Eigen::VectorXd> values(h.value.data(),
                                           static_cast<Eigen::Index>(h.value.size()));
  EXPECT_LE(worst, kDifferenceTolerance * largest(values));
}

TEST_P(FreeClipTest, ClipBlockIsTheSecondDerivativeOfTheEnergy) {
  const ClothSystem system = makeSystem();
  const ClothState state = deformed(system);
  const SparseLower h = system.hessian(state, Projection::kNone);
  const int n = system.dofCount();
  const double step = 1e-5;
  for (int a = n - 6; a < n; ++a) {
    for (int b = n - 6; b < n; ++b) {
      const auto energyAt = [&](double sa, double sb) {
        ClothState moved = state;
        Eigen::VectorXd dof_step = Eigen::VectorXd::Zero(n);
        dof_step[a] += sa;
        dof_step[b] += sb;
        system.advance(moved, dof_step, 1.0);
        return system.energy(moved);
      };
      const double difference = (energyAt(step, step) - energyAt(step, -step) -
                                 energyAt(-step, step) + energyAt(-step, -step)) /
                                (4 * step * step);
      Eigen::VectorXd column;
      multiply(h, Eigen::VectorXd::Unit(n, b), column);
      EXPECT_NEAR(column[a], difference, 1e-4 * largest(column)) << a << ", " << b;
    }
  }
}

TEST_P(ClothSystemTest, ParameterGradientMatchesDifferences) {
  const ClothModel& model = **findClothModel(GetParam().model);
  const ClothSystem system = makeSystem();
  const ClothState state = deformed(system);
  Eigen::MatrixXd derivative;
  system.gradientByParameter(state, derivative);
  // The energy is linear in the stiffnesses, so a difference of two materials is exact.
  auto components = linearComponents(model);
  int column = 0;
  for (ComponentCurve& component : components) {
    const StiffnessCurve before = component.curve;
    const double delta = 0.1 * before.stiffnesses()[0];
    component.curve = StiffnessCurve::constant(before.stiffnesses()[0] + delta, before.even());
    auto changed =
        ClothSystem::create(system.sheet(), model, makeLaws(model, components), system.setup());
    ASSERT_TRUE(changed.ok());
    Eigen::VectorXd g0, g1;
    system.gradient(state, g0);
    changed->gradient(state, g1);
    // The difference cancels all but this component's share of the forces: rounding of the whole
    // remains.
    const double rounding = 1e-14 * largest(g0) / delta;
    EXPECT_LE(largest((g1 - g0) / delta - derivative.col(column)),
              1e-9 * largest(derivative.col(column)) + rounding)
        << model.component(column).name;
    component.curve = before;
    ++column;
  }
  EXPECT_EQ(column, system.parameterCount());
}

TEST_P(PrescribedClipTest, WrenchByPoseMatchesDifferencesAtFixedCloth) {
  const ClothSystem system = makeSystem();
  const ClothState state = deformed(system);
  for (int moved : {0, 1}) {
    const Eigen::MatrixXd still = Eigen::MatrixXd::Zero(system.dofCount(), 6);
    const Eigen::MatrixXd analytic = system.clipWrenchByPose(state, 1, moved, still);
    const Eigen::MatrixXd by_pose = system.gradientByPose(state, moved);
    for (int k = 0; k < 6; ++k) {
      const auto at = [&](double s) {
        Eigen::Isometry3d small = Eigen::Isometry3d::Identity();
        if (k < 3) {
          small.translation()[k] = s;
        } else {
          small.linear() = Eigen::AngleAxisd(s, Vec3::Unit(k - 3)).toRotationMatrix();
        }
        ClothState other = state;
        system.setClipPose(other, moved, small * state.clips[moved]);
        return other;
      };
      const Wrench f = system.clipWrench(at(kStep_m), 1), b = system.clipWrench(at(-kStep_m), 1);
      Eigen::VectorXd difference(6);
      difference << (f.force_N - b.force_N), (f.torque_N_m - b.torque_N_m);
      difference /= 2 * kStep_m;
      // The clip's own weight moves with the pose; it is not part of the cloth's derivative.
      if (moved == 1 && k >= 3) {
        const ClipSetup& clip = system.setup().clips[1];
        const Vec3 arm = state.clips[1] * clip.centre_of_mass_m;
        difference.tail<3>() -=
            Vec3(Vec3::Unit(k - 3).cross(arm)).cross(Vec3(clip.mass_kg * kDefaultGravity));
      } else if (moved == 1) {
        difference.tail<3>() -=
            Vec3(Vec3::Unit(k)).cross(Vec3(system.setup().clips[1].mass_kg * kDefaultGravity));
      }
      EXPECT_LE(largest(analytic.col(k) - difference), 1e-6 * largest(analytic))
          << "moved " << moved << " k " << k;

      Eigen::VectorXd gf, gb;
      system.gradient(at(kStep_m), gf);
      system.gradient(at(-kStep_m), gb);
      EXPECT_LE(largest(by_pose.col(k) - (gf - gb) / (2 * kStep_m)), 1e-6 * largest(by_pose));
    }
  }
}

constexpr Case kPrescribed[] = {
    {"stvk", "stvk", false}, {"soft", "soft", false}, {"springs", "springs", false}};
constexpr Case kFree[] = {
    {"stvk_free", "stvk", true}, {"soft_free", "soft", true}, {"springs_free", "springs", true}};
const auto kCaseName = [](const testing::TestParamInfo<Case>& test) { return test.param.name; };

INSTANTIATE_TEST_SUITE_P(Prescribed, ClothSystemTest, testing::ValuesIn(kPrescribed), kCaseName);
INSTANTIATE_TEST_SUITE_P(Free, ClothSystemTest, testing::ValuesIn(kFree), kCaseName);
INSTANTIATE_TEST_SUITE_P(Free, FreeClipTest, testing::ValuesIn(kFree), kCaseName);
INSTANTIATE_TEST_SUITE_P(Prescribed, PrescribedClipTest, testing::ValuesIn(kPrescribed), kCaseName);

TEST(ClothSystem, RefusesANodeInTwoClips) {
  const ClothModel& model = **findClothModel("stvk");
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = 0.1;
  setup.clips.resize(2);
  setup.clips[0].nodes = {0, 1};
  setup.clips[1].nodes = {1, 2};
  const auto system = ClothSystem::create(gridSheet({0.1, 0.1}, 4, 4, DiagonalPattern::kUniform),
                                          model, makeLaws(model, linearComponents(model)), setup);
  ASSERT_FALSE(system.ok());
  EXPECT_EQ(system.error().place, "node 1");
}

}  // namespace
}  // namespace tenter
