// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/fit_test.h"

namespace tenter {

int ParameterSet::size() const { return offset(static_cast<int>(components.size())); }

int ParameterSet::offset(int component) const {
  int count = 0;
  for (int i = 0; i < component; ++i)
    if (components[i].basis) count += components[i].basis->size();
  return count;
}

Eigen::VectorXd ParameterSet::coefficients() const {
  Eigen::VectorXd all(size());
  int begin = 0;
  for (const ComponentCurve& component : components) {
    if (!component.basis) continue;
    const int count = component.basis->size();
    all.segment(begin, count) = component.basis->coefficientsOf(component.curve);
    begin += count;
  }
  return all;
}

void ParameterSet::setCoefficients(const Eigen::VectorXd& coefficients) {
  require(coefficients.size() == size(), "a parameter set takes as many coefficients as it has");
  int begin = 0;
  for (ComponentCurve& component : components) {
    if (!component.basis) continue;
    const int count = component.basis->size();
    component.curve = component.basis->curve(coefficients.segment(begin, count));
    begin += count;
  }
}

}  // namespace tenter
