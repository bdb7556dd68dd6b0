// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/energy_terms.h"

#include <gtest/gtest.h>

#include <string>

#include "allocation_count.h"
#include "terms_support.h"

namespace tenter {
namespace {

using test_support::DeformedStates;
using test_support::DenseHessian;
using test_support::makeTerms;
using test_support::restCoordinates;
using test_support::Terms;

constexpr unsigned kSeed = 2012;
constexpr int kStates = 50;
/// What the product promises of its derivatives, relative to the largest entry.
constexpr double kDerivativeTolerance = 1e-6;
/// Sums of some hundred terms of size one in double precision.
constexpr double kRounding = 1e-11;
/// Height of a crushed triangle over the mean edge.
constexpr double kCrushed = 1e-3;

enum class Sheet { kUniform, kAlternating, kUnstructured, kClamped, kCurved };
const char* const kSheetNames[] = {"Uniform", "Alternating", "Unstructured", "Clamped", "Curved"};

SheetMesh makeSheet(Sheet kind) {
  const Vec2 size(0.04, 0.03);
  if (kind == Sheet::kUnstructured) return unstructuredSheet(size, 0.011, kSeed);
  const SheetMesh flat = gridSheet(
      size, 5, 4,
      kind == Sheet::kAlternating ? DiagonalPattern::kAlternating : DiagonalPattern::kUniform);
  if (kind != Sheet::kCurved) return flat;
  TriangleMesh mesh = flat.rest;
  for (int i = 0; i < mesh.vertexCount(); ++i) {
    mesh.positions(2, i) = 12.0 * mesh.positions(0, i) * (mesh.positions(1, i) + 0.01);
  }
  return sheetFromMesh(mesh, false).value();
}

std::vector<bool> rigidTriangles(Sheet kind, const SheetMesh& sheet) {
  if (kind != Sheet::kClamped) return {};
  std::vector<bool> rigid(sheet.triangleCount(), false);
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    rigid[t] = true;
    for (const int node : sheet.rest.triangles[t]) {
      rigid[t] = rigid[t] && sheet.rest.uv(0, node) < 0.011;
    }
  }
  return rigid;
}

struct Case {
  const ClothModel* model;
  Sheet sheet;
};

std::vector<Case> allCases() {
  std::vector<Case> cases;
  for (const ClothModel& model : clothModels()) {
    for (const Sheet sheet : {Sheet::kUniform, Sheet::kAlternating, Sheet::kUnstructured,
                              Sheet::kClamped, Sheet::kCurved}) {
      if (model.needs_grid && (sheet == Sheet::kUnstructured || sheet == Sheet::kCurved)) continue;
      cases.push_back({&model, sheet});
    }
  }
  return cases;
}

class EnergyTermsTest : public testing::TestWithParam<Case> {
 protected:
  EnergyTermsTest()
      : sheet(makeSheet(GetParam().sheet)),
        rigid(rigidTriangles(GetParam().sheet, sheet)),
        components(test_support::curvedComponents(model)),
        terms(makeTerms(model, components, sheet, rigid)),
        states(sheet, terms.coordinates, kSeed) {}

  /// Every fifth state has a crushed triangle.
  Eigen::VectorXd state(int k) {
    return k % 5 == 4 ? states.nextDegenerate(kCrushed * states.edge()) : states.next();
  }
  /// Fourth-order differences: this step leaves rounding and truncation two orders under the
  /// tolerance.
  double step(int k) const { return (k % 5 == 4 ? 1e-3 * kCrushed : 1e-5) * states.edge(); }

