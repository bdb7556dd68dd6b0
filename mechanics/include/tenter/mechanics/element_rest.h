// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>

#include "tenter/mechanics/energy_terms.h"

namespace tenter {

/// Rest state of a shell of edges and hinges, element by element: a metric that no rest positions
/// need have.
struct ElementRest {
  Eigen::VectorXd length_m;   ///< L0 of every mesh edge.
  Eigen::VectorXd angle_rad;  ///< theta0 of every mesh edge; 0 on the border, where nothing bends.
};

/// As those without `rest`, whose lengths and angles stand in for the rest positions'. The hinges'
/// weights 3 L0^2 / A stay those of the rest positions.
std::unique_ptr<EnergyTerm> makeEdgeTerm(const SheetMesh& sheet,
                                         std::shared_ptr<const StrainLaw> law,
                                         const ElementRest& rest);
std::unique_ptr<EnergyTerm> makeRawHingeTerm(const SheetMesh& sheet,
                                             std::shared_ptr<const StrainLaw> law,
                                             const ElementRest& rest);
/// As that without `rest`, whose angles stand in for the rest positions'; lengths do not matter.
HingeTerm makeHingeTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
                        EdgeRotations rotations, int first_coordinate, const ElementRest& rest);

}  // namespace tenter
