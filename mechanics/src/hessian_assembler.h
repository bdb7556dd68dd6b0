// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Sparse>
#include <cstdint>
#include <memory>
#include <vector>

#include "dof_map.h"
#include "tenter/mechanics/energy_term.h"

namespace tenter {

/// Scatters element Hessians into the sparse matrix of the degrees of freedom, and into the rows of
/// the held coordinates (which give the clips' stiffness). The pattern and every element's places
/// in it are worked out once.
class HessianAssembler {
 public:
  /// Rows: held coordinates; columns: dofs, then held coordinates.
  using HeldMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  HessianAssembler(const DofMap& map, const std::vector<std::unique_ptr<EnergyTerm>>& terms);

  void assemble(const Eigen::VectorXd& q, const ClipFrames& frames, Projection projection);
  /// Adds to the diagonal block of a free clip.
  void addClipBlock(int clip, const Eigen::Matrix<double, 6, 6>& block);

  const SparseLower& matrix() const { return matrix_; }
  const HeldMatrix& held() const { return held_; }

 private:
  /// A column piece of an element's block: `length` values from `source` to `target`.
  struct Run {
    int target;
    std::uint16_t source;
    std::uint16_t length;
  };
  struct ElementPlan {
    int free_begin, free_end, held_begin, held_end;  ///< Runs.
    int transform;                                   ///< Index into transforms_, or -1.
  };
  /// One group of coordinates of an element after free clips have been eliminated.
  struct Entity {
    int first_dof;   ///< -1 if held.
    int first_held;  ///< -1 if it moves.
    int size;        ///< Rows that it has in the matrix.
    int local;       ///< First row in the element's (transformed) block.
  };
  /// Elements that touch a free clip: which entity each coordinate group goes to.
  struct Transform {
    Stencil stencil;
    std::vector<int> node_local;  ///< First local row of each node's entity.
    std::vector<int> node_clip;   ///< Free clip of each node, or -1.
    std::vector<int> scalar_local;
    int size = 0;
  };
  class Sink;

  std::vector<Entity> entitiesOf(const Stencil& stencil, Transform* transform) const;
  void collectPattern(const std::vector<Entity>& entities, std::vector<std::vector<int>>& free_rows,
                      std::vector<std::vector<int>>& held_columns) const;
  void planElement(const std::vector<Entity>& entities, int local_size, ElementPlan& plan);
  int freePosition(int row, int column) const;
  int heldPosition(int row, int column) const;

  const DofMap& map_;
  const std::vector<std::unique_ptr<EnergyTerm>>& terms_;
  std::vector<std::vector<ElementPlan>> plans_;  ///< Per term.
  std::vector<Run> runs_;
  std::vector<Transform> transforms_;
  SparseLower matrix_;
  HeldMatrix held_;
};

}  // namespace tenter
