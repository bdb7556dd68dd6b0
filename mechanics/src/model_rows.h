// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/mechanics/cloth_models.h"

namespace tenter {

/// One row each; the registry in cloth_models.cpp lists them.
ClothModel springsModel();
ClothModel softModel();
ClothModel stvkModel();
ClothModel coupledStvkModel();
ClothModel edgeHingeModel();

/// Bending by curvature, shared by every model with BendingElement::kHinge.
std::span<const ComponentInfo> hingeBendingComponents();

/// W = sum of W_i over up to three components; missing ones are zero.
std::shared_ptr<StrainLaw> makeDiagonalLaw(std::span<const ComponentCurve> components);
/// Three diagonal components, then the constants c_p and c_x.
std::shared_ptr<StrainLaw> makeCoupledLaw(std::span<const ComponentCurve> components);

}  // namespace tenter
