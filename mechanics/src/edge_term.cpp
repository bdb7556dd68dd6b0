// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "axial_term.h"
#include "tenter/mechanics/element_rest.h"

namespace tenter {
namespace {

template <class RestLength>
std::unique_ptr<EnergyTerm> edgeTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
                                     RestLength rest_length_m) {
  std::vector<AxialElement> springs;
  springs.reserve(sheet.topology.edges.size());
  for (std::size_t k = 0; k < sheet.topology.edges.size(); ++k) {
    const auto [begin, end] = sheet.topology.edges[k].vertices;
    const double length = rest_length_m(k);
    // k/2 (L - L0)^2 / L0 = L0 W(L / L0 - 1): the weight is a length.
    springs.push_back({begin, end, 0, length, length});
  }
  return makeAxialTerm(std::move(springs), std::move(law));
}

}  // namespace

std::unique_ptr<EnergyTerm> makeEdgeTerm(const SheetMesh& sheet,
                                         std::shared_ptr<const StrainLaw> law) {
  return edgeTerm(sheet, std::move(law), [&](std::size_t edge) {
    const auto [begin, end] = sheet.topology.edges[edge].vertices;
    return (sheet.rest.positions.col(end) - sheet.rest.positions.col(begin)).norm();
  });
}

std::unique_ptr<EnergyTerm> makeEdgeTerm(const SheetMesh& sheet,
                                         std::shared_ptr<const StrainLaw> law,
                                         const ElementRest& rest) {
  require(rest.length_m.size() == static_cast<Eigen::Index>(sheet.topology.edges.size()),
          "makeEdgeTerm: one rest length an edge");
  return edgeTerm(sheet, std::move(law),
                  [&](std::size_t edge) { return rest.length_m[static_cast<Eigen::Index>(edge)]; });
}

}  // namespace tenter
