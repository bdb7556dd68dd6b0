// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <string>

#include "tenter/inversion/inverse_shell.h"

namespace tenter::test {

/// A material of each model: curves where the model takes them, couplings where it has them.
inline ShellMaterial shellMaterial(const std::string& law, double factor = 1.0) {
  const ClothModel* model = findClothModel(law).value();
  std::vector<ComponentCurve> curves;
  for (int i = 0; i < model->componentCount(); ++i) {
    const ComponentInfo& info = model->component(i);
    const bool bending = info.stiffness_unit == "N m";
    const double k = factor * (bending ? 2e-4 : 40.0) * (1.0 + 0.2 * i);
    const double end = bending ? 40.0 : 0.3;
    ComponentCurve c;
    if (info.constant_only) {
      c.curve = StiffnessCurve::constant(info.may_be_negative ? 0.1 * k : k);
    } else if (info.even) {
      c.curve = StiffnessCurve::fromKnots({0.0, end}, {k, 1.5 * k}, {0.0, k / end}, true).value();
    } else {
      c.curve =
          StiffnessCurve::fromKnots({-end, 0.0, end}, {0.8 * k, k, 1.6 * k}, {0.0, 0.2 * k, k})
              .value();
    }
    curves.push_back(std::move(c));
  }
  ShellMaterial material;
  material.model = model;
  material.laws = makeLaws(*model, curves);
  material.areal_density_kg_per_m2 = 0.2;
  return material;
}

/// A barrel-shaped piece of shell with uv, columns x rows vertices, 4 cm apart.
inline TriangleMesh bentTarget(int columns, int rows) {
  TriangleMesh mesh;
  mesh.positions.resize(3, columns * rows);
  mesh.uv.resize(2, columns * rows);
  constexpr double kEdge_m = 0.04, kRadius_m = 0.3;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double u = kEdge_m * i + 0.003 * std::sin(5.0 * j), v = kEdge_m * j;
      const double a = u / kRadius_m, r = kRadius_m + 0.5 * v * v;
      mesh.positions.col(j * columns + i) = Vec3(r * std::sin(a), v, r * std::cos(a));
      mesh.uv.col(j * columns + i) = Vec2(u, v);
    }
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const int a = j * columns + i, b = a + 1, c = a + columns, d = c + 1;
      if ((i + j) % 2 == 0) {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, c});
      } else {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({b, d, c});
      }
    }
  }
  return mesh;
}

}  // namespace tenter::test
