// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "axial_term.h"
#include "tenter/mechanics/energy_terms.h"

namespace tenter {

std::unique_ptr<EnergyTerm> makeEdgeTerm(const SheetMesh& sheet,
                                         std::shared_ptr<const StrainLaw> law) {
  std::vector<AxialElement> springs;
  springs.reserve(sheet.topology.edges.size());
  for (const MeshEdge& e : sheet.topology.edges) {
    const double length =
        (sheet.rest.positions.col(e.vertices[1]) - sheet.rest.positions.col(e.vertices[0])).norm();
    // k/2 (L - L0)^2 / L0 = L0 W(L / L0 - 1): the weight is a length.
    springs.push_back({e.vertices[0], e.vertices[1], 0, length, length});
  }
  return makeAxialTerm(std::move(springs), std::move(law));
}

}  // namespace tenter
