// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "tenter/twin/specimen_law.h"

namespace tenter {

SpecimenBendingLaw::SpecimenBendingLaw(const BendingConstants& constants)
    : c_(constants), coupling_(c_.poisson * std::sqrt(c_.rigidity_N_m[0] * c_.rigidity_N_m[1])) {
  require(c_.rigidity_N_m.minCoeff() > 0.0 && c_.knee_per_m > 0.0 && c_.floor > 0.0 &&
              c_.floor <= 1.0 && std::abs(c_.poisson) < c_.floor,
          "SpecimenBendingLaw: rigidity must stay positive");
}

LawValue SpecimenBendingLaw::evaluate(const Vec3& strain, int /*element*/) const {
  LawValue out;
  const double knee = c_.knee_per_m, soft = 1.0 - c_.floor;
  for (int i = 0; i < 3; ++i) {
    const double b = c_.rigidity_N_m[i], x = strain[i] / knee;
    const double root = std::sqrt(1.0 + x * x);
    // sqrt(1 + x^2) - 1 without loss of digits for small x.
    const double rise = x * x / (root + 1.0);
    out.energy += b * (0.5 * c_.floor * strain[i] * strain[i] + soft * knee * knee * rise);
    out.stress[i] = b * strain[i] * (c_.floor + soft / root);
    out.tangent(i, i) = b * (c_.floor + soft / (root * root * root));
  }
  out.energy += coupling_ * strain[0] * strain[1];
  out.stress[0] += coupling_ * strain[1];
  out.stress[1] += coupling_ * strain[0];
  out.tangent(0, 1) = out.tangent(1, 0) = coupling_;
  return out;
}

}  // namespace tenter