  const ClothModel& model = *GetParam().model;
  SheetMesh sheet;
  std::vector<bool> rigid;
  std::vector<ComponentCurve> components;
  Terms terms;
  DeformedStates states;
};

/// (f(-2h) - 8 f(-h) + 8 f(h) - f(2h)) / 12h.
template <class F>
auto difference(const F& f, Eigen::VectorXd q, int i, double h) {
  const double middle = q[i];
  const auto at = [&](double offset) {
    q[i] = middle + offset;
    return f(q);
  };
  auto sum = at(h);
  sum -= at(-h);
  sum *= 8.0;
  sum += at(-2.0 * h);
  sum -= at(2.0 * h);
  sum /= 12.0 * h;
  return sum;
}

TEST_P(EnergyTermsTest, RestHasNoForceAndNoEnergy) {
  const Eigen::VectorXd q = restCoordinates(sheet, terms.coordinates);
  const double reference = terms.gradient(states.next()).cwiseAbs().maxCoeff();
  ASSERT_GT(reference, 0.0);
  EXPECT_LE(terms.gradient(q).cwiseAbs().maxCoeff(), 1e-12 * reference);
  EXPECT_NEAR(terms.energy(q), 0.0, 1e-18);
}

TEST_P(EnergyTermsTest, ForceIsMinusTheGradientOfEveryTermsEnergy) {
  double worst = 0.0;
  for (int k = 0; k < kStates; ++k) {
    const Eigen::VectorXd q = state(k);
    for (const auto& term : terms.cloth.terms) {
      Eigen::VectorXd g = Eigen::VectorXd::Zero(terms.coordinates), numeric = g;
      term->addGradient(q, g);
      for (int i = 0; i < terms.coordinates; ++i) {
        numeric[i] =
            difference([&](const Eigen::VectorXd& x) { return term->energy(x); }, q, i, step(k));
      }
      const double scale = g.cwiseAbs().maxCoeff();
      ASSERT_GT(scale, 0.0);
      worst = std::max(worst, (g - numeric).cwiseAbs().maxCoeff() / scale);
    }
  }
  EXPECT_LE(worst, kDerivativeTolerance);
  std::printf("  %s gradient: %.1e\n", std::string(model.id).c_str(), worst);
}

TEST_P(EnergyTermsTest, HessianIsTheGradientOfTheGradient) {
  double worst = 0.0;
  for (int k = 0; k < kStates; ++k) {
    const Eigen::VectorXd q = state(k);
    for (const auto& term : terms.cloth.terms) {
      DenseHessian h(*term, terms.coordinates);
      term->addHessian(q, Projection::kNone, h);
      EXPECT_TRUE(h.in_order);
      EXPECT_EQ(h.elements(), static_cast<int>(term->stencils().size()));
      EXPECT_LE(h.largest_asymmetry, kRounding);
      Eigen::MatrixXd numeric(terms.coordinates, terms.coordinates);
      const auto gradient = [&](const Eigen::VectorXd& x) {
        Eigen::VectorXd g = Eigen::VectorXd::Zero(terms.coordinates);
        term->addGradient(x, g);
        return g;
      };
      for (int i = 0; i < terms.coordinates; ++i) {
        numeric.col(i) = difference(gradient, q, i, step(k));
      }
      const double scale = h.matrix.cwiseAbs().maxCoeff();
      ASSERT_GT(scale, 0.0);
      worst = std::max(worst, (h.matrix - numeric).cwiseAbs().maxCoeff() / scale);
    }
  }
  EXPECT_LE(worst, kDerivativeTolerance);
  std::printf("  %s Hessian: %.1e\n", std::string(model.id).c_str(), worst);
}

TEST_P(EnergyTermsTest, ProjectedElementsHaveNoNegativeEigenvalue) {
  bool differed = false;
  for (int k = 0; k < kStates; ++k) {
    const Eigen::VectorXd q = state(k);
    for (const auto& term : terms.cloth.terms) {
      DenseHessian projected(*term, terms.coordinates), exact(*term, terms.coordinates);
      projected.with_eigenvalues = exact.with_eigenvalues = true;
      term->addHessian(q, Projection::kPositiveSemiDefinite, projected);
      term->addHessian(q, Projection::kNone, exact);
      EXPECT_GE(projected.smallest_eigenvalue, -kRounding);
      differed = differed || exact.smallest_eigenvalue < -1e-3;
    }
  }
  EXPECT_TRUE(differed) << "no state needed the projection";
}

TEST_P(EnergyTermsTest, RigidMotionTurnsForcesAndLeavesEnergy) {
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd q = states.next();
    const Eigen::AngleAxisd turn(0.3 + k, Vec3(1.0, 2.0, -0.5).normalized());
    const Vec3 shift(0.01, -0.02, 0.03);
    Eigen::VectorXd moved = q;
    for (int i = 0; i < sheet.nodeCount(); ++i) {
      moved.segment<3>(3 * i) = turn * Vec3(q.segment<3>(3 * i)) + shift;
    }
    EXPECT_NEAR(terms.energy(moved) / terms.energy(q), 1.0, 1e-10);
    const Eigen::VectorXd g = terms.gradient(q), g_moved = terms.gradient(moved);
    const double scale = g.cwiseAbs().maxCoeff();
    for (int i = 0; i < sheet.nodeCount(); ++i) {
      EXPECT_LE((g_moved.segment<3>(3 * i) - turn * Vec3(g.segment<3>(3 * i))).norm(),
                1e-10 * scale);
    }
    const auto extra = terms.coordinates - 3 * sheet.nodeCount();
    EXPECT_LE((g_moved - g).tail(extra).norm(), 1e-10 * scale);
  }
}

