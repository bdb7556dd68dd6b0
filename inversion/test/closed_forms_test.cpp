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

/// Smallest eigenvalue of the certificate for an upright sheet of height 1 above its clamp.
double uprightLambda(int rows, double gamma) {
  constexpr double kB = 1e-3;
  const double edge_m = 1.0 / (rows - 1);
  const TriangleMesh flat = strip(rows + 1, 3, 1.0 + edge_m, 4.0 * edge_m);
  TriangleMesh mesh = flat;
  for (int v = 0; v < mesh.vertexCount(); ++v)
    mesh.positions.col(v) = Vec3(0.0, flat.positions(1, v), flat.positions(0, v) - edge_m);
  const ClothModel* model = findClothModel("stvk").value();
  std::vector<ComponentCurve> curves;
  for (int i = 0; i < model->componentCount(); ++i) {
    const bool bending = model->component(i).stiffness_unit == "N m";
    ComponentCurve c;
    c.curve = StiffnessCurve::constant(bending ? kB : 1e4, model->component(i).even);
    curves.push_back(std::move(c));
  }
  const double density = gamma * kB / kStandardGravity_m_per_s2;
  const InverseShell shell =
      InverseShell::create(mesh, {model, makeLaws(*model, curves), density, kDefaultGravity})
          .value();
  std::vector<int> fixed;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 2; ++column) fixed.push_back((rows + 1) * row + column);
  const ClothSystem system = shell.system(mesh.positions, fixed).value();
  ClothState state = system.restState();
  EquilibriumOptions options;
  options.leave_saddles = false;
  const EquilibriumSummary summary = EquilibriumSolver(system).solve(state, options);
  EXPECT_TRUE(summary.converged());
  const Points3 pose = state.positions(mesh.vertexCount());
  EXPECT_NEAR(pose.row(0).cwiseAbs().maxCoeff(), 0.0, 1e-9) << "it stands upright";
  CertificateOptions certificate;
  certificate.redrapes = 0;
  const Certificate c = certify(shell, pose, mesh.positions, state.q.tail(shell.rotationCount()),
                                fixed, {}, certificate)
                            .value();
  EXPECT_EQ(c.negative_eigenvalues > 0, c.lambda_min_per_s2 < 0.0);
  return c.lambda_min_per_s2;
}

TEST(ClosedFormsTest, PrintCritical) {
  for (const int rows : {11, 21, 41}) {
    double low = 5.0, high = 10.0;
    for (int k = 0; k < 14; ++k) {
      const double mid = 0.5 * (low + high);
      (uprightLambda(rows, mid) > 0.0 ? low : high) = mid;
    }
    const double h = 1.0 / (rows - 1);
    std::printf("rows %d critical %.5f, with half edge %.5f\n", rows, low,
                low * std::pow(1.0 + 0.5 * h, 3));
  }
}

}  // namespace
}  // namespace tenter
