// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "tenter/twin/specimen_law.h"

namespace tenter {
namespace {

struct Derivatives {
  double value, first, second;
};

/// Engineering strain b(E) = sqrt(1 + 2E) - 1 and its derivatives.
Derivatives engineeringStrain(double green) {
  constexpr double kMin = SpecimenMembraneLaw::kMinStretch;
  constexpr double kMinGreen = 0.5 * (kMin * kMin - 1.0);
  if (green >= kMinGreen) {
    const double stretch = std::sqrt(1.0 + 2.0 * green);
    return {stretch - 1.0, 1.0 / stretch, -1.0 / (stretch * stretch * stretch)};
  }
  constexpr double kSlope = 1.0 / kMin, kBend = -1.0 / (kMin * kMin * kMin);
  const double d = green - kMinGreen;
  return {kMin - 1.0 + d * (kSlope + 0.5 * kBend * d), kSlope + kBend * d, kBend};
}

/// e^Q - 1, as a parabola beyond the limit.
Derivatives cappedExponential(double q) {
  constexpr double kFrom = SpecimenMembraneLaw::kQuadraticFrom;
  if (q <= kFrom) return {std::expm1(q), std::exp(q), std::exp(q)};
  static const double kTop = std::exp(kFrom);
  const double d = q - kFrom;
  return {kTop * (1.0 + d * (1.0 + 0.5 * d)) - 1.0, kTop * (1.0 + d), kTop};
}

}  // namespace

SpecimenMembraneLaw::SpecimenMembraneLaw(const MembraneConstants& constants)
    : c_(constants), coupling_(c_.poisson * std::sqrt(c_.base_N_per_m[0] * c_.base_N_per_m[1])) {
  require(c_.base_N_per_m.minCoeff() > 0.0 && c_.fung_N_per_m >= 0.0 &&
              c_.fung_exponent.minCoeff() >= 0.0 && std::abs(c_.poisson) < 1.0,
          "SpecimenMembraneLaw: stiffness must be positive");
  require(c_.fung_cross * c_.fung_cross <= c_.fung_exponent[0] * c_.fung_exponent[1],
          "SpecimenMembraneLaw: the exponent must be convex");
}

LawValue SpecimenMembraneLaw::evaluate(const Vec3& strain, int /*element*/) const {
  LawValue out;
  Derivatives b[2];
  for (int i = 0; i < 2; ++i) {
    b[i] = engineeringStrain(strain[i]);
    const double k = c_.base_N_per_m[i];
    out.energy += 0.5 * k * b[i].value * b[i].value;
    out.stress[i] = k * b[i].value * b[i].first;
    out.tangent(i, i) = k * (b[i].first * b[i].first + b[i].value * b[i].second);
  }
  out.energy += coupling_ * b[0].value * b[1].value;
  for (int i = 0; i < 2; ++i) {
    out.stress[i] += coupling_ * b[i].first * b[1 - i].value;
    out.tangent(i, i) += coupling_ * b[i].second * b[1 - i].value;
  }
  out.tangent(0, 1) = out.tangent(1, 0) = coupling_ * b[0].first * b[1].first;
  const double shear = c_.base_N_per_m[2];
  out.energy += 0.5 * shear * strain[2] * strain[2];
  out.stress[2] = shear * strain[2];
  out.tangent(2, 2) = shear;

  Mat3 form = c_.fung_exponent.asDiagonal();
  form(0, 1) = form(1, 0) = c_.fung_cross;
  const Vec3 slope = 2.0 * form * strain;
  const Derivatives f = cappedExponential(0.5 * slope.dot(strain));
  const double half = 0.5 * c_.fung_N_per_m;
  out.energy += half * f.value;
  out.stress += half * f.first * slope;
  // Product first: scaling one factor would cost the last bit of symmetry.
  const Mat3 square = slope * slope.transpose();
  out.tangent += half * (f.second * square + 2.0 * f.first * form);
  return out;
}

}  // namespace tenter