TEST_P(EnergyTermsTest, ForcesAndTorquesSumToZero) {
  for (int k = 0; k < kStates; ++k) {
    const Eigen::VectorXd q = states.next(), g = terms.gradient(q);
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    double scale = 0.0, torque_scale = 0.0;
    for (int i = 0; i < sheet.nodeCount(); ++i) {
      const Vec3 f = g.segment<3>(3 * i), x = q.segment<3>(3 * i);
      force += f;
      torque += x.cross(f);
      scale += f.norm();
      torque_scale += x.norm() * f.norm();
    }
    EXPECT_LE(force.norm(), kRounding * scale);
    EXPECT_LE(torque.norm(), kRounding * torque_scale);
  }
}

TEST_P(EnergyTermsTest, ParameterGradientIsTheDerivativeOfTheGradient) {
  const Eigen::VectorXd q = states.next();
  std::vector<Eigen::MatrixXd> analytic;
  for (const auto& term : terms.cloth.terms) {
    analytic.emplace_back(Eigen::MatrixXd::Zero(terms.coordinates, term->parameterCount()));
    term->addParameterGradient(q, analytic.back());
  }
  const int membrane_count = static_cast<int>(model.membrane_components.size());
  std::vector<int> column(2, 0);
  for (int c = 0; c < model.componentCount(); ++c) {
    const int term = c < membrane_count ? 0 : 1;
    const SplineBasis& basis = *components[c].basis;
    const Eigen::VectorXd coefficients = basis.coefficientsOf(components[c].curve);
    const double h = 0.1 * coefficients.maxCoeff();
    for (int j = 0; j < basis.size(); ++j) {
      Eigen::VectorXd sides[2];
      for (int side = 0; side < 2; ++side) {
        std::vector<ComponentCurve> changed = components;
        Eigen::VectorXd moved = coefficients;
        moved[j] += side == 0 ? h : -h;
        changed[c].curve = basis.curve(moved);
        sides[side] = makeTerms(model, changed, sheet, rigid).gradient(q);
      }
      const Eigen::VectorXd numeric = (sides[0] - sides[1]) / (2.0 * h);
      ASSERT_LT(column[term], analytic[term].cols());
      const Eigen::VectorXd exact = analytic[term].col(column[term]++);
      const double scale = analytic[term].cwiseAbs().maxCoeff();
      ASSERT_GT(scale, 0.0);
      // The gradient is linear in coefficients, so only the rounding of a total gradient remains.
      const double noise = 1e-13 * sides[0].cwiseAbs().maxCoeff() / h;
      EXPECT_LE((exact - numeric).cwiseAbs().maxCoeff(), kRounding * scale + noise)
          << model.component(c).name << " " << j;
    }
  }
  for (int term = 0; term < 2; ++term) EXPECT_EQ(column[term], analytic[term].cols());
}

