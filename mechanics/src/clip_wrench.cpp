// SPDX-License-Identifier: GPL-3.0-or-later
// What the cloth does to its clips, and how that changes with the material and with the clips'
// poses.
#include "cloth_system_impl.h"

namespace tenter {
namespace {

using PoseJacobian = Eigen::Matrix<double, 3, 6>;

/// d(x)/d(translation, rotation vector about the rig's origin) of a point that moves rigidly.
PoseJacobian rigidJacobian(const Vec3& x) { return clipJacobian(x, 1.0); }

}  // namespace

void ClothSystem::Impl::ensureExact(const ClothSystem& system, const ClothState& state) const {
  if (exact_at.size() == state.q.size() && exact_at == state.q) return;
  system.hessian(state, Projection::kNone);
  exact_at = state.q;
}

Eigen::Matrix<double, 3, 6> ClothSystem::Impl::poseJacobian(const ClothState& state,
                                                            int node) const {
  return rigidJacobian(state.q.segment<3>(3 * node));
}

Wrench ClothSystem::clipWrench(const ClothState& state, int clip) const {
  impl_->coordinateGradient(state.q);
  const ClipSetup& c = impl_->setup.clips[clip];
  Wrench w;
  w.force_N = c.mass_kg * impl_->setup.gravity_m_per_s2;
  w.torque_N_m = Vec3(state.clips[clip] * c.centre_of_mass_m).cross(w.force_N);
  for (int n : c.nodes) {
    const Vec3 f = -impl_->gradient_q.segment<3>(3 * n);
    w.force_N += f;
    w.torque_N_m += Vec3(state.q.segment<3>(3 * n)).cross(f);
  }
  return w;
}

void ClothSystem::gradientByParameter(const ClothState& state, Eigen::MatrixXd& derivative) const {
  const DofMap& map = impl_->map;
  Eigen::MatrixXd by_coordinate =
      Eigen::MatrixXd::Zero(map.coordinateCount(), impl_->parameter_count);
  for (std::size_t t = 0; t < impl_->terms.size(); ++t) {
    const int count = impl_->terms[t]->parameterCount();
    if (count > 0) {
      impl_->terms[t]->addParameterGradient(
          state.q, by_coordinate.middleCols(impl_->parameter_offset[t], count));
    }
  }
  derivative.setZero(map.dof_count, impl_->parameter_count);
  for (int i = 0; i < map.node_count; ++i) {
    if (map.node_dof[i] >= 0) {
      derivative.middleRows(map.node_dof[i], map.dofs_per_node) =
          by_coordinate.middleRows(3 * i, map.dofs_per_node);
    }
  }
  derivative.middleRows(map.rotation_dof, map.rotation_count) =
      by_coordinate.bottomRows(map.rotation_count);
  impl_->updateFrames(state);
  for (std::size_t c = 0; c < map.clip_dof.size(); ++c) {
    if (map.clip_dof[c] < 0) continue;
    for (int n : impl_->setup.clips[c].nodes) {
      const Vec3 arm = state.q.segment<3>(3 * n) - impl_->frames.pivot[c];
      derivative.middleRows<6>(map.clip_dof[c]) +=
          clipJacobian(arm, impl_->frames.rotation_scale_m[c]).transpose() *
          by_coordinate.middleRows<3>(3 * n);
    }
  }
}

Eigen::MatrixXd ClothSystem::clipWrenchByParameter(const ClothState& state, int clip,
                                                   const Eigen::MatrixXd& dofs_by_parameter) const {
  const ClipSetup& c = impl_->setup.clips[clip];
  require(!c.free,
          "clipWrenchByParameter: clip " + c.id + " is free: its wrench is given by its cords");
  impl_->ensureExact(*this, state);
  Eigen::MatrixXd by_coordinate = Eigen::MatrixXd::Zero(coordinateCount(), impl_->parameter_count);
  for (std::size_t t = 0; t < impl_->terms.size(); ++t) {
    const int count = impl_->terms[t]->parameterCount();
    if (count > 0) {
      impl_->terms[t]->addParameterGradient(
          state.q, by_coordinate.middleCols(impl_->parameter_offset[t], count));
    }
  }
  const auto& held = impl_->assembler->held();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(6, dofs_by_parameter.cols());
  for (int n : c.nodes) {
    const int row = impl_->map.node_held[n];
    Eigen::MatrixXd force_derivative = -by_coordinate.middleRows<3>(3 * n);
    for (int i = 0; i < 3; ++i) {
      for (HessianAssembler::HeldMatrix::InnerIterator it(held, row + i); it; ++it) {
        if (it.col() < impl_->map.dof_count)
          force_derivative.row(i) -= it.value() * dofs_by_parameter.row(it.col());
      }
    }
    result += impl_->poseJacobian(state, n).transpose() * force_derivative;
  }
  return result;
}

Eigen::MatrixXd ClothSystem::gradientByPose(const ClothState& state, int clip) const {
  const ClipSetup& c = impl_->setup.clips[clip];
  require(!c.free, "gradientByPose: clip " + c.id + " is free");
  impl_->ensureExact(*this, state);
  const auto& held = impl_->assembler->held();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(dofCount(), 6);
  for (int n : c.nodes) {
    const auto j = impl_->poseJacobian(state, n);
    for (int i = 0; i < 3; ++i) {
      for (HessianAssembler::HeldMatrix::InnerIterator it(held, impl_->map.node_held[n] + i); it;
           ++it) {
        if (it.col() < impl_->map.dof_count) result.row(it.col()) += it.value() * j.row(i);
      }
    }
  }
  return result;
}

Eigen::MatrixXd ClothSystem::clipWrenchByPose(const ClothState& state, int clip, int moved_clip,
                                              const Eigen::MatrixXd& dofs_by_pose) const {
  impl_->ensureExact(*this, state);
  impl_->coordinateGradient(state.q);
  const auto& held = impl_->assembler->held();
  const int dof_count = impl_->map.dof_count;
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(6, 6);
  for (int n : impl_->setup.clips[clip].nodes) {
    Eigen::MatrixXd force_derivative = Eigen::MatrixXd::Zero(3, 6);
    for (int i = 0; i < 3; ++i) {
      for (HessianAssembler::HeldMatrix::InnerIterator it(held, impl_->map.node_held[n] + i); it;
           ++it) {
        if (it.col() < dof_count) {
          force_derivative.row(i) -= it.value() * dofs_by_pose.row(it.col());
          continue;
        }
        const int coordinate = static_cast<int>(it.col()) - dof_count;
        const int other = impl_->map.held_nodes[coordinate / 3];
        if (impl_->map.node_clip[other] != moved_clip) continue;
        force_derivative.row(i) -=
            it.value() * impl_->poseJacobian(state, other).row(coordinate % 3);
      }
    }
    result += impl_->poseJacobian(state, n).transpose() * force_derivative;
    if (clip == moved_clip) {
      // The torque arm moves too: d(x cross f) = dx cross f + x cross df.
      const Vec3 f = -impl_->gradient_q.segment<3>(3 * n);
      Mat3 cross;
      cross << 0, f.z(), -f.y(), -f.z(), 0, f.x(), f.y(), -f.x(), 0;  // v -> v x f
      result.bottomRows<3>() += cross * impl_->poseJacobian(state, n);
    }
  }
  return result;
}

Eigen::MatrixXd ClothSystem::positionsByDof(const ClothState& state,
                                            const Eigen::MatrixXd& dofs_by_parameter) const {
  const DofMap& map = impl_->map;
  impl_->updateFrames(state);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * map.node_count, dofs_by_parameter.cols());
  for (int i = 0; i < map.node_count; ++i) {
    if (map.node_dof[i] >= 0) {
      result.middleRows(3 * i, map.dofs_per_node) =
          dofs_by_parameter.middleRows(map.node_dof[i], map.dofs_per_node);
    } else if (map.onFreeClip(i)) {
      const int clip = map.node_clip[i];
      const Vec3 arm = state.q.segment<3>(3 * i) - impl_->frames.pivot[clip];
      result.middleRows<3>(3 * i) = clipJacobian(arm, impl_->frames.rotation_scale_m[clip]) *
                                    dofs_by_parameter.middleRows<6>(map.clip_dof[clip]);
    }
  }
  return result;
}

}  // namespace tenter
