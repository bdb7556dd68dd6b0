// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "tenter/mechanics/strain_law.h"

namespace tenter {

/// Constants of the virtual specimen's membrane (docs/twin.md).
struct MembraneConstants {
  Vec3 base_N_per_m = Vec3::Zero();   ///< Weft, warp, shear: the part that does not stiffen.
  double poisson = 0.0;               ///< Coupling over the geometric mean of weft and warp.
  double fung_N_per_m = 0.0;          ///< c of the exponential part.
  Vec3 fung_exponent = Vec3::Zero();  ///< a_u, a_v, a_s.
  double fung_cross = 0.0;            ///< a_x; convex while |a_x| < sqrt(a_u a_v).
};

/// Orthotropic membrane on Green-Lagrange strain (E_u, E_v, g = 2 E_uv):
///   W = 1/2 K_u b_u^2 + 1/2 K_v b_v^2 + poisson sqrt(K_u K_v) b_u b_v + 1/2 G g^2 + c/2 (e^Q - 1),
///   b = sqrt(1 + 2 E) - 1,   Q = a_u E_u^2 + a_v E_v^2 + 2 a_x E_u E_v + a_s g^2.
/// The exponential stiffens each strain in the presence of the others. Beyond Q = kQuadraticFrom it
/// goes on as its second-order expansion, and b below a stretch of kMinStretch likewise, so that no
/// trial step overflows.
class SpecimenMembraneLaw final : public StrainLaw {
 public:
  static constexpr double kQuadraticFrom = 6.0;
  static constexpr double kMinStretch = 0.2;

  explicit SpecimenMembraneLaw(const MembraneConstants& constants);
  LawValue evaluate(const Vec3& strain, int element) const override;

 private:
  MembraneConstants c_;
  double coupling_;  ///< poisson sqrt(K_u K_v).
};

/// Constants of the virtual specimen's bending.
struct BendingConstants {
  Vec3 rigidity_N_m = Vec3::Zero();  ///< Weft, warp, twist, at zero curvature.
  double floor = 1.0;                ///< Share of the rigidity that stays at large curvature.
  double knee_per_m = 100.0;         ///< Curvature at which it softens.
  double poisson = 0.0;  ///< Coupling over the geometric mean; convex while below `floor`.
};

/// Bending that softens, strains (k_u, k_v, 2 k_uv):
///   M_i / k_i = B_i (floor + (1 - floor) / sqrt(1 + (k_i / knee)^2)),   plus poisson sqrt(B_u B_v)
///   k_u k_v in the energy.
class SpecimenBendingLaw final : public StrainLaw {
 public:
  explicit SpecimenBendingLaw(const BendingConstants& constants);
  LawValue evaluate(const Vec3& strain, int element) const override;

 private:
  BendingConstants c_;
  double coupling_;
};

/// Constants of internal friction: one slider a strain component.
struct FrictionConstants {
  Vec3 yield_N_per_m = Vec3::Zero();
  Vec3 slip_strain = Vec3::Ones();  ///< Strain at which a slider yields.
};

/// An elastic membrane law with a Prandtl slider in parallel to each component, rate-independent:
///   stress = elastic + yield h((e - p) / slip),  h = clamp to [-1, 1] with its corners rounded
///   over kRounding.
/// p, the slip of every element, moves only in commit(): between commits the law is hyperelastic
/// (an incremental potential).
class FrictionalLaw final : public StrainLaw {
 public:
  static constexpr double kRounding = 0.3;

  FrictionalLaw(std::shared_ptr<const StrainLaw> elastic, const FrictionConstants& constants,
                int elements);
  LawValue evaluate(const Vec3& strain, int element) const override;

  /// Return mapping: lets every slider of `element` slip to where the strain has carried it.
  /// Returns the energy dissipated [J/m^2], never negative.
  double commit(const Vec3& strain, int element);
  const Eigen::Matrix3Xd& slip() const { return slip_; }

 private:
  std::shared_ptr<const StrainLaw> elastic_;
  FrictionConstants c_;
  Eigen::Matrix3Xd slip_;  ///< 3 x elements.
};

}  // namespace tenter
