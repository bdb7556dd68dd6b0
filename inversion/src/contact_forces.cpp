// SPDX-License-Identifier: GPL-3.0-or-later
#include "contact_forces.h"

#include <algorithm>
#include <utility>

#include "free_coordinates.h"
#include "second_order_cone.h"

namespace tenter {
namespace {

/// Of a vertex's mean weight: a force this far outside its cone is on its border.
constexpr double kOnBorder = 1e-9;

}  // namespace

Points3 projectedIntoCones(const RestNewton& problem, int vertex_count, const Points3& forces,
                           const ConeMargin& margin, double load) {
  const auto& contacts = problem.contacts();
  const double offset_N = load * margin.offset * problem.weight_N() / vertex_count;
  Points3 out = forces;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    auto force = out.col(static_cast<Eigen::Index>(i));
    const Vec3 apex = offset_N * contacts[i].normal;
    force = apex + projectOnFrictionCone(force - apex, contacts[i].normal,
                                         margin.friction_share * contacts[i].friction)
                       .point;
  }
  return out;
}

bool insideCones(const RestNewton& problem, int vertex_count, const Points3& forces,
                 const ConeMargin& margin, double load) {
  if (forces.cols() == 0) return true;
  const Points3 inside = projectedIntoCones(problem, vertex_count, forces, margin, load);
  return (forces - inside).colwise().norm().maxCoeff() <=
         kOnBorder * load * problem.weight_N() / vertex_count;
}

Result<ContactForces> ContactForces::create(const InverseShell& shell, const RestNewton& problem) {
  auto system = shell.system(problem.pose(), problem.fixed());
  if (!system) return system.error();
  ContactForces out(system->hessian(system->restState(), Projection::kNone));
  out.contacts_ = problem.contacts();
  out.vertex_weight_N_ = problem.weight_N() / shell.vertexCount();
  out.first_dof_ = firstDofs(shell.vertexCount(), problem.fixed());
  const auto free = std::ranges::count_if(out.first_dof_, [](int dof) { return dof >= 0; });
  require(3 * free + shell.rotationCount() == out.h_.size, "ContactForces: another order of dofs");
  return out;
}

ContactForces::Solution ContactForces::solve(const Eigen::VectorXd& gradient,
                                             const ConeMargin& margin, double load,
                                             const std::function<bool()>& stop) {
  Eigen::VectorXd load_N = Eigen::VectorXd::Zero(h_.size);
  const auto positions = static_cast<Eigen::Index>(3 * first_dof_.size());
  for (std::size_t v = 0; v < first_dof_.size(); ++v) {
    if (first_dof_[v] >= 0)
      load_N.segment<3>(first_dof_[v]) = -gradient.segment<3>(3 * static_cast<Eigen::Index>(v));
  }
  load_N.tail(gradient.size() - positions) = -gradient.tail(gradient.size() - positions);
  const double offset_N = load * margin.offset * vertex_weight_N_;
  std::vector<LoadCone> cones;
  for (const Contact& c : contacts_) {
    cones.push_back({first_dof_[c.vertex], c.normal, margin.friction_share * c.friction});
    load_N.segment<3>(first_dof_[c.vertex]) += offset_N * c.normal;
  }
  ContactLoadResult r = solveContactLoad(h_, load_N, cones, cholesky_, stop);
  Solution out;
  out.converged = r.converged;
  out.factorizations = r.factorizations;
  out.motion = Eigen::VectorXd::Zero(gradient.size());
  if (r.motion.size() == h_.size) {
    for (std::size_t v = 0; v < first_dof_.size(); ++v)
      if (first_dof_[v] >= 0)
        out.motion.segment<3>(3 * static_cast<Eigen::Index>(v)) =
            r.motion.segment<3>(first_dof_[v]);
    out.motion.tail(gradient.size() - positions) = r.motion.tail(gradient.size() - positions);
  }
  out.forces = std::move(r.forces);
  for (std::size_t i = 0; i < cones.size(); ++i)
    out.forces.col(static_cast<Eigen::Index>(i)) += offset_N * cones[i].normal;
  return out;
}

}  // namespace tenter
