// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "tenter/core/types.h"
#include "tenter/mechanics/spline_basis.h"
#include "tenter/mechanics/stiffness_curve.h"

namespace tenter {

/// Energy density [J/m^2], conjugate stresses and their derivatives at one strain triple.
struct LawValue {
  double energy = 0.0;
  Vec3 stress = Vec3::Zero();   ///< dW/de_i: [N/m] for membranes, [N m / m] = [N] for bending.
  Mat3 tangent = Mat3::Zero();  ///< Symmetric.
};

/// A hyperelastic law W(e_1, e_2, e_3) of three strains: membrane (e_su, e_sv, e_suv) or bending
/// (k_u, k_v, 2 k_uv). `element` identifies the place, for laws that keep a history per element;
/// most ignore it. Const members never allocate and are safe to call from several threads.
class StrainLaw {
 public:
  virtual ~StrainLaw() = default;
  virtual LawValue evaluate(const Vec3& strain, int element) const = 0;

  /// Parameters that a fit may move; W is differentiable in them.
  virtual int parameterCount() const { return 0; }
  /// d stress_i / d p_j, 3 x parameterCount().
  virtual void stressByParameter(const Vec3& strain, Eigen::Ref<Eigen::Matrix3Xd> derivative) const;
};

/// W = sum_i W_i(e_i): each component its own stiffness curve [Est12] sec. 4.1-4.2.
/// Parameters: the spline coefficients of component 0, then 1, then 2 (empty basis: no parameters,
/// curve fixed).
class DiagonalLaw final : public StrainLaw {
 public:
  explicit DiagonalLaw(std::array<StiffnessCurve, 3> curves);
  DiagonalLaw(std::array<StiffnessCurve, 3> curves,
              std::array<std::shared_ptr<const SplineBasis>, 3> bases);

  LawValue evaluate(const Vec3& strain, int element) const override;
  int parameterCount() const override;
  void stressByParameter(const Vec3& strain,
                         Eigen::Ref<Eigen::Matrix3Xd> derivative) const override;

  const StiffnessCurve& curve(int component) const { return curves_[component]; }
  void setCurve(int component, StiffnessCurve curve) { curves_[component] = std::move(curve); }

 private:
  std::array<StiffnessCurve, 3> curves_;
  std::array<std::shared_ptr<const SplineBasis>, 3> bases_;
};

/// DiagonalLaw plus two coupling terms, for cloth that the diagonal law cannot describe:
///   W_p = c_p e_u e_v                        (Poisson effect; c_p [N/m])
///   W_x = 1/2 c_x e_uv^2 q(e_u + e_v)        (shear stiffening under tension; c_x [N/m]),
/// q(s) = (s + sqrt(s^2 + d^2)) / 2, d = 1e-3, a smooth positive part.
/// Parameters: those of the diagonal part, then c_p, then c_x (those that are free).
class CoupledLaw final : public StrainLaw {
 public:
  /// `poisson_free`, `cross_free`: whether c_p and c_x count among the parameters.
  CoupledLaw(DiagonalLaw diagonal, double poisson_N_per_m, double cross_stiffening_N_per_m,
             bool poisson_free = true, bool cross_free = true);

  LawValue evaluate(const Vec3& strain, int element) const override;
  int parameterCount() const override;
  void stressByParameter(const Vec3& strain,
                         Eigen::Ref<Eigen::Matrix3Xd> derivative) const override;

 private:
  DiagonalLaw diagonal_;
  double poisson_, cross_;
  bool poisson_free_, cross_free_;
};

}  // namespace tenter
