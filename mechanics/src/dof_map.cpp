// SPDX-License-Identifier: GPL-3.0-or-later
#include "dof_map.h"

namespace tenter {
namespace {

constexpr int kFree = -1;
constexpr int kFixed = -2;

Error supportError(int node, const std::string& reason) {
  return badInput("", "node " + std::to_string(node), reason);
}

}  // namespace

Result<DofMap> DofMap::create(int node_count, int rotation_count, const SystemSetup& setup) {
  std::vector<int> support(node_count, kFree);
  const auto claim = [&](int node, int by) -> Result<void> {
    if (node < 0 || node >= node_count) {
      return supportError(node,
                          "held, but the mesh has nodes 0 to " + std::to_string(node_count - 1));
    }
    if (support[node] != kFree && support[node] != by)
      return supportError(node, "held by two supports");
    support[node] = by;
    return {};
  };
  for (std::size_t c = 0; c < setup.clips.size(); ++c) {
    for (int node : setup.clips[c].nodes) {
      if (auto r = claim(node, static_cast<int>(c)); !r) return r.error();
    }
  }
  for (int node : setup.fixed_nodes) {
    if (auto r = claim(node, kFixed); !r) return r.error();
  }

  DofMap map;
  map.node_count = node_count;
  map.rotation_count = rotation_count;
  map.dofs_per_node = setup.planar ? 2 : 3;
  map.node_dof.assign(node_count, -1);
  map.node_clip.assign(node_count, -1);
  map.node_held.assign(node_count, -1);
  map.clip_dof.assign(setup.clips.size(), -1);
  int next = 0;
  for (int i = 0; i < node_count; ++i) {
    const bool on_clip = support[i] >= 0;
    if (on_clip) map.node_clip[i] = support[i];
    if (support[i] == kFree) {
      map.node_dof[i] = next;
      next += map.dofs_per_node;
    } else if (!on_clip || !setup.clips[support[i]].free) {
      map.node_held[i] = map.heldCount();
      map.held_nodes.push_back(i);
    }
  }
  map.rotation_dof = next;
  next += rotation_count;
  for (std::size_t c = 0; c < setup.clips.size(); ++c) {
    if (!setup.clips[c].free) continue;
    map.clip_dof[c] = next;
    next += 6;
  }
  map.dof_count = next;
  if (next == 0)
    return badInput("", "supports", "every node is held: nothing is left to solve for");
  return map;
}

Eigen::Matrix<double, 3, 6> clipJacobian(const Vec3& arm_m, double rotation_scale_m) {
  const Vec3 r = arm_m / rotation_scale_m;
  Eigen::Matrix<double, 3, 6> j;
  j << 1, 0, 0, 0, r.z(), -r.y(),  //
      0, 1, 0, -r.z(), 0, r.x(),   //
      0, 0, 1, r.y(), -r.x(), 0;
  return j;
}

Mat3 rotationGeometricHessian(const Vec3& g, const Vec3& arm_m, double rotation_scale_m) {
  const Mat3 outer = g * arm_m.transpose();
  return (0.5 * (outer + outer.transpose()) - g.dot(arm_m) * Mat3::Identity()) /
         (rotation_scale_m * rotation_scale_m);
}

}  // namespace tenter
