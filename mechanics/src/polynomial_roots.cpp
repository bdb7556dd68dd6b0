// SPDX-License-Identifier: GPL-3.0-or-later
#include "polynomial_roots.h"

#include <algorithm>
#include <cmath>

namespace tenter {

std::vector<double> quadraticRoots(double a, double b, double c, double from, double to) {
  std::vector<double> roots;
  const auto keep = [&](double t) {
    if (t > from && t < to) roots.push_back(t);  // Infinite and undefined ones fall out here.
  };
  const double discriminant = b * b - 4.0 * a * c;
  if (discriminant < 0.0) return roots;
  // The root that does not subtract, and the other from the product: small a does no harm.
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  keep(q / a);
  if (discriminant > 0.0) keep(c / q);
  std::sort(roots.begin(), roots.end());
  return roots;
}

std::vector<double> cubicRoots(const double (&p)[4], double from, double to) {
  const auto value = [&](double t) { return p[0] + t * (p[1] + t * (p[2] + t * p[3])); };
  std::vector<double> ends = quadraticRoots(3.0 * p[3], 2.0 * p[2], p[1], from, to);
  ends.insert(ends.begin(), from);
  ends.push_back(to);
  std::vector<double> roots;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    double low = ends[i], high = ends[i + 1];
    const double at_low = value(low), at_high = value(high);
    if (at_low == 0.0 || at_high == 0.0 || (at_low < 0.0) == (at_high < 0.0)) {
      if (at_high == 0.0 && i + 2 < ends.size()) roots.push_back(high);
      continue;
    }
    // Monotone between its stationary points, so bisection cannot miss.
    while (true) {
      const double middle = 0.5 * (low + high);
      if (!(middle > low && middle < high)) break;
      ((value(middle) < 0.0) == (at_low < 0.0) ? low : high) = middle;
    }
    roots.push_back(high);
  }
  return roots;
}

}  // namespace tenter
