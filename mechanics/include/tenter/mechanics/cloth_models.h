// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/mechanics/material.h"
#include "tenter/mechanics/strain_law.h"

namespace tenter {

/// How membrane strain is measured.
enum class MembraneElement {
  kStvk,  ///< Green-Lagrange per triangle [Est12] eq. 3: (|w_u|^2-1)/2, (|w_v|^2-1)/2, w_u . w_v.
  kSoft,  ///< |w_u|-1, |w_v|-1, w_u . w_v per triangle [Est12] eq. 4 [BW98].
  kSprings,  ///< Ring-1 springs on a grid [Est12] eq. 1.
  kEdges,    ///< Every mesh edge a spring, k_L (L - L0)^2 / (2 L0) [Inv18] eq. 9.
};

/// How bending strain is measured.
enum class BendingElement {
  kHinge,     ///< Dihedral angles of the edges, as curvature per triangle (docs/mechanics.md);
              ///< B(kappa) [N m].
  kSprings,   ///< Ring-2 springs on a grid [Est12] sec. 4.1; mesh-dependent.
  kRawHinge,  ///< k_theta/2 * 3 L^2/A (theta - theta0)^2 [Inv18] eq. 10.
};

struct ComponentInfo {
  std::string_view name;            ///< In files: "stretch_weft", "shear", "bend_diagonal" ...
  std::string_view strain_measure;  ///< In words, for files and reports.
  std::string_view strain_unit;     ///< "1" or "1/m".
  std::string_view stiffness_unit;  ///< "N/m" or "N m".
  bool even = false;                ///< k(e) = k(-e).
  bool constant_only = false;       ///< A single number, never a curve.
  bool may_be_negative = false;     ///< Couplings.
};

/// Curves, and bases where they are to be fitted, one per component of a model in the registry's
/// order.
struct ComponentCurve {
  StiffnessCurve curve = StiffnessCurve::constant(0.0);
  std::shared_ptr<const SplineBasis> basis;  ///< Null: fixed, no parameters.
};

using LawFactory = std::shared_ptr<StrainLaw> (*)(std::span<const ComponentCurve>);

/// One row of the registry: everything that parsing, fitting, tests and documentation need to know
/// of a model.
struct ClothModel {
  std::string_view id;
  std::string_view description;
  std::string_view source;  ///< Reference key and equation.
  MembraneElement membrane;
  BendingElement bending;
  bool needs_grid = false;  ///< Springs: only on grid sheets.
  bool fittable = true;
  std::span<const ComponentInfo> membrane_components;
  std::span<const ComponentInfo> bending_components;
  LawFactory membrane_law;  ///< From the curves of the membrane components.
  LawFactory bending_law;   ///< From the curves of the bending components.

  int componentIndex(std::string_view name) const;  ///< Over membrane, then bending; -1 if absent.
  const ComponentInfo& component(int index) const;
  int componentCount() const;
};

/// All cloth models. To add one: its file, and one line in cloth_models.cpp.
std::span<const ClothModel> clothModels();

/// Error names the models there are.
Result<const ClothModel*> findClothModel(std::string_view id);

/// The laws that a sheet of this model computes with.
struct ClothLaws {
  std::shared_ptr<StrainLaw> membrane;
  std::shared_ptr<StrainLaw> bending;
};
ClothLaws makeLaws(const ClothModel& model, const std::vector<ComponentCurve>& components);

/// From a material file. Error when a component is missing or unknown.
Result<ClothLaws> makeLaws(const ClothModel& model, const Material& material);

}  // namespace tenter
