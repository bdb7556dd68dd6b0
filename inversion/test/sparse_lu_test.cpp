// SPDX-License-Identifier: GPL-3.0-or-later
#include "sparse_lu.h"

#include <gtest/gtest.h>

namespace tenter {
namespace {

/// Not symmetric, with a zero on its diagonal and entries 1e8 apart.
Eigen::SparseMatrix<double> sample(double corner) {
  Eigen::SparseMatrix<double> a(3, 3);
  a.insert(0, 0) = 0.0;
  a.insert(0, 1) = 1e8;
  a.insert(1, 0) = 2.0;
  a.insert(1, 2) = -3.0;
  a.insert(2, 1) = 5.0;
  a.insert(2, 2) = corner;
  a.makeCompressed();
  return a;
}

TEST(SparseLuTest, SolvesBothWaysAndTakesNewValues) {
  SparseLu lu;
  const Eigen::VectorXd x = Eigen::Vector3d(1.0, -2.0, 0.5);
  for (const double corner : {4.0, -7.0}) {
    const auto a = sample(corner);
    ASSERT_TRUE(lu.factorize(a));
    Eigen::VectorXd got;
    ASSERT_TRUE(lu.solve(a * x, got));
    EXPECT_LT((got - x).norm(), 1e-14);
    ASSERT_TRUE(lu.solveTransposed(a.transpose() * x, got));
    EXPECT_LT((got - x).norm(), 1e-14);
  }
}

TEST(SparseLuTest, RefusesWhatIsSingular) {
  SparseLu lu;
  Eigen::VectorXd got;
  EXPECT_FALSE(lu.factorize(sample(0.0)));
  EXPECT_FALSE(lu.solve(Eigen::Vector3d::Ones(), got));
  EXPECT_TRUE(lu.factorize(sample(1.0)));
}

}  // namespace
}  // namespace tenter
