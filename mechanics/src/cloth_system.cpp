// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/cloth_system.h"

#include <algorithm>
#include <cmath>

#include "cloth_system_impl.h"

namespace tenter {
namespace {

/// Supports this near gravity's line, in the sheet's size, do not stop it from turning.
constexpr double kOnAxis = 1e-9;

bool heldByOneSupport(const DofMap& map, const Triangle& t) {
  const auto moves = [&](int node) { return map.node_dof[node] >= 0; };
  if (moves(t[0]) || moves(t[1]) || moves(t[2])) return false;
  return map.node_clip[t[0]] == map.node_clip[t[1]] && map.node_clip[t[1]] == map.node_clip[t[2]];
}

/// Triangles that one clip or the fixed nodes hold entirely.
Result<std::vector<bool>> rigidTriangles(const SheetMesh& sheet, const SystemSetup& setup) {
  auto map = DofMap::create(sheet.nodeCount(), 0, setup);
  if (!map) return map.error();
  std::vector<bool> rigid(sheet.triangleCount());
  for (int f = 0; f < sheet.triangleCount(); ++f)
    rigid[f] = heldByOneSupport(*map, sheet.rest.triangles[f]);
  return rigid;
}

double pointEnergy(const ElasticCord& cord, double length) {
  const double strain = length / cord.rest_length_m - 1.0;
  return strain > 0.0 ? 0.5 * cord.stiffness_N * strain * strain * cord.rest_length_m : 0.0;
}

double tension(const ElasticCord& cord, double length) {
  return std::max(0.0, cord.stiffness_N * (length / cord.rest_length_m - 1.0));
}

/// d2/dA2 of the cord's energy at attachment point A.
Mat3 cordHessian(const ElasticCord& cord, const Vec3& from_pulley) {
  const double length = from_pulley.norm();
  const double t = tension(cord, length);
  if (t <= 0.0) return Mat3::Zero();
  const Vec3 d = from_pulley / length;
  const Mat3 along = d * d.transpose();
  return cord.stiffness_N / cord.rest_length_m * along + t / length * (Mat3::Identity() - along);
}

}  // namespace

ClothSystem::Impl::Impl(SheetMesh sheet_mesh, ClothTerms cloth_terms, SystemSetup system_setup,
                        DofMap dof_map)
    : sheet(std::move(sheet_mesh)),
      setup(std::move(system_setup)),
      map(std::move(dof_map)),
      terms(std::move(cloth_terms.terms)),
      rotation_edge(std::move(cloth_terms.rotation_edge)),
      nodal_mass(lumpedMass(sheet, setup.areal_density_kg_per_m2)) {
  for (const auto& term : terms) {
    parameter_offset.push_back(parameter_count);
    parameter_count += term->parameterCount();
  }
  terms.push_back(makeGravityTerm(nodal_mass, setup.gravity_m_per_s2));
  parameter_offset.push_back(parameter_count);
  assembler = std::make_unique<HessianAssembler>(map, terms);
  gradient_q.setZero(map.coordinateCount());
  for (const ClipSetup& clip : setup.clips) {
    Vec3 centre = clip.centre_of_mass_m;
    double radius = 0.0;
    if (!clip.nodes.empty()) {
      centre.setZero();
      for (int n : clip.nodes) centre += sheet.rest.positions.col(n);
      centre /= static_cast<double>(clip.nodes.size());
      for (int n : clip.nodes)
        radius = std::max(radius, (sheet.rest.positions.col(n) - centre).norm());
    }
    pivot_local.push_back(centre);
    frames.pivot.push_back(centre);
    frames.rotation_scale_m.push_back(std::max(radius, 1e-3));
  }
}

void ClothSystem::Impl::updateFrames(const ClothState& state) const {
  for (std::size_t c = 0; c < setup.clips.size(); ++c)
    frames.pivot[c] = state.clips[c] * pivot_local[c];
}

void ClothSystem::Impl::coordinateGradient(const Eigen::VectorXd& q) const {
  gradient_q.setZero();
  for (const auto& term : terms) term->addGradient(q, gradient_q);
}

double ClothSystem::Impl::clipPotential(const ClothState& state) const {
  double energy = 0.0;
  for (std::size_t c = 0; c < setup.clips.size(); ++c) {
    const ClipSetup& clip = setup.clips[c];
    if (!clip.free) continue;
    const Eigen::Isometry3d& pose = state.clips[c];
    energy -= clip.mass_kg * setup.gravity_m_per_s2.dot(pose * clip.centre_of_mass_m);
    for (const ClipForce& f : clip.forces) energy -= f.force_N.dot(pose * f.attachment_m);
    for (const ElasticCord& cord : clip.cords) {
      energy += pointEnergy(cord, (pose * cord.attachment_m - cord.pulley_m).norm());
    }
  }
  return energy;
}

template <class Visitor>
void ClothSystem::Impl::forEachClipPoint(const ClothState& state, int c, Visitor visit) const {
  const ClipSetup& clip = setup.clips[c];
  const Eigen::Isometry3d& pose = state.clips[c];
  visit(Vec3(pose * clip.centre_of_mass_m), Vec3(-clip.mass_kg * setup.gravity_m_per_s2),
        Mat3(Mat3::Zero()));
  for (const ClipForce& f : clip.forces)
    visit(Vec3(pose * f.attachment_m), Vec3(-f.force_N), Mat3(Mat3::Zero()));
  for (const ElasticCord& cord : clip.cords) {
    const Vec3 place = pose * cord.attachment_m;
    const Vec3 from_pulley = place - cord.pulley_m;
    const double length = from_pulley.norm();
    visit(place, Vec3(tension(cord, length) / length * from_pulley),
          cordHessian(cord, from_pulley));
  }
}

void ClothSystem::Impl::reduceGradient(const ClothState& state, Eigen::VectorXd& dofs) const {
  dofs.setZero(map.dof_count);
  for (int i = 0; i < map.node_count; ++i) {
    if (map.node_dof[i] >= 0) {
      dofs.segment(map.node_dof[i], map.dofs_per_node) =
          gradient_q.segment(3 * i, map.dofs_per_node);
    }
  }
  dofs.segment(map.rotation_dof, map.rotation_count) = gradient_q.tail(map.rotation_count);
  for (std::size_t c = 0; c < setup.clips.size(); ++c) {
    if (map.clip_dof[c] < 0) continue;
    auto out = dofs.segment<6>(map.clip_dof[c]);
    const auto add = [&](const Vec3& place, const Vec3& g) {
      out.head<3>() += g;
      out.tail<3>() += (place - frames.pivot[c]).cross(g) / frames.rotation_scale_m[c];
    };
    for (int n : setup.clips[c].nodes) add(state.q.segment<3>(3 * n), gradient_q.segment<3>(3 * n));
    forEachClipPoint(state, static_cast<int>(c),
                     [&](const Vec3& p, const Vec3& g, const Mat3&) { add(p, g); });
  }
}

void ClothSystem::Impl::addClipHessians(const ClothState& state, Projection projection) const {
  for (std::size_t c = 0; c < setup.clips.size(); ++c) {
    if (map.clip_dof[c] < 0) continue;
    const double scale = frames.rotation_scale_m[c];
    Eigen::Matrix<double, 6, 6> block = Eigen::Matrix<double, 6, 6>::Zero();
    Mat3 geometric = Mat3::Zero();
    for (int n : setup.clips[c].nodes) {
      const Vec3 arm = state.q.segment<3>(3 * n) - frames.pivot[c];
      geometric += rotationGeometricHessian(gradient_q.segment<3>(3 * n), arm, scale);
    }
    forEachClipPoint(state, static_cast<int>(c),
                     [&](const Vec3& place, const Vec3& g, const Mat3& h) {
                       const Vec3 arm = place - frames.pivot[c];
                       const auto j = clipJacobian(arm, scale);
                       block += j.transpose() * h * j;
                       geometric += rotationGeometricHessian(g, arm, scale);
                     });
    if (projection == Projection::kPositiveSemiDefinite) projectPositiveSemiDefinite(geometric);
    block.bottomRightCorner<3, 3>() += geometric;
    assembler->addClipBlock(static_cast<int>(c), block);
  }
}

Result<ClothSystem> ClothSystem::create(SheetMesh sheet, const ClothModel& model,
                                        const ClothLaws& laws, SystemSetup setup) {
  auto rigid = rigidTriangles(sheet, setup);
  if (!rigid) return rigid.error();
  ClothLaws used = laws;
  if (setup.planar) used.bending = nullptr;
  auto terms = makeClothTerms(model, used, sheet, *rigid, setup.edge_rotations);
  if (!terms) return terms.error();
  return create(std::move(sheet), std::move(*terms), std::move(setup));
}

Result<ClothSystem> ClothSystem::create(SheetMesh sheet, ClothTerms terms, SystemSetup setup) {
  if (setup.planar &&
      std::any_of(setup.clips.begin(), setup.clips.end(), [](auto& c) { return c.free; })) {
    return badInput("", "supports", "a planar system cannot have free clips");
  }
  auto map = DofMap::create(sheet.nodeCount(), static_cast<int>(terms.rotation_edge.size()), setup);
  if (!map) return map.error();
  return ClothSystem(std::make_unique<Impl>(std::move(sheet), std::move(terms), std::move(setup),
                                            std::move(*map)));
}

ClothSystem::ClothSystem(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ClothSystem::ClothSystem(ClothSystem&&) noexcept = default;
ClothSystem& ClothSystem::operator=(ClothSystem&&) noexcept = default;
ClothSystem::~ClothSystem() = default;

const SheetMesh& ClothSystem::sheet() const { return impl_->sheet; }
const SystemSetup& ClothSystem::setup() const { return impl_->setup; }
int ClothSystem::dofCount() const { return impl_->map.dof_count; }
int ClothSystem::coordinateCount() const { return impl_->map.coordinateCount(); }
int ClothSystem::parameterCount() const { return impl_->parameter_count; }
const std::vector<std::unique_ptr<EnergyTerm>>& ClothSystem::terms() const { return impl_->terms; }

ClothState ClothSystem::restState() const {
  ClothState state;
  state.q = Eigen::VectorXd::Zero(coordinateCount());
  state.q.head(3 * impl_->map.node_count) = impl_->sheet.rest.positions.reshaped();
  state.clips.assign(impl_->setup.clips.size(), Eigen::Isometry3d::Identity());
  return state;
}

void ClothSystem::setClipPose(ClothState& state, int clip,
                              const Eigen::Isometry3d& rig_from_clip) const {
  state.clips[clip] = rig_from_clip;
  for (int n : impl_->setup.clips[clip].nodes) {
    state.q.segment<3>(3 * n) = rig_from_clip * Vec3(impl_->sheet.rest.positions.col(n));
  }
}

void ClothSystem::setCordRestLength(int clip, int cord, double rest_length_m) {
  require(rest_length_m > 0.0,
          "a cord's rest length must be positive, not " + std::to_string(rest_length_m));
  impl_->setup.clips[clip].cords[cord].rest_length_m = rest_length_m;
}

double ClothSystem::cordTension_N(const ClothState& state, int clip, int cord) const {
  const ElasticCord& c = impl_->setup.clips[clip].cords[cord];
  return tension(c, (state.clips[clip] * c.attachment_m - c.pulley_m).norm());
}

Vec3 ClothSystem::cordDirection(const ClothState& state, int clip, int cord) const {
  const ElasticCord& c = impl_->setup.clips[clip].cords[cord];
  return (c.pulley_m - state.clips[clip] * c.attachment_m).normalized();
}

double ClothSystem::energy(const ClothState& state) const {
  double energy = impl_->clipPotential(state);
  for (const auto& term : impl_->terms) energy += term->energy(state.q);
  return energy;
}

void ClothSystem::gradient(const ClothState& state, Eigen::VectorXd& dofs) const {
  impl_->updateFrames(state);
  impl_->coordinateGradient(state.q);
  impl_->reduceGradient(state, dofs);
}

const SparseLower& ClothSystem::hessian(const ClothState& state, Projection projection) const {
  impl_->updateFrames(state);
  impl_->assembler->assemble(state.q, impl_->frames, projection);
  impl_->exact_at.resize(0);
  if (std::any_of(impl_->map.clip_dof.begin(), impl_->map.clip_dof.end(),
                  [](int d) { return d >= 0; })) {
    impl_->coordinateGradient(state.q);
    impl_->addClipHessians(state, projection);
  }
  return impl_->assembler->matrix();
}

void ClothSystem::advance(ClothState& state, const Eigen::VectorXd& step, double scale) const {
  const DofMap& map = impl_->map;
  for (int i = 0; i < map.node_count; ++i) {
    if (map.node_dof[i] < 0) continue;
    state.q.segment(3 * i, map.dofs_per_node) +=
        scale * step.segment(map.node_dof[i], map.dofs_per_node);
  }
  state.q.tail(map.rotation_count) += scale * step.segment(map.rotation_dof, map.rotation_count);
  for (std::size_t c = 0; c < map.clip_dof.size(); ++c) {
    if (map.clip_dof[c] < 0) continue;
    const Vec3 dt = scale * step.segment<3>(map.clip_dof[c]);
    const Vec3 w = scale * step.segment<3>(map.clip_dof[c] + 3) / impl_->frames.rotation_scale_m[c];
    const Vec3 pivot = state.clips[c] * impl_->pivot_local[c];
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    if (w.norm() > 0.0)
      pose.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    pose.translation() = pivot + dt - pose.linear() * pivot;
    pose = pose * state.clips[c];
    // Many small steps must not let the rotation drift away from orthonormal.
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
    setClipPose(state, static_cast<int>(c), pose);
  }
}

int ClothSystem::swivelDof(const ClothState& state) const {
  const SystemSetup& setup = impl_->setup;
  const double weight = setup.gravity_m_per_s2.norm();
  if (setup.planar || setup.fixed_nodes.empty() || !setup.clips.empty() || !(weight > 0.0))
    return -1;
  const Vec3 axis = setup.gravity_m_per_s2 / weight;
  const Vec3 pin = state.q.segment<3>(3 * setup.fixed_nodes.front());
  int most = -1;
  double furthest = 0.0;
  for (int i = 0; i < impl_->map.node_count; ++i) {
    const Vec3 motion = axis.cross(Vec3(state.q.segment<3>(3 * i) - pin));
    int along = 0;
    const double moved = motion.cwiseAbs().maxCoeff(&along);
    if (!(moved > furthest)) continue;
    furthest = moved;
    if (impl_->map.node_dof[i] >= 0) most = impl_->map.node_dof[i] + along;
  }
  for (const int n : setup.fixed_nodes) {
    if (axis.cross(Vec3(state.q.segment<3>(3 * n) - pin)).norm() > kOnAxis * furthest) return -1;
  }
  return most;
}

Eigen::VectorXd ClothSystem::dofMass() const {
  const DofMap& map = impl_->map;
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(map.dof_count);
  for (int i = 0; i < map.node_count; ++i) {
    if (map.node_dof[i] >= 0)
      mass.segment(map.node_dof[i], map.dofs_per_node).setConstant(impl_->nodal_mass[i]);
  }
  for (std::size_t c = 0; c < map.clip_dof.size(); ++c) {
    if (map.clip_dof[c] < 0) continue;
    double m = impl_->setup.clips[c].mass_kg;
    for (int n : impl_->setup.clips[c].nodes) m += impl_->nodal_mass[n];
    mass.segment<6>(map.clip_dof[c]).setConstant(m);
  }
  return mass;
}

double ClothSystem::totalWeight_N() const {
  return impl_->nodal_mass.sum() * impl_->setup.gravity_m_per_s2.norm();
}

double ClothSystem::lightestFreeNodeWeight_N() const {
  double lightest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < impl_->map.node_count; ++i) {
    if (impl_->map.node_dof[i] >= 0) lightest = std::min(lightest, impl_->nodal_mass[i]);
  }
  const double g = impl_->setup.gravity_m_per_s2.norm();
  return std::isfinite(lightest) ? lightest * (g > 0.0 ? g : kStandardGravity_m_per_s2) : 0.0;
}

}  // namespace tenter
