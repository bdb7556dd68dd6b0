// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/energy_terms.h"
#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// A constant point force on a clip: a cord whose tension is known.
struct ClipForce {
  Vec3 attachment_m = Vec3::Zero();  ///< In the clip's frame.
  Vec3 force_N = Vec3::Zero();       ///< In the rig's frame.
};

/// A cord from a fixed pulley to a clip: tension = max(0, stiffness (length / rest_length - 1)),
/// none when slack.
struct ElasticCord {
  Vec3 attachment_m = Vec3::Zero();  ///< In the clip's frame.
  Vec3 pulley_m = Vec3::Zero();      ///< In the rig's frame.
  double rest_length_m = 1.0;
  double stiffness_N = 1.0;  ///< EA.
};

/// A rigid body that holds nodes. Its pose is the identity where the cloth lies at rest, so a held
/// node's place in the clip's frame is its rest position. Prescribed clips stay where the state
/// puts them; free ones have six degrees of freedom.
struct ClipSetup {
  std::string id;
  std::vector<int> nodes;
  bool free = false;
  double mass_kg = 0.0;
  Vec3 centre_of_mass_m = Vec3::Zero();  ///< In the clip's frame.
  std::vector<ClipForce> forces;
  std::vector<ElasticCord> cords;
};

struct SystemSetup {
  double areal_density_kg_per_m2 = 0.0;
  Vec3 gravity_m_per_s2 = kDefaultGravity;
  std::vector<ClipSetup> clips;
  std::vector<int> fixed_nodes;  ///< Held where the state puts them, outside any clip.
  bool planar = false;  ///< Nodes move in x and y only and bending is left out: in-plane tests.
  EdgeRotations edge_rotations = EdgeRotations::kAutomatic;
};

/// A configuration: all coordinates (EnergyTerm) and the clips' poses; held nodes agree with the
/// poses.
struct ClothState {
  Eigen::VectorXd q;                     ///< 3 nodes, then edge rotations [m].
  std::vector<Eigen::Isometry3d> clips;  ///< rig_from_clip.
  Eigen::Map<const Points3> positions(int nodes) const { return {q.data(), 3, nodes}; }
};

/// Force [N] and torque about the rig's origin [N m] that something exerts on a clip.
struct Wrench {
  Vec3 force_N = Vec3::Zero();
  Vec3 torque_N_m = Vec3::Zero();
};

/// Sparse symmetric matrix, lower triangle in compressed columns, pattern fixed at construction.
struct SparseLower {
  int size = 0;
  std::vector<int> column_begin, row;
  std::vector<double> value;
};

/// A sheet, its energies and its supports as a function of the free degrees of freedom. Built once,
/// then used for many states; one instance per thread (it owns scratch memory), laws may be shared.
/// Degrees of freedom: 3 per free node (2 if planar), 1 per edge rotation, 6 per free clip
/// (rig-frame translation [m], then rotation vector about the clip's pivot times `rotationScale_m`,
/// so forces are in newtons).
class ClothSystem {
 public:
  /// Error: a node in two supports, ids out of range, model not for this mesh, no free degree of
  /// freedom.
  static Result<ClothSystem> create(SheetMesh sheet, const ClothModel& model, const ClothLaws& laws,
                                    SystemSetup setup);
  /// With the caller's own terms (the virtual specimen): membrane, bending ...; gravity is added
  /// here.
  static Result<ClothSystem> create(SheetMesh sheet, ClothTerms terms, SystemSetup setup);

  ClothSystem(ClothSystem&&) noexcept;
  ClothSystem& operator=(ClothSystem&&) noexcept;
  ~ClothSystem();

  const SheetMesh& sheet() const;
  const SystemSetup& setup() const;
  int dofCount() const;
  int coordinateCount() const;
  int parameterCount() const;  ///< Membrane law's parameters, then the bending law's.

  ClothState restState() const;
  /// Moves a clip and the nodes that it holds.
  void setClipPose(ClothState& state, int clip, const Eigen::Isometry3d& rig_from_clip) const;
  /// Cords of a free clip may be shortened between solves.
  void setCordRestLength(int clip, int cord, double rest_length_m);
  double cordTension_N(const ClothState& state, int clip, int cord) const;
  Vec3 cordDirection(const ClothState& state, int clip,
                     int cord) const;  ///< From the clip towards the pulley.

  double energy(const ClothState& state) const;
  void gradient(const ClothState& state, Eigen::VectorXd& dofs) const;  ///< dE/d(dof) [N].
  const SparseLower& hessian(const ClothState& state,
                             Projection projection) const;  ///< Valid until the next call.
  /// state += scale * step; clips rotate by the exponential map.
  void advance(ClothState& state, const Eigen::VectorXd& step, double scale) const;

  /// Where nothing stops the sheet from turning about gravity's line through its supports (one
  /// pin): the degree of freedom that this moves most. -1 otherwise.
  int swivelDof(const ClothState& state) const;

  /// What the cloth, its weight on the held nodes and the clip's own weight exert on a clip (cords
  /// and point forces left out): the cords' reaction is minus this.
  Wrench clipWrench(const ClothState& state, int clip) const;
  /// d(clipWrench)/d(parameters), total along the equilibrium path dof(p): 6 x parameters, given
  /// dofs_by_parameter = d(dof)/dp (dofs x parameters).
  Eigen::MatrixXd clipWrenchByParameter(const ClothState& state, int clip,
                                        const Eigen::MatrixXd& dofs_by_parameter) const;
  /// d(clipWrench)/d(pose of a prescribed clip) along the equilibrium path is needed for pose
  /// errors: 6 x 6 per pair; dofs_by_pose from solving with gradientByPose as right-hand side.
  Eigen::MatrixXd gradientByPose(
      const ClothState& state, int clip) const;  ///< d(gradient)/d(pose: translation [m], rotation
                                                 ///< [rad] about the rig's origin), dofs x 6.
  Eigen::MatrixXd clipWrenchByPose(const ClothState& state, int clip, int moved_clip,
                                   const Eigen::MatrixXd& dofs_by_pose) const;

  /// d(gradient)/d(parameters), dofs x parameters.
  void gradientByParameter(const ClothState& state, Eigen::MatrixXd& derivative) const;
  /// d(node positions)/d(parameters) from d(dof)/dp: 3 nodes x parameters (zero rows at prescribed
  /// nodes).
  Eigen::MatrixXd positionsByDof(const ClothState& state,
                                 const Eigen::MatrixXd& dofs_by_parameter) const;

  Eigen::VectorXd dofMass() const;  ///< Lumped mass of each dof [kg]; 0 for edge rotations.
  double totalWeight_N() const;
  double lightestFreeNodeWeight_N() const;
  const std::vector<std::unique_ptr<EnergyTerm>>& terms() const;  ///< Membrane, bending, gravity.

 private:
  struct Impl;
  explicit ClothSystem(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