TEST_P(EnergyTermsTest, InnerLoopsDoNotAllocate) {
  struct Ignore final : HessianSink {
    void add(int /*element*/, const double* block) override { sum += block[0]; }
    double sum = 0.0;
  } sink;
  const Eigen::VectorXd q = states.next();
  Eigen::VectorXd g = Eigen::VectorXd::Zero(terms.coordinates);
  std::vector<Eigen::MatrixXd> derivative;
  Eigen::Matrix3Xd strains;
  for (const auto& term : terms.cloth.terms) {
    derivative.emplace_back(Eigen::MatrixXd::Zero(terms.coordinates, term->parameterCount()));
  }
  std::size_t before = 0;
  for (int pass = 0; pass < 2; ++pass) {  // The first pass grows the thread's scratch memory.
    before = test_support::allocationCount();
    for (std::size_t k = 0; k < terms.cloth.terms.size(); ++k) {
      const EnergyTerm& term = *terms.cloth.terms[k];
      term.energy(q);
      term.addGradient(q, g);
      term.addHessian(q, Projection::kNone, sink);
      term.addHessian(q, Projection::kPositiveSemiDefinite, sink);
      term.addParameterGradient(q, derivative[k]);
    }
  }
  EXPECT_EQ(test_support::allocationCount() - before, 0U);
  const std::vector<double> proof(100, 1.0);
  EXPECT_GT(test_support::allocationCount(), before) << "the counter is dead";
}

INSTANTIATE_TEST_SUITE_P(Models, EnergyTermsTest, testing::ValuesIn(allCases()),
                         [](const auto& test) {
                           std::string name(test.param.model->id);
                           std::erase(name, '-');
                           return name + kSheetNames[static_cast<int>(test.param.sheet)];
                         });

TEST(GravityTermTest, PotentialOfLumpedMasses) {
  const SheetMesh sheet = gridSheet({0.1, 0.2}, 3, 4, DiagonalPattern::kUniform);
  const Eigen::VectorXd mass = lumpedMass(sheet, 0.3);
  EXPECT_NEAR(mass.sum(), 0.3 * 0.1 * 0.2, 1e-15);
  const auto term = makeGravityTerm(mass, kDefaultGravity);
  Eigen::VectorXd q = restCoordinates(sheet, 3 * sheet.nodeCount() + 2);
  const double flat = term->energy(q);
  for (int i = 0; i < sheet.nodeCount(); ++i) q[3 * i + 2] += 0.5;
  EXPECT_NEAR(term->energy(q) - flat, 0.3 * 0.02 * 9.80665 * 0.5, 1e-12);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(q.size());
  term->addGradient(q, g);
  EXPECT_NEAR(g.sum(), 0.3 * 0.02 * 9.80665, 1e-12);
  EXPECT_TRUE(term->stencils().empty());
}

TEST(SpringTermTest, AreasShareOutTheSheet) {
  const std::vector<double> u{0.0, 0.01, 0.025, 0.03, 0.05, 0.06}, v{0.0, 0.02, 0.03, 0.05, 0.06};
  const SheetMesh sheet = gridSheet(GridLines{u, v, DiagonalPattern::kUniform});
  const auto law = std::make_shared<DiagonalLaw>(std::array<StiffnessCurve, 3>{
      StiffnessCurve::constant(1.0), StiffnessCurve::constant(1.0), StiffnessCurve::constant(1.0)});
  // Weft springs, warp springs and diagonals each share out every quad in two halves.
  EXPECT_NEAR(makeRing1SpringTerm(sheet, law)->elementAreas().sum(), 3.0 * 0.06 * 0.06, 1e-15);
  const auto ring2 = makeRing2SpringTerm(sheet, law);
  EXPECT_EQ(ring2->stencils().size(), 4U * 5U + 6U * 3U + 2U * 4U * 3U);
}

TEST(ProjectionTest, NearestPositiveSemiDefiniteMatrix) {
  Eigen::MatrixXd block(3, 3);
  block << 1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 5.0;  // Eigenvalues 3, -1, 5.
  projectPositiveSemiDefinite(block);
  Eigen::MatrixXd expected(3, 3);
  expected << 1.5, 1.5, 0.0, 1.5, 1.5, 0.0, 0.0, 0.0, 5.0;
  EXPECT_LE((block - expected).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace tenter
