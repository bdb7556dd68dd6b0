// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "tenter/mechanics/energy_term.h"
#include "tenter/mechanics/strain_law.h"

namespace tenter {

/// One straight spring: energy weight * W(e), where only strain `component` e = l / l0 - 1 is not
/// zero.
struct AxialElement {
  int begin, end;  ///< Node ids.
  int component;
  double rest_length_m;
  double weight;  ///< [m^2] for laws per area, [m] for laws per length.
};

/// Springs of every kind: ring 1, ring 2 and mesh edges.
std::unique_ptr<EnergyTerm> makeAxialTerm(std::vector<AxialElement> elements,
                                          std::shared_ptr<const StrainLaw> law);

}  // namespace tenter
