// SPDX-License-Identifier: GPL-3.0-or-later
#include "model_rows.h"

namespace tenter {
namespace {

constexpr ComponentInfo kMembrane[] = {
    {.name = "stretch_weft",
     .strain_measure = "|w_u| - 1",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
    {.name = "stretch_warp",
     .strain_measure = "|w_v| - 1",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
    {.name = "shear",
     .strain_measure = "w_u . w_v",
     .strain_unit = "1",
     .stiffness_unit = "N/m",
     .even = true},
};

}  // namespace

ClothModel softModel() {
  return {.id = "soft",
          .description = "soft constraints on triangles, bending by dihedral angles",
          .source = "[Est12] eq. 4 and 5, [BW98]",
          .membrane = MembraneElement::kSoft,
          .bending = BendingElement::kHinge,
          .membrane_components = kMembrane,
          .bending_components = hingeBendingComponents(),
          .membrane_law = makeDiagonalLaw,
          .bending_law = makeDiagonalLaw};
}

}  // namespace tenter
