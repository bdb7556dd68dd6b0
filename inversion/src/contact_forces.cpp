// SPDX-License-Identifier: GPL-3.0-or-later
#include "contact_forces.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

namespace tenter {
namespace {

using Mat36 = Eigen::Matrix<double, 3, 6>;

constexpr double kLargestCorrection = 1e-2;

/// Displacement of a point under unit rigid motions.
Mat36 rigidMotions(const Vec3& place, double size) {
  Mat36 m;
  m.leftCols<3>().setIdentity();
  for (int a = 0; a < 3; ++a) m.col(3 + a) = Vec3::Unit(a).cross(place) / size;
  return m;
}

}  // namespace

Result<ContactForces> ContactForces::create(const InverseShell& shell, const Points3& pose,
                                            const BalanceSetup& setup) {
  auto system = shell.system(pose, setup.fixed);
  if (!system) return system.error();
  ContactForces out(system->hessian(system->restState(), Projection::kNone));
  out.pose_ = pose;
  out.vertex_weight_N_ = shell.weight_N(pose) / shell.vertexCount();
  out.fixed_count_ = static_cast<int>(setup.fixed.size());
  // Free vertices come first among the degrees of freedom, in order.
  out.first_dof_.assign(static_cast<std::size_t>(shell.vertexCount()), 0);
  for (const int v : setup.fixed) out.first_dof_[v] = -1;
  int next = 0;
  for (int& dof : out.first_dof_) {
    if (dof < 0) continue;
    dof = next;
    next += 3;
  }
  require(next + shell.rotationCount() == out.h_.size, "ContactForces: another order of dofs");
  return out;
}

ContactForces::Solution ContactForces::solve(const Eigen::VectorXd& gradient,
                                             const BalanceSetup& setup,
                                             const std::function<bool()>& stop) {
  Eigen::VectorXd load = Eigen::VectorXd::Zero(h_.size);
  const Eigen::Index positions = pose_.size();
  for (std::size_t v = 0; v < first_dof_.size(); ++v) {
    if (first_dof_[v] >= 0)
      load.segment<3>(first_dof_[v]) = -gradient.segment<3>(3 * static_cast<Eigen::Index>(v));
  }
  load.tail(gradient.size() - positions) = -gradient.tail(gradient.size() - positions);
  const double offset_N = setup.load * setup.offset * vertex_weight_N_;
  std::vector<LoadCone> cones;
  for (const Contact& c : setup.contacts) {
    cones.push_back({first_dof_[c.vertex], c.normal, setup.friction_share * c.friction});
    load.segment<3>(first_dof_[c.vertex]) += offset_N * c.normal;
  }
  ContactLoadResult r = solveContactLoad(h_, load, cones, cholesky_, stop);
  Solution out;
  out.converged = r.converged;
  out.factorizations = r.factorizations;
  out.forces = std::move(r.forces);
  for (std::size_t i = 0; i < cones.size(); ++i)
    out.forces.col(static_cast<Eigen::Index>(i)) += offset_N * cones[i].normal;
  out.motion = Points3::Zero(3, pose_.cols());
  for (std::size_t v = 0; v < first_dof_.size(); ++v) {
    if (first_dof_[v] >= 0)
      out.motion.col(static_cast<Eigen::Index>(v)) = r.motion.segment<3>(first_dof_[v]);
  }
  if (fixed_count_ == 0) balanceRigidMotions(gradient, setup, out.forces);
  return out;
}

/// Without fixed vertices no rest shape can mend forces whose sum or torque does not balance, so
/// what rounding leaves of them is shared out in proportion to the forces themselves.
void ContactForces::balanceRigidMotions(const Eigen::VectorXd& gradient, const BalanceSetup& setup,
                                        Points3& forces) const {
  const double size = sizeOf(pose_);
  const Vec3 centre = pose_.rowwise().mean();
  Eigen::Matrix<double, 6, 1> missing = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> share = Eigen::Matrix<double, 6, 6>::Zero();
  for (Eigen::Index v = 0; v < pose_.cols(); ++v)
    missing += rigidMotions(pose_.col(v) - centre, size).transpose() * gradient.segment<3>(3 * v);
  std::vector<Mat36> motions;
  for (std::size_t i = 0; i < setup.contacts.size(); ++i) {
    const Vec3 force = forces.col(static_cast<Eigen::Index>(i));
    motions.push_back(rigidMotions(pose_.col(setup.contacts[i].vertex) - centre, size));
    missing -= motions.back().transpose() * force;
    share += force.norm() * motions.back().transpose() * motions.back();
  }
  const Eigen::Matrix<double, 6, 1> motion = share.ldlt().solve(missing);
  // More than that is no rounding: the forces do not carry the load.
  if (!motion.allFinite() || motion.norm() > kLargestCorrection) return;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    auto force = forces.col(static_cast<Eigen::Index>(i));
    force += Vec3(force.norm() * (motions[i] * motion));
  }
}

}  // namespace tenter
