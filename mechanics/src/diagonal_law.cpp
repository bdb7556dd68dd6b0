// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "tenter/mechanics/strain_law.h"

namespace tenter {

void StrainLaw::stressByParameter(const Vec3& /*strain*/,
                                  Eigen::Ref<Eigen::Matrix3Xd> derivative) const {
  derivative.setZero();
}

DiagonalLaw::DiagonalLaw(std::array<StiffnessCurve, 3> curves) : curves_(std::move(curves)) {}

DiagonalLaw::DiagonalLaw(std::array<StiffnessCurve, 3> curves,
                         std::array<std::shared_ptr<const SplineBasis>, 3> bases)
    : curves_(std::move(curves)), bases_(std::move(bases)) {}

LawValue DiagonalLaw::evaluate(const Vec3& strain, int /*element*/) const {
  LawValue law;
  for (int i = 0; i < 3; ++i) {
    const CurveValue curve = curves_[i].evaluate(strain[i]);
    law.energy += curve.energy;
    law.stress[i] = curve.stress;
    law.tangent(i, i) = curve.tangent;
  }
  return law;
}

int DiagonalLaw::parameterCount() const {
  int count = 0;
  for (const auto& basis : bases_) count += basis ? basis->size() : 0;
  return count;
}

void DiagonalLaw::stressByParameter(const Vec3& strain,
                                    Eigen::Ref<Eigen::Matrix3Xd> derivative) const {
  derivative.setZero();
  int column = 0;
  for (int i = 0; i < 3; ++i) {
    if (!bases_[i]) continue;
    const SplineBasis::Local part = bases_[i]->local(strain[i]);
    for (int j = 0; j < part.count; ++j)
      derivative(i, column + part.first + j) = part.values[j] * strain[i];
    column += bases_[i]->size();
  }
}

}  // namespace tenter
