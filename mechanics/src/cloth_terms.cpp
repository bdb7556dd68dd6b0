// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>
#include <utility>

#include "tenter/mechanics/energy_terms.h"

namespace tenter {
namespace {

std::unique_ptr<EnergyTerm> makeMembrane(const ClothModel& model, const ClothLaws& laws,
                                         const SheetMesh& sheet, const std::vector<bool>& rigid) {
  switch (model.membrane) {
    case MembraneElement::kSprings:
      return makeRing1SpringTerm(sheet, laws.membrane);
    case MembraneElement::kEdges:
      return makeEdgeTerm(sheet, laws.membrane);
    case MembraneElement::kStvk:
    case MembraneElement::kSoft:
      break;
  }
  return makeMembraneTerm(sheet, model.membrane, laws.membrane, rigid);
}

}  // namespace

Result<ClothTerms> makeClothTerms(const ClothModel& model, const ClothLaws& laws,
                                  const SheetMesh& sheet, const std::vector<bool>& rigid_triangles,
                                  EdgeRotations rotations) {
  if (model.needs_grid && !sheet.grid) {
    return badInput("", "",
                    "the model " + std::string(model.id) + " needs a grid, not " + sheet.pattern,
                    "choose a model of triangles");
  }
  ClothTerms out;
  out.terms.push_back(makeMembrane(model, laws, sheet, rigid_triangles));
  if (!laws.bending) return out;  // in-plane
  switch (model.bending) {
    case BendingElement::kSprings:
      out.terms.push_back(makeRing2SpringTerm(sheet, laws.bending));
      break;
    case BendingElement::kRawHinge:
      out.terms.push_back(makeRawHingeTerm(sheet, laws.bending));
      break;
    case BendingElement::kHinge: {
      HingeTerm hinge =
          makeHingeTerm(sheet, laws.bending, rigid_triangles, rotations, 3 * sheet.nodeCount());
      out.terms.push_back(std::move(hinge.term));
      out.rotation_edge = std::move(hinge.rotation_edge);
      break;
    }
  }
  return out;
}

}  // namespace tenter
