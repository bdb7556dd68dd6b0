// SPDX-License-Identifier: GPL-3.0-or-later
// A strip clamped horizontally and bent by its own weight, against the exact heavy elastica.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tenter/core/files.h"
#include "tenter/mechanics/equilibrium.h"
#include "tenter/test_support/data.h"

namespace tenter {
namespace {

constexpr double kLength_m = 0.1;
constexpr double kAreal_kg_per_m2 = 0.2;

struct Tip {
  double reach, drop;  ///< Over the length.
};

/// Inextensible heavy elastica, Gamma = w L^3 / B: theta'' = -Gamma (1 - s) cos(theta), theta(0) =
/// 0, theta'(1) = 0, s and theta along the strip, theta below the horizontal. Shooting on theta'(0)
/// by bisection, classical Runge-Kutta.
Tip heavyElastica(double gamma) {
  constexpr int kSteps = 4000;
  const auto integrate = [&](double slope, Tip* tip) {
    const double h = 1.0 / kSteps;
    double theta = 0.0, x = 0.0, y = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      const double s = i * h;
      const auto f = [&](double at, double th) { return -gamma * (1.0 - at) * std::cos(th); };
      const double k1 = slope, l1 = f(s, theta);
      const double k2 = slope + h / 2 * l1, l2 = f(s + h / 2, theta + h / 2 * k1);
      const double k3 = slope + h / 2 * l2, l3 = f(s + h / 2, theta + h / 2 * k2);
      const double k4 = slope + h * l3, l4 = f(s + h, theta + h * k3);
      const double next = theta + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      x += h / 6 * (std::cos(theta) + 4 * std::cos((theta + next) / 2) + std::cos(next));
      y += h / 6 * (std::sin(theta) + 4 * std::sin((theta + next) / 2) + std::sin(next));
      slope += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
      theta = next;
    }
    if (tip) *tip = {x, y};
    return slope;
  };
  double low = 0.0, high = gamma + 1.0;
  for (int k = 0; k < 200; ++k) {
    const double mid = 0.5 * (low + high);
    (integrate(mid, nullptr) > 0.0 ? high : low) = mid;
  }
  Tip tip{};
  integrate(low, &tip);
  return tip;
}

/// A strip along u with one row of triangles behind the clamp line u = 0.
SheetMesh gridStrip(int nodes, double width, DiagonalPattern diagonals) {
  const double h = kLength_m / (nodes - 1);
  GridLines lines;
  for (int i = -1; i < nodes; ++i) lines.u_lines.push_back(i * h);
  const int across = std::max(2, static_cast<int>(std::lround(width / h)));
  for (int j = 0; j <= across; ++j) lines.v_lines.push_back(width * j / across);
  lines.diagonals = diagonals;
  return gridSheet(lines);
}

SheetMesh unstructuredStrip(int nodes, double width, std::uint64_t seed) {
  const double h = kLength_m / (nodes - 1);
  TriangleMesh mesh = unstructuredSheet({kLength_m, width}, h, seed).rest;
  std::map<double, int> line;  // nodes on the clamp line by v
  for (int n = 0; n < mesh.vertexCount(); ++n) {
    if (std::abs(mesh.positions(0, n)) < 1e-9) line[mesh.positions(1, n)] = n;
  }
  std::vector<std::pair<int, int>> pairs;  // node on the line, node behind it
  int next = mesh.vertexCount();
  mesh.positions.conservativeResize(3, next + static_cast<int>(line.size()));
  for (const auto& [v, node] : line) {
    mesh.positions.col(next) = Vec3(-h, v, 0.0);
    pairs.emplace_back(node, next++);
  }
  for (std::size_t k = 0; k + 1 < pairs.size(); ++k) {
    mesh.triangles.push_back({pairs[k].second, pairs[k].first, pairs[k + 1].first});
    mesh.triangles.push_back({pairs[k].second, pairs[k + 1].first, pairs[k + 1].second});
  }
  mesh.uv = mesh.positions.topRows<2>();
  auto sheet = sheetFromMesh(mesh, false);
  if (!sheet) throw std::runtime_error(sheet.error().message());
  return std::move(*sheet);
}

struct Hanging {
  Tip tip;
  EquilibriumSummary summary;
};

Hanging hang(SheetMesh sheet, double gamma) {
  const double b = kAreal_kg_per_m2 * kStandardGravity_m_per_s2 * std::pow(kLength_m, 3) / gamma;
  const ClothModel& model = **findClothModel("stvk");
  // Stretch so stiff that the strip's own weight lengthens it by 2e-4 at most; isotropic bending is
  // B, B, B/2.
  std::vector<ComponentCurve> components;
  for (double k : {1e3, 1e3, 5e2, b, b, b / 2}) {
    const bool even = components.size() >= 2;
    components.push_back({StiffnessCurve::constant(k, even), nullptr});
  }
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = kAreal_kg_per_m2;
  setup.clips.resize(1);
  for (int n = 0; n < sheet.nodeCount(); ++n) {
    if (sheet.rest.positions(0, n) < 1e-9) setup.clips[0].nodes.push_back(n);
  }
  auto system = ClothSystem::create(std::move(sheet), model, makeLaws(model, components), setup);
  if (!system) throw std::runtime_error(system.error().message());
  ClothState state = system->restState();
  EquilibriumSolver solver(*system);
  EquilibriumOptions options;
  options.max_iterations = 2000;
  Hanging result;
  result.summary = solver.solve(state, options);
  int count = 0;
  Vec3 tip = Vec3::Zero();
  for (int n = 0; n < system->sheet().nodeCount(); ++n) {
    if (system->sheet().rest.positions(0, n) < kLength_m - 1e-9) continue;
    tip += Vec3(state.q.segment<3>(3 * n));
    ++count;
  }
  tip /= count * kLength_m;
  result.tip = {tip.x(), -tip.z()};
  return result;
}

enum class Mesh { kUniform, kAlternating, kUnstructured };

SheetMesh strip(Mesh mesh, int nodes) {
  const double width = 0.03;
  switch (mesh) {
    case Mesh::kUniform:
      return gridStrip(nodes, width, DiagonalPattern::kUniform);
    case Mesh::kAlternating:
      return gridStrip(nodes, width, DiagonalPattern::kAlternating);
    case Mesh::kUnstructured:
      return unstructuredStrip(nodes, width, 5);
  }
  return {};
}

class CantileverTest : public testing::TestWithParam<Mesh> {};

TEST_P(CantileverTest, ReachAndDropMatchTheHeavyElasticaWithinOnePercent) {
  for (double gamma : {1.0, 3.0, 8.0, 10.0, 30.0, 100.0}) {
    const Tip exact = heavyElastica(gamma);
    const Hanging h = hang(strip(GetParam(), 25), gamma);
    ASSERT_TRUE(h.summary.converged())
        << "Gamma " << gamma << ": " << describe(h.summary.termination);
    EXPECT_TRUE(h.summary.stable) << "Gamma " << gamma;
    const double reach = h.tip.reach / exact.reach - 1.0, drop = h.tip.drop / exact.drop - 1.0;
    std::printf("Gamma %5.0f  reach %+.3f %%  drop %+.3f %%  %d steps %d factorizations %.2f s\n",
                gamma, 100 * reach, 100 * drop, h.summary.newton_steps, h.summary.factorizations,
                h.summary.seconds);
    EXPECT_LE(std::abs(reach), 0.01) << "Gamma " << gamma;
    EXPECT_LE(std::abs(drop), 0.01) << "Gamma " << gamma;
  }
}

TEST_P(CantileverTest, ErrorFallsWithRefinement) {
  const double gamma = 30.0;
  const Tip exact = heavyElastica(gamma);
  double previous = 1.0;
  for (int nodes : {13, 25, 49}) {
    const Hanging h = hang(strip(GetParam(), nodes), gamma);
    ASSERT_TRUE(h.summary.converged());
    const double error = std::hypot(h.tip.reach - exact.reach, h.tip.drop - exact.drop);
    std::printf("%d nodes: tip error %.5f of the length\n", nodes, error);
    EXPECT_LT(error, previous) << nodes << " nodes";
    previous = error;
  }
}

std::string meshName(const testing::TestParamInfo<Mesh>& mesh) {
  constexpr const char* kNames[] = {"uniform", "alternating", "unstructured"};
  return kNames[static_cast<int>(mesh.param)];
}

INSTANTIATE_TEST_SUITE_P(Meshes, CantileverTest,
                         testing::Values(Mesh::kUniform, Mesh::kAlternating, Mesh::kUnstructured),
                         meshName);

TEST(HeavyElastica, AgreesWithThePublishedTable) {
  const auto file = test_support::findData("bending/heavy-elastica.csv");
  if (!file) GTEST_SKIP() << test_support::noData();
  const auto table = readNumericTable(*file, 6);
  ASSERT_TRUE(table.ok()) << table.error().message();
  for (const auto& row : table->rowwise()) {
    const Tip exact = heavyElastica(row[0]);
    EXPECT_NEAR(exact.reach, row[1], 2e-6);
    EXPECT_NEAR(exact.drop, row[2], 2e-6);
  }
}

}  // namespace
}  // namespace tenter
