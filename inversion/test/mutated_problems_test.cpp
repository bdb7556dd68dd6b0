// SPDX-License-Identifier: GPL-3.0-or-later
// Broken and unusual problems: refused with a reason, solved, or given up in time. The number of
// problems is raised by the environment variable TENTER_MUTATIONS.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

#include "shell_samples.h"
#include "tenter/inversion/feasible_range.h"

namespace tenter {
namespace {

constexpr unsigned kSeed = 20260119;
constexpr double kBudget_s = 1.0;
/// Beside a tenth of the budget: one step of the solver on a machine that does other things too.
constexpr double kSlack_s = 0.5;
constexpr double kEdge_m = 0.04;  ///< Of test::bentTarget.

int problemCount() {
  const char* text = std::getenv("TENTER_MUTATIONS");
  return text != nullptr ? std::max(30, std::atoi(text)) : 30;
}

/// A bent piece of shell whose lowest row is held and whose rows hang below each other.
InversionProblem hanging(const std::string& law, double factor) {
  InversionProblem problem;
  problem.target = test::bentTarget(6, 6);
  const Points3 x = problem.target.positions;
  problem.target.positions.row(1) = x.row(2);
  problem.target.positions.row(2) = -x.row(1);
  for (int v = 0; v < 6; ++v) problem.fixed.push_back(v);
  problem.material = test::shellMaterial(law, factor);
  return problem;
}

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967295.0;
  }
  int below(std::size_t count) { return static_cast<int>(random_() % count); }

  /// Changes that leave a problem that has a solution.
  InversionProblem gentle() {
    constexpr std::array kLaws{"soft", "stvk", "stvk-coupled", "edge-hinge"};
    InversionProblem p = hanging(kLaws[static_cast<std::size_t>(below(4))], uniform(0.5, 4.0));
    for (double& c : p.target.positions.reshaped()) c += 0.03 * kEdge_m * uniform(-1.0, 1.0);
    return p;
  }

  /// Anything.
  InversionProblem harsh() {
    InversionProblem p = gentle();
    auto& x = p.target.positions;
    auto& triangles = p.target.triangles;
    const auto v = static_cast<Eigen::Index>(below(static_cast<std::size_t>(x.cols())));
    auto& triangle = triangles[static_cast<std::size_t>(below(triangles.size()))];
    switch (below(12)) {
      case 0:
        x.col(v) += 3.0 * kEdge_m * Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        break;
      case 1:
        std::swap(triangle[0], triangle[1]);
        break;
      case 2:
        triangles.erase(triangles.begin() + below(triangles.size()));
        break;
      case 3:
        x(below(3), v) = std::numeric_limits<double>::quiet_NaN();
        break;
      case 4:
        x.col(v) = x.col((v + 1) % x.cols());
        break;
      case 5:
        triangle[static_cast<std::size_t>(below(3))] = below(100) - 20;
        break;
      case 6:
        x *= std::pow(10.0, uniform(-6.0, 6.0));
        break;
      case 7:
        p.material = scaled(p.material, std::pow(10.0, uniform(-8.0, 8.0)));
        break;
      case 8:
        for (double& c : x.reshaped()) c += kEdge_m * uniform(-0.7, 0.7);
        break;
      case 9:
        p.fixed.resize(static_cast<std::size_t>(below(3)));
        break;
      case 10:
        p.target.uv.col(v) = p.target.uv.col((v + 7) % x.cols());
        break;
      default:
        p.contacts.push_back({10 + below(20), Vec3::Unit(below(3)), uniform(0.0, 1.0), 0.0, 0});
    }
    return p;
  }

 private:
  std::mt19937 random_;
};

/// Whether it was certified.
bool expectAnswer(const InversionProblem& problem) {
  InversionOptions options;
  options.time_budget_s = kBudget_s;
  const auto start = std::chrono::steady_clock::now();
  const auto result = invert(problem, options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_LE(took.count(), 1.1 * kBudget_s + kSlack_s);
  if (!result) {
    EXPECT_FALSE(result.error().reason.empty());
    return false;
  }
  EXPECT_TRUE(result->rest.allFinite());
  EXPECT_TRUE(result->contact_forces.allFinite());
  EXPECT_TRUE(std::isfinite(result->certificate.force_residual_rel));
  const bool certified = result->status == InversionStatus::kCertified;
  EXPECT_EQ(certified, result->certificate.holds());
  EXPECT_EQ(certified, result->reason.empty());
  return certified;
}

TEST(MutatedProblemsTest, AreRefusedSolvedOrGivenUpInTime) {
  Mutator mutator(kSeed);
  for (int k = 0; k < problemCount(); ++k) {
    SCOPED_TRACE("problem " + std::to_string(k));
    expectAnswer(mutator.harsh());
  }
}

TEST(MutatedProblemsTest, NineOfTenThatHaveASolutionAreSolved) {
  Mutator mutator(kSeed + 1);
  int solved = 0;
  for (int k = 0; k < problemCount(); ++k) {
    SCOPED_TRACE("problem " + std::to_string(k));
    solved += expectAnswer(mutator.gentle()) ? 1 : 0;
  }
  EXPECT_GE(solved, 0.9 * problemCount());
}

}  // namespace
}  // namespace tenter
