// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>

#include "tenter/mechanics/strain_law.h"

namespace tenter {
namespace {

/// Strain over which the positive part turns from 0 to s.
constexpr double kRounding = 1e-3;

struct PositivePart {
  double value, first, second;
};

PositivePart positivePart(double s) {
  const double r = std::sqrt(s * s + kRounding * kRounding);
  // For s < 0 the sum would cancel; the product of both roots is d^2 / 4.
  const double value = s >= 0.0 ? 0.5 * (s + r) : 0.5 * kRounding * kRounding / (r - s);
  return {value, value / r, 0.5 * kRounding * kRounding / (r * r * r)};
}

}  // namespace

CoupledLaw::CoupledLaw(DiagonalLaw diagonal, double poisson_N_per_m,
                       double cross_stiffening_N_per_m, bool poisson_free, bool cross_free)
    : diagonal_(std::move(diagonal)),
      poisson_(poisson_N_per_m),
      cross_(cross_stiffening_N_per_m),
      poisson_free_(poisson_free),
      cross_free_(cross_free) {}

LawValue CoupledLaw::evaluate(const Vec3& strain, int element) const {
  LawValue law = diagonal_.evaluate(strain, element);
  const double u = strain[0], v = strain[1], shear = strain[2];
  const PositivePart q = positivePart(u + v);

  law.energy += poisson_ * u * v + 0.5 * cross_ * shear * shear * q.value;
  const double by_stretch = 0.5 * cross_ * shear * shear * q.first;
  law.stress +=
      Vec3(poisson_ * v + by_stretch, poisson_ * u + by_stretch, cross_ * shear * q.value);

  const double stretch_stretch = 0.5 * cross_ * shear * shear * q.second;
  const double stretch_shear = cross_ * shear * q.first;
  law.tangent(0, 0) += stretch_stretch;
  law.tangent(1, 1) += stretch_stretch;
  law.tangent(0, 1) = law.tangent(1, 0) = poisson_ + stretch_stretch;
  law.tangent(0, 2) = law.tangent(2, 0) = stretch_shear;
  law.tangent(1, 2) = law.tangent(2, 1) = stretch_shear;
  law.tangent(2, 2) += cross_ * q.value;
  return law;
}

int CoupledLaw::parameterCount() const {
  return diagonal_.parameterCount() + (poisson_free_ ? 1 : 0) + (cross_free_ ? 1 : 0);
}

void CoupledLaw::stressByParameter(const Vec3& strain,
                                   Eigen::Ref<Eigen::Matrix3Xd> derivative) const {
  int column = diagonal_.parameterCount();
  diagonal_.stressByParameter(strain, derivative.leftCols(column));
  const double u = strain[0], v = strain[1], shear = strain[2];
  if (poisson_free_) derivative.col(column++) = Vec3(v, u, 0.0);
  if (cross_free_) {
    const PositivePart q = positivePart(u + v);
    const double by_stretch = 0.5 * shear * shear * q.first;
    derivative.col(column) = Vec3(by_stretch, by_stretch, shear * q.value);
  }
}

}  // namespace tenter
