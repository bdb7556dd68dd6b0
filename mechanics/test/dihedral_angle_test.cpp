// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/dihedral_angle.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tenter/core/types.h"

namespace tenter {
namespace {

constexpr unsigned kSeed = 5;
constexpr double kDerivativeTolerance = 1e-6;

/// An edge of length 1 and two wings of given heights, at a given angle.
Vec12 hinge(double angle, double height_left, double height_right, double foot = 0.4) {
  Vec12 x = Vec12::Zero();
  x.segment<3>(3) = Vec3::UnitY();
  x.segment<3>(6) = Vec3(-height_left, foot, 0.0);
  x.segment<3>(9) =
      Vec3(height_right * std::cos(angle), 1.0 - foot, -height_right * std::sin(angle));
  return x;
}

Vec12 turned(const Vec12& x, std::mt19937* engine) {
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond q(
      Eigen::Vector4d(normal(*engine), normal(*engine), normal(*engine), normal(*engine))
          .normalized());
  Vec12 out;
  for (int i = 0; i < 4; ++i) out.segment<3>(3 * i) = q * Vec3(x.segment<3>(3 * i));
  return out;
}

TEST(DihedralAngleTest, IsSignedAndZeroWhenFlat) {
  for (const double angle : {0.0, 1e-9, 0.3, -0.3, 2.0, -2.0, 3.14, -3.14}) {
    EXPECT_NEAR(dihedralAngle(hinge(angle, 0.7, 1.3)), angle, 1e-15 + 1e-15 * std::abs(angle));
  }
}

TEST(DihedralAngleTest, DerivativesMatchDifferences) {
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double worst_gradient = 0.0, worst_hessian = 0.0;
  for (int k = 0; k < 50; ++k) {
    // Every second state has a wing of 1 to 1e-6 of the edge.
    const double height = k % 2 == 0 ? 1.0 : std::pow(10.0, -6.0 * (k / 2) / 24.0);
    Vec12 x = hinge(2.8 * uniform(engine), height, 0.8 + 0.3 * uniform(engine),
                    0.4 + 0.3 * uniform(engine));
    x = turned(x, &engine);
    Vec12 gradient, sum = Vec12::Zero();
    Mat12 hessian, numeric;
    dihedralAngle(x, &gradient, &hessian);
    const double h = 2e-4 * height;
    for (int i = 0; i < 12; ++i) {
      Vec12 column = Vec12::Zero();
      for (const auto& [offset, weight] :
           {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
        Vec12 moved = x, g;
        moved[i] += offset * h;
        const double angle = dihedralAngle(moved, &g);
        sum[i] += weight * angle / (12.0 * h);
        column += weight * g / (12.0 * h);
      }
      numeric.col(i) = column;
    }
    worst_gradient = std::max(worst_gradient, (sum - gradient).norm() / gradient.norm());
    worst_hessian = std::max(worst_hessian, (numeric - hessian).norm() / hessian.norm());
    EXPECT_EQ((hessian - hessian.transpose()).norm(), 0.0);
  }
  EXPECT_LE(worst_gradient, kDerivativeTolerance);
  EXPECT_LE(worst_hessian, kDerivativeTolerance);
  std::printf("  dihedral gradient %.1e, Hessian %.1e\n", worst_gradient, worst_hessian);
}

TEST(DihedralAngleTest, RigidMotionIsInItsNullSpace) {
  std::mt19937 engine(kSeed);
  const Vec12 x = turned(hinge(0.9, 0.5, 0.8), &engine);
  Vec12 gradient;
  Mat12 hessian;
  dihedralAngle(x, &gradient, &hessian);
  for (int axis = 0; axis < 3; ++axis) {
    Vec12 shift, turn;
    for (int i = 0; i < 4; ++i) {
      shift.segment<3>(3 * i) = Vec3::Unit(axis);
      turn.segment<3>(3 * i) = Vec3::Unit(axis).cross(Vec3(x.segment<3>(3 * i)));
    }
    EXPECT_NEAR(gradient.dot(shift), 0.0, 1e-13);
    EXPECT_NEAR(gradient.dot(turn), 0.0, 1e-13);
    EXPECT_LE((hessian * shift).norm(), 1e-13 * hessian.norm());
    // A turn rotates the gradient: H w(x) = w(g).
    Vec12 rotated;
    for (int i = 0; i < 4; ++i) {
      rotated.segment<3>(3 * i) = Vec3::Unit(axis).cross(Vec3(gradient.segment<3>(3 * i)));
    }
    EXPECT_LE((hessian * turn - rotated).norm(), 1e-13 * hessian.norm());
  }
}

TEST(DihedralAngleTest, DegenerateTrianglesGiveZero) {
  Vec12 x = hinge(0.5, 1.0, 1.0);
  x.segment<3>(6) = Vec3(0.0, 0.5, 0.0);
  Vec12 gradient = Vec12::Ones();
  Mat12 hessian = Mat12::Ones();
  EXPECT_EQ(dihedralAngle(x, &gradient, &hessian), 0.0);
  EXPECT_EQ(gradient.norm(), 0.0);
  EXPECT_EQ(hessian.norm(), 0.0);
  EXPECT_EQ(dihedralAngle(Vec12::Zero(), &gradient, &hessian), 0.0);
}

}  // namespace
}  // namespace tenter
