// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "axial_term.h"
#include "tenter/mechanics/energy_terms.h"

namespace tenter {
namespace {

/// Area of quad (i, j), 0 outside the grid.
double quadArea(const GridLines& g, int i, int j) {
  if (i < 0 || j < 0) return 0.0;
  if (i + 1 >= static_cast<int>(g.u_lines.size()) || j + 1 >= static_cast<int>(g.v_lines.size())) {
    return 0.0;
  }
  return (g.u_lines[i + 1] - g.u_lines[i]) * (g.v_lines[j + 1] - g.v_lines[j]);
}

/// Area that touches the straight line of `ring` cells from node (i, j) on; du, dv in -1, 0, 1.
double touchedArea(const GridLines& g, int i, int j, int du, int dv, int ring) {
  double area = 0.0;
  for (int k = 0; k < ring; ++k) {
    if (dv == 0) {
      area += quadArea(g, i + k, j) + quadArea(g, i + k, j - 1);
    } else if (du == 0) {
      area += quadArea(g, i, j + k) + quadArea(g, i - 1, j + k);
    } else {
      area += quadArea(g, du > 0 ? i + k : i - k - 1, j + k);
    }
  }
  return area;
}

std::vector<AxialElement> gridSprings(const SheetMesh& sheet, int ring) {
  require(sheet.grid.has_value(), "springs need a sheet that is a grid");
  const GridLines& g = *sheet.grid;
  const int nu = static_cast<int>(g.u_lines.size()), nv = static_cast<int>(g.v_lines.size());
  const double share = ring == 1 ? 0.5 : 0.25;
  struct Direction {
    int du, dv, component;
  };
  constexpr Direction kDirections[] = {{1, 0, 0}, {0, 1, 1}, {1, 1, 2}, {-1, 1, 2}};
  std::vector<AxialElement> springs;
  for (const Direction& d : kDirections) {
    for (int j = 0; j + ring * d.dv < nv; ++j) {
      for (int i = 0; i < nu; ++i) {
        const int i_end = i + ring * d.du;
        if (i_end < 0 || i_end >= nu) continue;
        const int a = g.node(i, j), b = g.node(i_end, j + ring * d.dv);
        const double length = (sheet.rest.positions.col(b) - sheet.rest.positions.col(a)).norm();
        springs.push_back(
            {a, b, d.component, length, share * touchedArea(g, i, j, d.du, d.dv, ring)});
      }
    }
  }
  return springs;
}

}  // namespace

std::unique_ptr<EnergyTerm> makeRing1SpringTerm(const SheetMesh& sheet,
                                                std::shared_ptr<const StrainLaw> law) {
  return makeAxialTerm(gridSprings(sheet, 1), std::move(law));
}

std::unique_ptr<EnergyTerm> makeRing2SpringTerm(const SheetMesh& sheet,
                                                std::shared_ptr<const StrainLaw> law) {
  return makeAxialTerm(gridSprings(sheet, 2), std::move(law));
}

}  // namespace tenter
