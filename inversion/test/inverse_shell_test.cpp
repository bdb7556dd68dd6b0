// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inverse_shell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>

#include "shell_samples.h"

namespace tenter {
namespace {

using test::bentTarget;
using test::shellMaterial;

constexpr double kStep = 1e-6;  ///< [m], of meshes a few decimetres wide.
/// Central differences at that step: truncation and rounding both stay under a tenth of this.
constexpr double kTolerance = 1e-6;

class InverseShellTest : public ::testing::TestWithParam<std::string> {
 protected:
  InverseShellTest() : random_(20260102) {
    target_ = bentTarget(6, 5);
    shell_.emplace(InverseShell::create(target_, shellMaterial(GetParam())).value());
    rest_ = target_.positions;
    jitter(rest_, 0.004);
    q_ = shell_->coordinates(target_.positions, Eigen::VectorXd::Zero(shell_->rotationCount()));
    for (Eigen::Index i = 3 * shell_->vertexCount(); i < q_.size(); ++i) q_[i] = uniform(0.002);
  }
  double uniform(double amplitude) {
    return amplitude * (2.0 * static_cast<double>(random_()) / 4294967295.0 - 1.0);
  }
  template <class Matrix>
  void jitter(Matrix& m, double amplitude) {
    for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] += uniform(amplitude);
  }

  std::mt19937 random_;
  TriangleMesh target_;
  std::optional<InverseShell> shell_;
  Points3 rest_;
  Eigen::VectorXd q_;
};

TEST_P(InverseShellTest, GradientIsThatOfTheForwardProblem) {
  const auto system = shell_->system(rest_, {0});
  ASSERT_TRUE(system.ok()) << system.error().message();
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(system->coordinateCount());
  ASSERT_EQ(expected.size(), q_.size());
  for (const auto& term : system->terms()) term->addGradient(q_, expected);
  Eigen::VectorXd gradient;
  shell_->gradient(q_, rest_, gradient);
  EXPECT_GT(expected.norm(), 0.0);
  EXPECT_LE((gradient - expected).norm(), 1e-12 * expected.norm());
}

TEST_P(InverseShellTest, DerivativeByRestPositionsAgreesWithDifferences) {
  const Eigen::MatrixXd exact = shell_->gradientByRest(q_, rest_);
  Eigen::VectorXd plus, minus;
  double worst = 0.0;
  for (int c = 0; c < shell_->coordinateCount(); ++c) {
    Points3 rest = rest_;
    Eigen::VectorXd q = q_;
    double& moved = c < 3 * shell_->vertexCount() ? rest.data()[c] : q[c];
    const double centre = moved;
    moved = centre + kStep;
    shell_->gradient(q, rest, plus);
    moved = centre - kStep;
    shell_->gradient(q, rest, minus);
    const Eigen::VectorXd difference = (plus - minus) / (2.0 * kStep);
    worst = std::max(worst, (difference - exact.col(c)).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(worst, kTolerance * exact.cwiseAbs().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(Models, InverseShellTest,
                         ::testing::Values("edge-hinge", "soft", "stvk", "stvk-coupled"),
                         [](const auto& p) {
                           std::string name = p.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace tenter
