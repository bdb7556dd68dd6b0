// SPDX-License-Identifier: GPL-3.0-or-later
#include "model_rows.h"

namespace tenter {
namespace {

constexpr ComponentInfo kMembrane[] = {
    {.name = "stretch_weft",
     .strain_measure = "relative length change l/l0 - 1 of the weft springs to the next node",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
    {.name = "stretch_warp",
     .strain_measure = "relative length change l/l0 - 1 of the warp springs to the next node",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
    // Even, since a sheared quad stretches one diagonal as much as it shortens the other, and its
    // force shows the sum only.
    {.name = "shear",
     .strain_measure = "relative length change l/l0 - 1 of the diagonal springs of a quad",
     .strain_unit = "1",
     .stiffness_unit = "N/m",
     .even = true},
};

// Not even: a bent sheet only ever shortens the springs to the second node, and a stretched one
// lengthens them.
constexpr ComponentInfo kBending[] = {
    {.name = "bend_weft",
     .strain_measure = "relative length change l/l0 - 1 of the weft springs to the second node; "
                       "mesh-dependent, bending only shortens them",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
    {.name = "bend_warp",
     .strain_measure = "relative length change l/l0 - 1 of the warp springs to the second node; "
                       "mesh-dependent, bending only shortens them",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
    {.name = "bend_diagonal",
     .strain_measure = "relative length change l/l0 - 1 of the diagonal springs to the second "
                       "node; mesh-dependent, bending only shortens them",
     .strain_unit = "1",
     .stiffness_unit = "N/m"},
};

}  // namespace

ClothModel springsModel() {
  return {.id = "springs",
          .description = "springs to the first and second neighbours on a regular grid",
          .source = "[Est12] sec. 4.1, eq. 1",
          .membrane = MembraneElement::kSprings,
          .bending = BendingElement::kSprings,
          .needs_grid = true,
          .membrane_components = kMembrane,
          .bending_components = kBending,
          .membrane_law = makeDiagonalLaw,
          .bending_law = makeDiagonalLaw};
}

}  // namespace tenter
