// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Sparse>
#include <memory>
#include <optional>
#include <vector>

#include "tenter/mechanics/cloth_system.h"
#include "tenter/mechanics/element_rest.h"

namespace tenter {

/// What a shell is made of.
struct ShellMaterial {
  const ClothModel* model = nullptr;
  ClothLaws laws;
  double areal_density_kg_per_m2 = 0.0;
  Vec3 gravity_m_per_s2 = kDefaultGravity;
};

/// Whether its elements are edges and raw hinges: the only ones whose rest state can be given one
/// by one.
bool hasElementRest(const ShellMaterial& material);

/// Edge vectors of a triangle in its weft and warp axes, one column an edge (1 - 0, 2 - 0).
using MaterialFrame = Mat2;

/// A shell whose rest positions are the unknown (docs/inversion.md). Coordinates q are those of
/// EnergyTerm: the pose x, 3 a vertex, then one rotation a mesh edge if the model's bending has
/// them, all in metres. Total energy E(q, rest): membrane, bending, and gravity on masses of the
/// rest areas. No triangle counts as rigid: what holds a vertex does not change the energy.
class InverseShell {
 public:
  using Sparse = Eigen::SparseMatrix<double>;

  /// @param target  gives topology and, by its uv, the material directions.
  /// @param frames  one a triangle instead of uv; empty: from uv, or none if the model is the same
  ///                in all directions.
  /// Error: invalid mesh, a model that needs a grid, a material with directions on a mesh without.
  static Result<InverseShell> create(const TriangleMesh& target, ShellMaterial material,
                                     std::vector<MaterialFrame> frames = {});

  int vertexCount() const { return mesh_.vertexCount(); }
  int rotationCount() const { return rotation_count_; }
  int coordinateCount() const { return 3 * vertexCount() + rotation_count_; }
  const TriangleMesh& target() const { return mesh_; }
  const MeshTopology& topology() const { return topology_; }
  const ShellMaterial& material() const { return material_; }

  void setGravity(const Vec3& gravity_m_per_s2) { material_.gravity_m_per_s2 = gravity_m_per_s2; }

  /// The pose's positions followed by the rotations.
  Eigen::VectorXd coordinates(const Points3& pose, const Eigen::VectorXd& rotations) const;

  /// dE/dq [N]: minus the force of the shell's own weight and elasticity.
  void gradient(const Eigen::VectorXd& q, const Points3& rest, Eigen::VectorXd& out) const;
  /// d(dE/dq) / d(rest positions, rotations), square; rotations are unknowns of the inverse problem
  /// like rest positions. Rows of one vertex share one pattern, which never changes.
  const Sparse& gradientByRest(const Eigen::VectorXd& q, const Points3& rest) const;

  Eigen::VectorXd mass(const Points3& rest) const;  ///< Of each vertex [kg].
  double weight_N(const Points3& rest) const;       ///< Total mass times |gravity|.

  /// From here on system() has these rest lengths and angles, its rest positions giving masses and
  /// the hinges' weights only; nothing: those of the rest positions again. Needs hasElementRest().
  void setElementRest(std::optional<ElementRest> rest);
  const std::optional<ElementRest>& elementRest() const { return element_rest_; }

  SheetMesh sheet(const Points3& rest) const;
  /// The forward problem on that rest shape, with more energies if given. Error as
  /// ClothSystem::create.
  Result<ClothSystem> system(const Points3& rest, std::vector<int> held_vertices,
                             std::vector<std::unique_ptr<EnergyTerm>> more = {}) const;

 private:
  InverseShell() = default;
  void findPattern();

  TriangleMesh mesh_;
  MeshTopology topology_;
  ShellMaterial material_;
  std::vector<MaterialFrame> frames_;  ///< Empty: directions do not matter.
  std::optional<ElementRest> element_rest_;
  int rotation_count_ = 0;
  /// Of gradientByRest: the matrix, and where each entry goes in the order elements give them.
  mutable Sparse by_rest_;
  std::vector<int> slots_;
};

}  // namespace tenter
