// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "shell_samples.h"
#include "tenter/inversion/certificate.h"
#include "tenter/mechanics/equilibrium.h"

namespace tenter {
namespace {

/// A strip of columns x rows vertices in the plane y = 0 or z = 0, `length_m` along its columns.
TriangleMesh strip(int columns, int rows, double length_m, double width_m) {
  TriangleMesh mesh = test::bentTarget(columns, rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int v = j * columns + i;
      mesh.uv.col(v) = Vec2(length_m * i / (columns - 1), width_m * j / (rows - 1));
      mesh.positions.col(v) = Vec3(mesh.uv(0, v), mesh.uv(1, v), 0.0);
    }
  }
  return mesh;
}

/// A strip that cannot stretch and does not resist bending, hung at its ends.
TEST(ClosedFormsTest, AStripWithoutBendingHangsAsACatenary) {
  constexpr int kColumns = 61;
  constexpr double kSpan_m = 0.8;
  const TriangleMesh mesh = strip(kColumns, 2, 1.0, 0.03);
  const ClothModel* model = findClothModel("edge-hinge").value();
  std::vector<ComponentCurve> curves(2);
  curves[0].curve = StiffnessCurve::constant(1e3);
  curves[1].curve = StiffnessCurve::constant(0.0);
  const InverseShell shell =
      InverseShell::create(mesh, {model, makeLaws(*model, curves), 0.1, kDefaultGravity}).value();
  const std::vector<int> fixed{0, kColumns - 1, kColumns, 2 * kColumns - 1};
  const ClothSystem system = shell.system(mesh.positions, fixed).value();
  ClothState state = system.restState();
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    const double s = 2.0 * mesh.uv(0, v) - 1.0;
    state.q.segment<3>(3 * v) = Vec3(0.5 * kSpan_m * s, mesh.uv(1, v), 0.3 * (s * s - 1.0));
  }
  const EquilibriumSummary summary = EquilibriumSolver(system).solve(state);
  ASSERT_TRUE(summary.converged()) << describe(summary.termination);
  double a = 0.5 * kSpan_m;  // of 2 a sinh(span / 2a) = 1
  for (int k = 0; k < 200; ++k) a *= std::sqrt(2.0 * a * std::sinh(kSpan_m / (2.0 * a)));
  ASSERT_NEAR(2.0 * a * std::sinh(kSpan_m / (2.0 * a)), 1.0, 1e-9);
  const double sag = a * (std::cosh(kSpan_m / (2.0 * a)) - 1.0);
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    const Vec3 x = state.q.segment<3>(3 * v);
    EXPECT_NEAR(x[2], a * std::cosh(x[0] / a) - a - sag, 5e-3 * sag) << v;
  }
}

/// Gamma = rho g L^3 / B at which an upright sheet buckles under its own weight [Greenhill81].
constexpr double kGreenhill = 7.8373;
constexpr double kB_Nm = 1e-3;

/// An upright sheet of height 1 above its clamp: two rows of vertices, the upper at height 0.
struct Upright {
  TriangleMesh mesh;
  std::vector<int> fixed;
  ShellMaterial material;

  Upright(int rows, double gamma) {
    const double edge_m = 1.0 / (rows - 1);
    mesh = strip(rows + 1, 3, 1.0 + edge_m, 4.0 * edge_m);
    for (int v = 0; v < mesh.vertexCount(); ++v)
      mesh.positions.col(v) = Vec3(0.0, mesh.uv(1, v), mesh.uv(0, v) - edge_m);
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 2; ++column) fixed.push_back((rows + 1) * row + column);
    const ClothModel* model = findClothModel("stvk").value();
    std::vector<ComponentCurve> curves;
    for (int i = 0; i < model->componentCount(); ++i) {
      const bool bending = model->component(i).stiffness_unit == "N m";
      ComponentCurve c;
      c.curve = StiffnessCurve::constant(bending ? kB_Nm : 1e4, model->component(i).even);
      curves.push_back(std::move(c));
    }
    material = {model, makeLaws(*model, curves), gamma * kB_Nm / kStandardGravity_m_per_s2,
                kDefaultGravity};
  }
};

/// The upright equilibrium, stable or not.
EquilibriumSummary standUpright(const ClothSystem& system, ClothState& state) {
  EquilibriumOptions options;
  options.leave_saddles = false;
  options.compute_lambda_min = true;
  const EquilibriumSummary summary = EquilibriumSolver(system).solve(state, options);
  EXPECT_TRUE(summary.converged());
  const auto count = static_cast<int>(system.sheet().nodeCount());
  EXPECT_NEAR(state.positions(count).row(0).cwiseAbs().maxCoeff(), 0.0, 1e-9);
  return summary;
}

/// Smallest eigenvalue as the certificate has it.
double certifiedLambda(int rows, double gamma) {
  const Upright sheet(rows, gamma);
  const InverseShell shell = InverseShell::create(sheet.mesh, sheet.material).value();
  const ClothSystem system = shell.system(sheet.mesh.positions, sheet.fixed).value();
  ClothState state = system.restState();
  standUpright(system, state);
  CertificateOptions options;
  options.redrapes = 0;
  const Certificate c =
      certify(shell, state.positions(sheet.mesh.vertexCount()), sheet.mesh.positions,
              state.q.tail(shell.rotationCount()), sheet.fixed, {}, options)
          .value();
  EXPECT_EQ(c.negative_eigenvalues > 0, c.lambda_min_per_s2 < 0.0);
  EXPECT_EQ(c.stable(), c.lambda_min_per_s2 > 0.0);
  return c.lambda_min_per_s2;
}

double criticalGamma(int rows) {
  double low = 5.0, high = 10.0;
  while (high - low > 1e-3) {
    const double middle = 0.5 * (low + high);
    (certifiedLambda(rows, middle) > 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// For the certificate no triangle is rigid, so the clamp line is as soft as any other: the sheet
/// buckles as if it were longer by a share of an edge, an error of first order.
TEST(ClosedFormsTest, TheCertificateChangesSignWhereAnUprightSheetBuckles) {
  const double g10 = criticalGamma(11), g20 = criticalGamma(21), g40 = criticalGamma(41);
  const double first = 2.0 * g40 - g20, coarser = 2.0 * g20 - g10;
  EXPECT_NEAR(first, kGreenhill, 0.005 * kGreenhill) << "first order taken out";
  EXPECT_NEAR((4.0 * first - coarser) / 3.0, kGreenhill, 0.002 * kGreenhill) << "second too";
  EXPECT_NEAR(g40, kGreenhill, 0.06 * kGreenhill);
}

/// The clamp line of the mechanics is stiff: half a hinge.
TEST(ClosedFormsTest, TheSmallestEigenvalueChangesSignWithinAPercent) {
  for (const double gamma : {0.99 * kGreenhill, 1.01 * kGreenhill}) {
    const Upright sheet(21, gamma);
    SystemSetup setup;
    setup.areal_density_kg_per_m2 = sheet.material.areal_density_kg_per_m2;
    setup.fixed_nodes = sheet.fixed;
    const ClothSystem system =
        ClothSystem::create(sheetFromMesh(sheet.mesh, false).value(), *sheet.material.model,
                            sheet.material.laws, setup)
            .value();
    ClothState state = system.restState();
    const EquilibriumSummary summary = standUpright(system, state);
    EXPECT_EQ(summary.lambda_min_per_s2 > 0.0, gamma < kGreenhill) << gamma;
    EXPECT_EQ(summary.stable, gamma < kGreenhill) << gamma;
  }
}

}  // namespace
}  // namespace tenter
