// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/mechanics/stiffness_curve.h"

namespace tenter::test_support {

struct NamedCurve {
  std::string name;
  StiffnessCurve curve;
};

/// Curves whose knots lie left of, right of, around and at strain 0, even ones and a single knot.
inline std::vector<NamedCurve> sampleCurves() {
  const auto make = [](std::vector<double> e, std::vector<double> k, std::vector<double> m,
                       bool even) { return StiffnessCurve::fromKnots(e, k, m, even).value(); };
  std::vector<double> many, values, slopes;
  for (int i = 0; i < 30; ++i) {
    many.push_back(-0.1 + 0.01 * i + 1e-4 * (i % 3));
    values.push_back(200.0 + 40.0 * (i % 4));
    slopes.push_back(500.0 * (i % 5 - 2));
  }
  return {
      {"constant", StiffnessCurve::constant(120.0)},
      {"around zero", make({-0.05, 0.03, 0.2}, {900, 300, 1500}, {-2000, 1000, 9000}, false)},
      {"from zero", make({0.0, 0.1, 0.25}, {50, 400, 380}, {10, 2000, -500}, false)},
      {"above zero", make({0.02, 0.1, 0.25}, {50, 400, 380}, {100, 2000, -500}, false)},
      {"below zero", make({-0.4, -0.2, -0.1}, {70, 30, 90}, {-100, 40, 800}, false)},
      {"up to zero", make({-0.4, -0.2, 0.0}, {70, 30, 90}, {-100, 40, 800}, false)},
      {"even", make({0.0, 30.0, 80.0}, {2e-5, 6e-6, 4e-6}, {0.0, -1e-7, 0.0}, true)},
      {"even constant", StiffnessCurve::constant(3e-6, true)},
      {"many knots", make(many, values, slopes, false)},
  };
}

}  // namespace tenter::test_support
