// SPDX-License-Identifier: GPL-3.0-or-later
#include "contact_load.h"

#include <gtest/gtest.h>

#include <random>

#include "second_order_cone.h"

namespace tenter {
namespace {

/// Dense lower triangle.
SparseLower lowerOf(const Eigen::MatrixXd& m) {
  SparseLower h;
  h.size = static_cast<int>(m.rows());
  h.column_begin.push_back(0);
  for (int c = 0; c < h.size; ++c) {
    for (int r = c; r < h.size; ++r) {
      h.row.push_back(r);
      h.value.push_back(m(r, c));
    }
    h.column_begin.push_back(static_cast<int>(h.row.size()));
  }
  return h;
}

class ContactLoadTest : public ::testing::Test {
 protected:
  double uniform() { return 2.0 * static_cast<double>(random_()) / 4294967295.0 - 1.0; }
  std::mt19937 random_{20260105};
};

TEST_F(ContactLoadTest, MeetsTheConditionsOfTheOptimum) {
  // To the solver's own tolerance; the load has unit size.
  constexpr double kTolerance = 1e-5;
  for (int sample = 0; sample < 20; ++sample) {
    constexpr int kVertices = 5;
    Eigen::MatrixXd a(3 * kVertices, 3 * kVertices);
    for (double& v : a.reshaped()) v = uniform();
    const Eigen::MatrixXd m = a * a.transpose() + Eigen::MatrixXd::Identity(a.rows(), a.cols());
    Eigen::VectorXd load(m.rows());
    for (double& v : load) v = uniform();
    std::vector<LoadCone> cones;
    for (int v = 0; v < 3; ++v) {
      cones.push_back({3 * v, Vec3(uniform(), uniform(), uniform()).normalized(), 0.2 * v});
    }
    const SparseLower h = lowerOf(m);
    SparseCholesky cholesky(h);
    const ContactLoadResult r = solveContactLoad(h, load, cones, cholesky, nullptr);
    ASSERT_TRUE(r.converged);
    Eigen::VectorXd defect = m * r.motion - load;
    for (int i = 0; i < 3; ++i) {
      const Vec3 f = r.forces.col(i), u = r.motion.segment<3>(3 * i);
      defect.segment<3>(3 * i) -= f;
      EXPECT_LT((projectOnFrictionCone(f, cones[i].normal, cones[i].friction).point - f).norm(),
                kTolerance);
      const double un = u.dot(cones[i].normal);
      EXPECT_GE(un - cones[i].friction * (u - un * cones[i].normal).norm(), -kTolerance);
      EXPECT_NEAR(f.dot(u), 0.0, kTolerance);
    }
    EXPECT_LT(defect.norm(), kTolerance);
  }
}

TEST_F(ContactLoadTest, SaysThatNothingHoldsAShellThatOnlySlides) {
  // One free node without stiffness on a steep slope: gravity's way down lies in the dual cone.
  const SparseLower h = lowerOf(Eigen::MatrixXd::Zero(3, 3));
  SparseCholesky cholesky(h);
  const Vec3 normal = Vec3(-1.0, 0.0, 1.0).normalized();
  const Eigen::VectorXd load = Vec3(0.0, 0.0, -1.0);
  EXPECT_FALSE(solveContactLoad(h, load, {{0, normal, 0.5}}, cholesky, nullptr).converged);
}

TEST(FrictionConeTest, ProjectionIsTheNearestPointAndItsDerivativeAgrees) {
  std::mt19937 random(20260106);
  const auto uniform = [&] { return 2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0; };
  constexpr double kStep = 1e-6, kTolerance = 1e-6;
  for (int sample = 0; sample < 200; ++sample) {
    const Vec3 normal = Vec3(uniform(), uniform(), uniform()).normalized();
    const Vec3 force(uniform(), uniform(), uniform());
    const double friction = 0.1 + 0.4 * (sample % 3);
    const ConeProjection p = projectOnFrictionCone(force, normal, friction);
    // The rest of the force lies in the polar cone, at right angles to the projection.
    EXPECT_NEAR(p.point.dot(force - p.point), 0.0, 1e-12);
    const Vec3 rest = p.point - force;
    const double n = rest.dot(normal);
    EXPECT_GE(n - friction * (rest - n * normal).norm(), -1e-12);
    for (int k = 0; k < 3; ++k) {
      Vec3 plus = force, minus = force;
      plus[k] += kStep;
      minus[k] -= kStep;
      const Vec3 difference = (projectOnFrictionCone(plus, normal, friction).point -
                               projectOnFrictionCone(minus, normal, friction).point) /
                              (2.0 * kStep);
      EXPECT_LT((difference - p.derivative.col(k)).norm(), kTolerance);
    }
  }
}

}  // namespace
}  // namespace tenter
