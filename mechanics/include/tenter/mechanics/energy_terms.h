// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/energy_term.h"
#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// sum over triangles of area * W(e), e measured as [Est12] eq. 3 or 4. `rigid` marks triangles
/// that a clip holds entirely (left out); may be empty. Linear triangles, exact first and second
/// derivatives.
std::unique_ptr<EnergyTerm> makeMembraneTerm(const SheetMesh& sheet, MembraneElement measure,
                                             std::shared_ptr<const StrainLaw> law,
                                             const std::vector<bool>& rigid_triangles);

/// Springs of a grid [Est12] eq. 1: ring 1 along weft and warp (components 0, 1) and both diagonals
/// (2), or ring 2. Each weighs its share of area: ring-1 half of each adjacent quad, diagonal half
/// of its quad, ring-2 a quarter of its quads. Precondition: sheet.grid. W_i = area * W(l / l0 -
/// 1).
std::unique_ptr<EnergyTerm> makeRing1SpringTerm(const SheetMesh& sheet,
                                                std::shared_ptr<const StrainLaw> law);
std::unique_ptr<EnergyTerm> makeRing2SpringTerm(const SheetMesh& sheet,
                                                std::shared_ptr<const StrainLaw> law);

/// Which edges carry a rotation of their own (docs/mechanics-elements.md). Boundary edges always
/// do: it is what makes the free edge moment-free. kAutomatic adds the interior edges, one by one,
/// whose half dihedral angles do not reproduce constant curvature; all of them if the rest mesh is
/// curved.
enum class EdgeRotations { kAutomatic, kBoundaryOnly, kAll };

/// Bending by dihedral angles: curvature of triangle f, rest curvature subtracted,
///   K_f = sum over its edges of (l_e / A_f) a_ef n_e n_e^T,   a_ef = theta_e / 2 +- r_e,
/// with r_e the rotation of the edge's mid-normal against the bisector, strains (K_uu, K_vv, 2
/// K_uv), energy A_f W(strains). An edge between a free triangle and a rigid one (clamp line) takes
/// its whole angle: half the width, twice the curvature.
/// @param first_coordinate  index in q of the first edge rotation; they follow one another.
struct HingeTerm {
  std::unique_ptr<EnergyTerm> term;
  int rotation_count = 0;
  std::vector<int> rotation_edge;  ///< Edge of each rotation.
};
HingeTerm makeHingeTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
                        const std::vector<bool>& rigid_triangles, EdgeRotations rotations,
                        int first_coordinate);

/// [Inv18] eq. 9: k_L/2 (L - L0)^2 / L0 on every edge; and eq. 10: k_theta/2 * 3 L0^2 / A (theta -
/// theta0)^2, A the sum of the two rest areas. Constants are component 0 of the laws. (Parameters:
/// that constant.)
std::unique_ptr<EnergyTerm> makeEdgeTerm(const SheetMesh& sheet,
                                         std::shared_ptr<const StrainLaw> law);
std::unique_ptr<EnergyTerm> makeRawHingeTerm(const SheetMesh& sheet,
                                             std::shared_ptr<const StrainLaw> law);

/// Potential of gravity on lumped masses (a third of each triangle to each corner): -m_i g . x_i.
/// Zero Hessian.
std::unique_ptr<EnergyTerm> makeGravityTerm(const Eigen::VectorXd& nodal_mass_kg,
                                            const Vec3& gravity_m_per_s2);
Eigen::VectorXd lumpedMass(const SheetMesh& sheet, double areal_density_kg_per_m2);

/// The terms of a model on a sheet (without gravity), and the edge rotations that they add.
struct ClothTerms {
  std::vector<std::unique_ptr<EnergyTerm>> terms;  ///< Membrane, then bending.
  std::vector<int> rotation_edge;                  ///< Edge of each extra coordinate, 3 n onwards.
};
Result<ClothTerms> makeClothTerms(const ClothModel& model, const ClothLaws& laws,
                                  const SheetMesh& sheet, const std::vector<bool>& rigid_triangles,
                                  EdgeRotations rotations = EdgeRotations::kAutomatic);

}  // namespace tenter
