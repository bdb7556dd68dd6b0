// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/specimen_law.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <memory>

#include "random_numbers.h"
#include "tenter/twin/fabrics.h"

namespace tenter {
namespace {

constexpr std::uint64_t kSeed = 20120613;
constexpr int kStates = 50;
// Central differences of order h^4 with h = 1e-4 of the strain's size leave 1e-8 at most.
constexpr double kDerivativeTolerance = 1e-6;

/// Fourth-order central difference of a function of one number.
template <class F>
auto derivative(F f, double h) {
  return (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
}

void expectConsistent(const StrainLaw& law, const Vec3& strain, const Vec3& scale) {
  const LawValue at = law.evaluate(strain, 0);
  Vec3 stress;
  Mat3 tangent;
  for (int i = 0; i < 3; ++i) {
    const Vec3 direction = Vec3::Unit(i);
    const double h = 1e-4 * scale[i];
    stress[i] =
        derivative([&](double d) { return law.evaluate(strain + d * direction, 0).energy; }, h);
    for (int j = 0; j < 3; ++j) {
      tangent(j, i) = derivative(
          [&](double d) { return law.evaluate(strain + d * direction, 0).stress[j]; }, h);
    }
  }
  // Relative to the work over the scale of each strain, since the components differ by orders of
  // magnitude.
  const Vec3 work = stress.cwiseProduct(scale);
  ASSERT_GT(at.stress.norm(), 0.0);
  EXPECT_LT((at.stress.cwiseProduct(scale) - work).norm(), kDerivativeTolerance * work.norm());
  const Mat3 scaled = scale.asDiagonal() * tangent * scale.asDiagonal();
  const Mat3 error = scale.asDiagonal() * (at.tangent - tangent) * scale.asDiagonal();
  EXPECT_LT(error.norm(), kDerivativeTolerance * scaled.norm());
  EXPECT_EQ(at.tangent, at.tangent.transpose());
}

/// Strains that the fabric reaches in a test, roughly.
Vec3 membraneScale(const Fabric& f) {
  const Vec3 base = f.membrane.base_N_per_m;
  return {std::min(0.3, 100.0 / base[0]), std::min(0.3, 100.0 / base[1]), 0.3};
}

class SpecimenLawTest : public testing::TestWithParam<int> {
 protected:
  const Fabric& fabric() const { return fabrics()[static_cast<std::size_t>(GetParam())]; }
  RandomNumbers random_{kSeed, "states"};
};

TEST_P(SpecimenLawTest, MembraneStressAndTangentAreDerivativesOfTheEnergy) {
  const SpecimenMembraneLaw law(fabric().membrane);
  const Vec3 scale = membraneScale(fabric());
  for (int k = 0; k < kStates; ++k)
    expectConsistent(law, random_.normal3().cwiseProduct(scale), scale);
}

TEST_P(SpecimenLawTest, MembraneGoesOnSmoothlyBeyondItsLimits) {
  const SpecimenMembraneLaw law(fabric().membrane);
  const Vec3 scale = membraneScale(fabric());
  for (int k = 0; k < kStates; ++k) {
    expectConsistent(law, 30.0 * random_.normal3().cwiseProduct(scale), scale);
    expectConsistent(law, Vec3(-0.5 - 0.1 * random_.uniform(), -0.49, random_.normal()),
                     Vec3::Constant(0.1));
  }
  EXPECT_TRUE(std::isfinite(law.evaluate(Vec3::Constant(1e6), 0).energy));
}

TEST_P(SpecimenLawTest, MembraneIsStableInItsRange) {
  const SpecimenMembraneLaw law(fabric().membrane);
  const Vec3 scale = membraneScale(fabric());
  for (int k = 0; k < kStates; ++k) {
    const Mat3 tangent = law.evaluate(random_.normal3().cwiseProduct(scale), 0).tangent;
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(tangent).eigenvalues().minCoeff(), 0.0);
  }
}

TEST_P(SpecimenLawTest, MembraneCouplesItsStrains) {
  const SpecimenMembraneLaw law(fabric().membrane);
  const Vec3 scale = membraneScale(fabric());
  const LawValue at = law.evaluate(Vec3(scale[0], scale[1], scale[2]), 0);
  EXPECT_GT(at.tangent(0, 1), 0.0);
  EXPECT_GT(at.tangent(0, 2), 0.0);
  // Shear is stiffer in a stretched sheet.
  EXPECT_GT(at.tangent(2, 2), 1.01 * law.evaluate(Vec3(0.0, 0.0, scale[2]), 0).tangent(2, 2));
}

TEST_P(SpecimenLawTest, BendingStressAndTangentAreDerivativesOfTheEnergy) {
  const SpecimenBendingLaw law(fabric().bending);
  const Vec3 scale = Vec3::Constant(100.0);
  for (int k = 0; k < kStates; ++k)
    expectConsistent(law, random_.normal3().cwiseProduct(scale), scale);
}

TEST_P(SpecimenLawTest, BendingSoftensButStaysStable) {
  const SpecimenBendingLaw law(fabric().bending);
  for (int i = 0; i < 3; ++i) {
    const double first = law.evaluate(Vec3::Zero(), 0).tangent(i, i);
    EXPECT_DOUBLE_EQ(first, fabric().bending.rigidity_N_m[i]);
    EXPECT_LT(law.evaluate(300.0 * Vec3::Unit(i), 0).tangent(i, i), 0.95 * first);
  }
  for (int k = 0; k < kStates; ++k) {
    const Mat3 tangent = law.evaluate(200.0 * random_.normal3(), 0).tangent;
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(tangent).eigenvalues().minCoeff(), 0.0);
  }
}

TEST_P(SpecimenLawTest, FrictionIsConsistentBetweenCommits) {
  FrictionalLaw law(std::make_shared<SpecimenMembraneLaw>(fabric().membrane), fabric().friction, 1);
  const Vec3 scale = fabric().friction.slip_strain;
  for (int k = 0; k < kStates; ++k) {
    law.commit(2.0 * random_.normal3().cwiseProduct(scale), 0);
    expectConsistent(law, law.slip().col(0) + random_.normal3().cwiseProduct(scale), scale);
  }
}

TEST_P(SpecimenLawTest, CommittingDoesNotChangeTheStressItWasCommittedAt) {
  FrictionalLaw law(std::make_shared<SpecimenMembraneLaw>(fabric().membrane), fabric().friction, 1);
  const Vec3 scale = fabric().friction.slip_strain;
  for (int k = 0; k < kStates; ++k) {
    const Vec3 strain = 3.0 * random_.normal3().cwiseProduct(scale);
    const Vec3 before = law.evaluate(strain, 0).stress;
    law.commit(strain, 0);
    const Vec3 after = law.evaluate(strain, 0).stress;
    EXPECT_LT((after - before).norm(), 1e-12 * before.norm());
  }
}

TEST_P(SpecimenLawTest, FrictionDissipatesOverACycleWhatItsLoopEncloses) {
  FrictionalLaw law(std::make_shared<SpecimenMembraneLaw>(fabric().membrane), fabric().friction, 1);
  const double top = 8.0 * fabric().friction.slip_strain[0];
  constexpr int kSteps = 4000;
  double work = 0.0, dissipated = 0.0;
  // Two cycles between 0 and top; the second is closed.
  Vec3 last = Vec3::Zero();
  for (int cycle = 0; cycle < 2; ++cycle) {
    work = dissipated = 0.0;
    for (int k = 1; k <= kSteps; ++k) {
      const double level = 1.0 - std::abs(2.0 * k / kSteps - 1.0);
      const Vec3 strain(top * level, 0.0, 0.0);
      const Vec3 middle = 0.5 * (law.evaluate(last, 0).stress + law.evaluate(strain, 0).stress);
      work += middle.dot(strain - last);
      const double lost = law.commit(strain, 0);
      EXPECT_GE(lost, 0.0);
      dissipated += lost;
      last = strain;
    }
  }
  EXPECT_GT(work, 0.0);
  // The trapezoidal rule over 4000 steps.
  EXPECT_NEAR(work, dissipated, 2e-3 * work);
}

TEST_P(SpecimenLawTest, FrictionIsReversibleBelowItsYield) {
  FrictionalLaw law(std::make_shared<SpecimenMembraneLaw>(fabric().membrane), fabric().friction, 1);
  const Vec3 small = 1.29 * fabric().friction.slip_strain;
  EXPECT_EQ(law.commit(small, 0), 0.0);
  EXPECT_EQ(law.commit(-small, 0), 0.0);
  EXPECT_EQ(law.slip().norm(), 0.0);
  EXPECT_EQ(law.evaluate(Vec3::Zero(), 0).stress.norm(), 0.0);
}

std::string fabricName(const testing::TestParamInfo<int>& parameter) {
  std::string name(fabrics()[static_cast<std::size_t>(parameter.param)].id);
  name[name.find('-')] = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(EveryFabric, SpecimenLawTest,
                         testing::Range(0, static_cast<int>(fabrics().size())), fabricName);

}  // namespace
}  // namespace tenter
