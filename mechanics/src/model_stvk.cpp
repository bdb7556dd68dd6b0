// SPDX-License-Identifier: GPL-3.0-or-later
#include "model_rows.h"

namespace tenter {
namespace {

constexpr ComponentInfo kStretchWeft = {.name = "stretch_weft",
                                        .strain_measure = "(|w_u|^2 - 1) / 2",
                                        .strain_unit = "1",
                                        .stiffness_unit = "N/m"};
constexpr ComponentInfo kStretchWarp = {.name = "stretch_warp",
                                        .strain_measure = "(|w_v|^2 - 1) / 2",
                                        .strain_unit = "1",
                                        .stiffness_unit = "N/m"};
constexpr ComponentInfo kShear = {.name = "shear",
                                  .strain_measure = "w_u . w_v",
                                  .strain_unit = "1",
                                  .stiffness_unit = "N/m",
                                  .even = true};

constexpr ComponentInfo kMembrane[] = {kStretchWeft, kStretchWarp, kShear};

constexpr ComponentInfo kCoupledMembrane[] = {
    kStretchWeft,
    kStretchWarp,
    kShear,
    {.name = "poisson",
     .strain_measure = "constant c_p of the energy c_p e_u e_v",
     .strain_unit = "1",
     .stiffness_unit = "N/m",
     .constant_only = true,
     .may_be_negative = true},
    {.name = "cross_stiffening",
     .strain_measure = "constant c_x of the energy c_x e_uv^2 q(e_u + e_v) / 2",
     .strain_unit = "1",
     .stiffness_unit = "N/m",
     .constant_only = true,
     .may_be_negative = true},
};

}  // namespace

ClothModel stvkModel() {
  return {.id = "stvk",
          .description = "diagonal St. Venant-Kirchhoff triangles, bending by dihedral angles",
          .source = "[Est12] eq. 3 and 5",
          .membrane = MembraneElement::kStvk,
          .bending = BendingElement::kHinge,
          .membrane_components = kMembrane,
          .bending_components = hingeBendingComponents(),
          .membrane_law = makeDiagonalLaw,
          .bending_law = makeDiagonalLaw};
}

ClothModel coupledStvkModel() {
  return {.id = "stvk-coupled",
          .description = "stvk with a Poisson effect and shear that stiffens under tension",
          .source = "docs/mechanics-curves.md",
          .membrane = MembraneElement::kStvk,
          .bending = BendingElement::kHinge,
          .membrane_components = kCoupledMembrane,
          .bending_components = hingeBendingComponents(),
          .membrane_law = makeCoupledLaw,
          .bending_law = makeDiagonalLaw};
}

}  // namespace tenter
