// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/strain_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "allocation_count.h"
#include "sample_material.h"

namespace tenter {
namespace {

/// Central differences with steps of 1e-6 of the strain range against analytic derivatives,
/// relative to the largest entry.
constexpr double kFiniteDifference = 1e-6;
constexpr double kStepOfRange = 1e-6;

/// Both laws of every model in the registry, and the coupled law around the bend of q(s).
struct LawCase {
  std::string name;
  const ClothModel* model;
  bool bending;
};

std::vector<LawCase> lawCases() {
  std::vector<LawCase> cases;
  for (const ClothModel& model : clothModels())
    for (const bool bending : {false, true}) {
      std::string name(model.id);
      std::replace(name.begin(), name.end(), '-', '_');
      cases.push_back({name + (bending ? "_bending" : "_membrane"), &model, bending});
    }
  return cases;
}

class StrainLawTest : public testing::TestWithParam<LawCase> {
 protected:
  void SetUp() override {
    components_ = test_support::sampleComponents(*GetParam().model, 5);
    law_ = make(components_);
    const auto& infos = GetParam().bending ? GetParam().model->bending_components
                                           : GetParam().model->membrane_components;
    range_ = infos.front().strain_unit == "1/m" ? 100.0 : 0.3;
  }

  std::shared_ptr<StrainLaw> make(const std::vector<ComponentCurve>& components) const {
    const ClothLaws laws = makeLaws(*GetParam().model, components);
    return GetParam().bending ? laws.bending : laws.membrane;
  }

  /// 50 seeded states, a few of them at rest or nearly so.
  std::vector<Vec3> strains() const {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> draw(-0.5, 1.2);
    std::vector<Vec3> list{Vec3::Zero(), Vec3(1e-9, -1e-9, 1e-9) * range_,
                           Vec3(-2e-3, 1e-3, 0.5) * range_};
    while (list.size() < 50)
      list.emplace_back(range_ * Vec3(draw(random), draw(random), draw(random)));
    return list;
  }

