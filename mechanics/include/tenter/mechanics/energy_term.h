// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace tenter {

/// Coordinates of a sheet in one vector q: node i at 3i .. 3i+2 [m], then the edge rotations of the
/// bending term, each times its edge's length so that every entry is in metres and every force in
/// newtons.

/// Whether indefinite element Hessians are replaced by positive semi-definite ones: springs and
/// membranes by clamped eigenvalues, hinges by Gauss-Newton without d2 theta.
enum class Projection { kNone, kPositiveSemiDefinite };

/// Coordinates that one element couples: whole nodes first, then single coordinates.
struct Stencil {
  static constexpr int kMaxNodes = 6, kMaxScalars = 3;
  std::array<int, kMaxNodes> nodes{};      ///< Node ids.
  std::array<int, kMaxScalars> scalars{};  ///< Indices into q.
  int node_count = 0, scalar_count = 0;
  int size() const { return 3 * node_count + scalar_count; }
};

/// Receives element Hessians. Element `e` of a term is the e-th of its stencils.
class HessianSink {
 public:
  virtual ~HessianSink() = default;
  /// @param block  size() x size(), column-major, symmetric, ordered as the stencil.
  virtual void add(int element, const double* block) = 0;
};

/// One kind of energy on a sheet: membrane triangles, springs, hinges, gravity. Const members may
/// be called from several threads and never allocate, but for scratch memory that a thread grows on
/// its first call; q always has coordinateCount entries.
class EnergyTerm {
 public:
  virtual ~EnergyTerm() = default;
  virtual const std::vector<Stencil>& stencils() const = 0;
  virtual double energy(const Eigen::VectorXd& q) const = 0;
  /// Adds dE/dq.
  virtual void addGradient(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) const = 0;
  /// Calls sink.add for every element, in order.
  virtual void addHessian(const Eigen::VectorXd& q, Projection projection,
                          HessianSink& sink) const = 0;

  /// Parameters of the term's law, and d(dE/dq)/dp added to a coordinateCount x parameterCount
  /// matrix.
  virtual int parameterCount() const { return 0; }
  virtual void addParameterGradient(const Eigen::VectorXd& /*q*/,
                                    Eigen::Ref<Eigen::MatrixXd> /*derivative*/) const {}
  /// Strains of every element for histograms and reports: 3 x elements (0 where an element has no
  /// such component); empty if it has none.
  virtual void strains(const Eigen::VectorXd& /*q*/, Eigen::Matrix3Xd& out) const {
    out.resize(3, 0);
  }
  /// Rest area of every element [m^2], the weight of its strains. Springs: area of the spring.
  virtual Eigen::VectorXd elementAreas() const { return {}; }
};

/// Nearest positive semi-definite matrix of a small symmetric block, in place (eigenvalues clamped
/// at 0).
void projectPositiveSemiDefinite(Eigen::Ref<Eigen::MatrixXd> block);

}  // namespace tenter
