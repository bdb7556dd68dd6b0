// SPDX-License-Identifier: GPL-3.0-or-later
#include "model_rows.h"

namespace tenter {
namespace {

constexpr ComponentInfo kMembrane[] = {
    {.name = "edge_stretch",
     .strain_measure = "constant k_L of the energy k_L (L - L0)^2 / (2 L0) of every edge",
     .strain_unit = "1",
     .stiffness_unit = "N/m",
     .constant_only = true},
};

constexpr ComponentInfo kBending[] = {
    {.name = "hinge_bend",
     .strain_measure =
         "constant k_theta of the energy k_theta / 2 * 3 L0^2 / A (theta - theta0)^2 of every "
         "inner edge, A the area of its two triangles; mesh-dependent",
     .strain_unit = "1",
     .stiffness_unit = "N m",
     .constant_only = true},
};

}  // namespace

ClothModel edgeHingeModel() {
  return {.id = "edge-hinge",
          .description = "two constants: springs on the edges, hinges between triangles",
          .source = "[Inv18] eq. 9 and 10",
          .membrane = MembraneElement::kEdges,
          .bending = BendingElement::kRawHinge,
          .fittable = false,
          .membrane_components = kMembrane,
          .bending_components = kBending,
          .membrane_law = makeDiagonalLaw,
          .bending_law = makeDiagonalLaw};
}

}  // namespace tenter