  std::vector<ComponentCurve> components_;
  std::shared_ptr<StrainLaw> law_;
  double range_ = 0.3;
};

TEST_P(StrainLawTest, RestHasNoEnergyAndNoStress) {
  const LawValue rest = law_->evaluate(Vec3::Zero(), 0);
  EXPECT_EQ(rest.energy, 0.0);
  EXPECT_EQ(rest.stress, Vec3::Zero());
  EXPECT_GT(rest.tangent.trace(), 0.0);
}

TEST_P(StrainLawTest, StressIsTheGradientOfTheEnergy) {
  const double h = kStepOfRange * range_;
  for (const Vec3& strain : strains()) {
    const LawValue at = law_->evaluate(strain, 0);
    const double scale = at.tangent.cwiseAbs().maxCoeff() * range_;
    ASSERT_GT(scale, 0.0);
    for (int i = 0; i < 3; ++i) {
      const double after = law_->evaluate(strain + h * Vec3::Unit(i), 0).energy;
      const double before = law_->evaluate(strain - h * Vec3::Unit(i), 0).energy;
      EXPECT_NEAR((after - before) / (2 * h), at.stress[i], kFiniteDifference * scale);
    }
  }
}

TEST_P(StrainLawTest, TangentIsTheGradientOfTheStress) {
  const double h = kStepOfRange * range_;
  for (const Vec3& strain : strains()) {
    const LawValue at = law_->evaluate(strain, 0);
    EXPECT_EQ(at.tangent, at.tangent.transpose());
    const double scale = at.tangent.cwiseAbs().maxCoeff();
    for (int i = 0; i < 3; ++i) {
      const Vec3 after = law_->evaluate(strain + h * Vec3::Unit(i), 0).stress;
      const Vec3 before = law_->evaluate(strain - h * Vec3::Unit(i), 0).stress;
      const Vec3 difference = (after - before) / (2 * h) - at.tangent.col(i);
      EXPECT_LT(difference.cwiseAbs().maxCoeff(), kFiniteDifference * scale) << strain.transpose();
    }
  }
}

TEST_P(StrainLawTest, StressIsLinearInItsParametersAsStated) {
  int expected = 0;
  const int membrane = static_cast<int>(GetParam().model->membrane_components.size());
  const int begin = GetParam().bending ? membrane : 0;
  const int end = GetParam().bending ? static_cast<int>(components_.size()) : membrane;
  for (int i = begin; i < end; ++i) expected += components_[i].basis->size();
  ASSERT_EQ(law_->parameterCount(), expected);

  int column = 0;
  for (int i = begin; i < end; ++i) {
    const SplineBasis& basis = *components_[i].basis;
    const Eigen::VectorXd c = basis.coefficientsOf(components_[i].curve);
    for (int j = 0; j < basis.size(); ++j, ++column) {
      const double step = 0.1 * c.maxCoeff();
      std::vector<ComponentCurve> moved = components_;
      moved[i].curve = basis.curve(c + step * Eigen::VectorXd::Unit(basis.size(), j));
      const auto moved_law = make(moved);
      for (const Vec3& strain : strains()) {
        Eigen::Matrix3Xd derivative = Eigen::Matrix3Xd::Constant(3, expected, 99.0);
        law_->stressByParameter(strain, derivative);
        const Vec3 difference =
            (moved_law->evaluate(strain, 0).stress - law_->evaluate(strain, 0).stress) / step;
        EXPECT_LT((difference - derivative.col(column)).cwiseAbs().maxCoeff(),
                  kFiniteDifference * range_);
      }
    }
  }
}

TEST_P(StrainLawTest, FixedCurvesAreNoParameters) {
  for (ComponentCurve& component : components_) component.basis = nullptr;
  const auto fixed = make(components_);
  EXPECT_EQ(fixed->parameterCount(), 0);
  Eigen::Matrix3Xd none(3, 0);
  fixed->stressByParameter(Vec3(0.1, 0.2, 0.3), none);
  EXPECT_EQ(fixed->evaluate(Vec3(0.1, 0.2, 0.3), 0).energy,
            law_->evaluate(Vec3(0.1, 0.2, 0.3), 0).energy);
}

TEST_P(StrainLawTest, EvaluatesWithoutAllocating) {
  Eigen::Matrix3Xd derivative(3, law_->parameterCount());
  const std::vector<Vec3> list = strains();
  double sum = 0.0;
  const std::size_t before = test_support::allocationCount();
  for (const Vec3& strain : list) {
    sum += law_->evaluate(strain, 0).energy;
    law_->stressByParameter(strain, derivative);
  }
  EXPECT_EQ(test_support::allocationCount(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

INSTANTIATE_TEST_SUITE_P(EveryModel, StrainLawTest, testing::ValuesIn(lawCases()),
                         [](const auto& one) { return one.param.name; });

DiagonalLaw constants(double u, double v, double shear) {
  return DiagonalLaw({StiffnessCurve::constant(u), StiffnessCurve::constant(v),
                      StiffnessCurve::constant(shear, true)});
}

TEST(DiagonalLaw, OfConstantsIsTheSumOfHalfSquares) {
  const LawValue value = constants(100, 200, 30).evaluate(Vec3(0.1, -0.2, 0.3), 0);
  EXPECT_DOUBLE_EQ(value.energy, 0.5 * (100 * 0.01 + 200 * 0.04 + 30 * 0.09));
  EXPECT_DOUBLE_EQ(value.stress[1], -40.0);
  EXPECT_EQ(value.tangent, Mat3(Vec3(100, 200, 30).asDiagonal()));
}

TEST(CoupledLaw, WithoutCouplingsIsTheDiagonalLaw) {
  const CoupledLaw coupled(constants(100, 200, 30), 0.0, 0.0);
  const Vec3 strain(0.1, -0.2, 0.3);
  EXPECT_EQ(coupled.evaluate(strain, 0).energy, constants(100, 200, 30).evaluate(strain, 0).energy);
  EXPECT_EQ(coupled.evaluate(strain, 0).tangent,
            constants(100, 200, 30).evaluate(strain, 0).tangent);
}

TEST(CoupledLaw, StiffensShearUnderTensionByItsFormula) {
  const CoupledLaw law(constants(0, 0, 0), 50.0, 400.0);
  const double d = 1e-3;
  for (const double s : {-0.5, -0.01, 0.0, 0.01, 0.5}) {
    const Vec3 strain(0.6 * s, 0.4 * s, 0.2);
    const double q = 0.5 * (s + std::sqrt(s * s + d * d));
    // The textbook form of q cancels for s < 0: d^2 / 4 |s| from |s| leaves about 1e-11 of it here.
    EXPECT_NEAR(law.evaluate(strain, 0).energy - 50.0 * 0.24 * s * s, 0.5 * 400 * 0.04 * q,
                1e-12 * 400);
  }
}

TEST(CoupledLaw, PositivePartKeepsItsDigitsFarInCompression) {
  const CoupledLaw law(constants(0, 0, 0), 0.0, 1.0);
  const double s = -1e3, d = 1e-3;
  const double expected = 0.5 * d * d / 4.0 / std::abs(s);  // q -> d^2 / (4 |s|).
  EXPECT_NEAR(law.evaluate(Vec3(s, 0.0, 1.0), 0).energy / expected, 1.0, 1e-9);
}

}  // namespace
}  // namespace tenter
