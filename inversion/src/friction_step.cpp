// SPDX-License-Identifier: GPL-3.0-or-later
#include "friction_step.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "gmres.h"
#include "second_order_cone.h"

namespace tenter {
namespace {

constexpr int kMaxIterations = 30;
/// A step may raise the residual by this, since bending along a straight line stretches first.
constexpr double kGrowth = 3.0;
constexpr int kMaxCuts = 4;
constexpr double kCut = 0.3;
/// Iterations without a smaller residual after which the step is given up.
constexpr int kPatience = 8;
/// What rounding may leave where the tolerance cannot be reached, in tolerances.
constexpr double kRoundingShare = 1e3;
/// Distance from 1 of the eigenvalues of a projection's derivative: a sticking vertex is held by a
/// stiffness of its own over this.
constexpr double kCap = 1e-8;
constexpr int kMaxProducts = 60;
constexpr double kLinearTolerance = 1e-8;

Vec3 relative(const StepContact& c, const Eigen::VectorXd& v, int dof) {
  return v.segment<3>(dof) - c.still;
}

/// u + mu |u_T| n.
Vec3 deSaxce(const StepContact& c, const Vec3& u) {
  const Vec3 tangent = u - u.dot(c.normal) * c.normal;
  return u + c.friction * tangent.norm() * c.normal;
}

/// d |u_T| / du.
Vec3 slipDirection(const StepContact& c, const Vec3& u) {
  const Vec3 tangent = u - u.dot(c.normal) * c.normal;
  const double speed = tangent.norm();
  return speed > 0.0 ? Vec3(tangent / speed) : Vec3(Vec3::Zero());
}

ContactMode modeOf(const StepContact& c, const Vec3& y) {
  const double n = y.dot(c.normal), t = (y - n * c.normal).norm();
  if (c.friction * t <= -n) return ContactMode::kOff;
  return t <= c.friction * n ? ContactMode::kStuck : ContactMode::kSliding;
}

/// (I - P)^-1 of a symmetric P with eigenvalues in [0, 1], which are kept off 1.
Mat3 complementInverse(const Mat3& p) {
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.compute(p);
  const Vec3 inverse =
      eigen.eigenvalues().unaryExpr([](double e) { return 1.0 / std::max(1.0 - e, kCap); });
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

FrictionStep::FrictionStep(const ClothSystem& system, std::vector<int> first_dof,
                           double tolerance_N)
    : system_(system),
      first_dof_(std::move(first_dof)),
      tolerance_N_(tolerance_N),
      mass_(system.dofMass()),
      matrix_(system.hessian(system.restState(), Projection::kPositiveSemiDefinite)),
      cholesky_(matrix_) {
  for (const int dof : first_dof_) position_dofs_ += dof >= 0 ? 3 : 0;
  stiffness_.resize(matrix_.size);
  for (int c = 0; c < matrix_.size; ++c) stiffness_[c] = matrix_.value[matrix_.column_begin[c]];
}

void FrictionStep::place(const Eigen::VectorXd& dofs, ClothState& state) const {
  for (std::size_t v = 0; v < first_dof_.size(); ++v) {
    if (first_dof_[v] >= 0)
      state.q.segment<3>(3 * static_cast<Eigen::Index>(v)) = dofs.segment<3>(first_dof_[v]);
  }
  const Eigen::Index rotations = dofs.size() - position_dofs_;
  state.q.tail(rotations) = dofs.tail(rotations);
}

Eigen::VectorXd FrictionStep::dofsOf(const ClothState& state) const {
  Eigen::VectorXd dofs(matrix_.size);
  for (std::size_t v = 0; v < first_dof_.size(); ++v) {
    if (first_dof_[v] >= 0)
      dofs.segment<3>(first_dof_[v]) = state.q.segment<3>(3 * static_cast<Eigen::Index>(v));
  }
  const Eigen::Index rotations = dofs.size() - position_dofs_;
  dofs.tail(rotations) = state.q.tail(rotations);
  return dofs;
}

Points3 FrictionStep::spread(const Eigen::VectorXd& dofs) const {
  Points3 out = Points3::Zero(3, static_cast<Eigen::Index>(first_dof_.size()));
  for (std::size_t v = 0; v < first_dof_.size(); ++v) {
    if (first_dof_[v] >= 0) out.col(static_cast<Eigen::Index>(v)) = dofs.segment<3>(first_dof_[v]);
  }
  return out;
}

double FrictionStep::stiffening(const StepEquation& e, const StepContact& contact) const {
  const int dof = first_dof_[contact.vertex];
  return mass_[dof] / e.h_s + e.h_s * stiffness_.segment<3>(dof).mean();
}

void FrictionStep::evaluate(const StepEquation& e, const Eigen::VectorXd& v, ClothState& state,
                            Point& out) const {
  place(e.from + e.h_s * v, state);
  system_.gradient(state, out.forces);
  out.forces.array() +=
      mass_.array() * ((v - e.v_from).array() / e.h_s + e.mass_damping_per_s * v.array());
  if (e.damping != nullptr) {
    Eigen::VectorXd damped;
    multiply(*e.damping, v, damped);
    out.forces += damped;
  }
  if (e.air != nullptr) {
    Points3 drag = Points3::Zero(3, static_cast<Eigen::Index>(first_dof_.size()));
    e.air->add(spread(v), drag, nullptr);
    for (std::size_t k = 0; k < first_dof_.size(); ++k) {
      if (first_dof_[k] >= 0)
        out.forces.segment<3>(first_dof_[k]) -= drag.col(static_cast<Eigen::Index>(k));
    }
  }
  out.residual = out.forces;
  out.projections.resize(e.contacts.size());
  for (std::size_t i = 0; i < e.contacts.size(); ++i) {
    const StepContact& c = e.contacts[i];
    const int dof = first_dof_[c.vertex];
    const Vec3 y =
        Vec3(out.forces.segment<3>(dof)) - stiffening(e, c) * deSaxce(c, relative(c, v, dof));
    const ConeProjection p = projectOnFrictionCone(y, c.normal, c.friction);
    out.residual.segment<3>(dof) -= p.point;
    out.projections[i] = p.derivative;
  }
  out.largest = out.residual.cwiseAbs().maxCoeff();
  out.norm = out.residual.norm();
}

void FrictionStep::addBlock(int dof, const Mat3& block) {
  // Blocks of single vertices are full, and their rows come first in each column.
  for (int c = 0; c < 3; ++c)
    for (int r = c; r < 3; ++r)
      matrix_.value[matrix_.column_begin[dof + c] + (r - c)] += block(r, c);
}

bool FrictionStep::assemble(const StepEquation& e, const Eigen::VectorXd& v,
                            const ClothState& state, Projection projection,
                            const std::vector<Mat3>& blocks) {
  matrix_.value = system_.hessian(state, projection).value;
  const double inertia = 1.0 / (e.h_s * e.h_s) + e.mass_damping_per_s / e.h_s;
  for (int c = 0; c < matrix_.size; ++c)
    matrix_.value[matrix_.column_begin[c]] += inertia * mass_[c];
  if (e.damping != nullptr)
    for (std::size_t k = 0; k < matrix_.value.size(); ++k)
      matrix_.value[k] += e.damping->value[k] / e.h_s;
  if (e.air != nullptr) {
    Points3 drag = Points3::Zero(3, static_cast<Eigen::Index>(first_dof_.size()));
    std::vector<Mat3> resistance(first_dof_.size(), Mat3::Zero());
    e.air->add(spread(v), drag, &resistance);
    for (std::size_t k = 0; k < first_dof_.size(); ++k)
      if (first_dof_[k] >= 0) addBlock(first_dof_[k], resistance[k] / e.h_s);
  }
  for (std::size_t i = 0; i < blocks.size(); ++i)
    addBlock(first_dof_[e.contacts[i].vertex], blocks[i]);
  return cholesky_.factorize(matrix_);
}

bool FrictionStep::direction(const StepEquation& e, const Eigen::VectorXd& v,
                             const ClothState& state, const Point& at, Eigen::VectorXd& step,
                             StepOutcome& out) {
  Eigen::VectorXd rhs = -at.residual;
  std::vector<Mat3> blocks(e.contacts.size());
  std::vector<SlipColumn> slips;
  for (std::size_t i = 0; i < e.contacts.size(); ++i) {
    const StepContact& c = e.contacts[i];
    const int dof = first_dof_[c.vertex];
    const Mat3 inverse = complementInverse(at.projections[i]);
    blocks[i] = stiffening(e, c) / e.h_s * (inverse - Mat3::Identity());
    rhs.segment<3>(dof) = inverse * Vec3(rhs.segment<3>(dof));
    const Vec3 along = slipDirection(c, relative(c, v, dof));
    const Vec3 column = c.friction * (blocks[i] * c.normal);
    if (!along.isZero(0.0) && !column.isZero(0.0)) slips.push_back({dof, along, column});
  }
  for (const Projection projection : {Projection::kNone, Projection::kPositiveSemiDefinite}) {
    ++out.factorizations;
    if (!assemble(e, v, state, projection, blocks)) continue;
    cholesky_.solve(rhs, step);
    if (!slips.empty() && step.allFinite()) correctForSlip(slips, step);
    step /= e.h_s;
    return step.allFinite();
  }
  return false;
}

/// With S the factorised matrix, columns c_i and rows t_i of the slips: (S + c t^T) x = S x_0 is
/// x = x_0 - S^-1 c w with (I + t^T S^-1 c) w = t^T x_0, as many unknowns as vertices slide.
void FrictionStep::correctForSlip(const std::vector<SlipColumn>& slips, Eigen::VectorXd& step) {
  const auto count = static_cast<Eigen::Index>(slips.size());
  const auto along = [&](const Eigen::VectorXd& x) {
    Eigen::VectorXd w(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const SlipColumn& s = slips[static_cast<std::size_t>(i)];
      w[i] = s.along.dot(x.segment<3>(s.dof));
    }
    return w;
  };
  Eigen::VectorXd rhs, moved;
  const auto answer = [&](const Eigen::VectorXd& w) {
    rhs.setZero(step.size());
    for (Eigen::Index i = 0; i < count; ++i) {
      const SlipColumn& s = slips[static_cast<std::size_t>(i)];
      rhs.segment<3>(s.dof) = w[i] * s.column;
    }
    cholesky_.solve(rhs, moved);
  };
  const Eigen::VectorXd w = solveGmres(
      [&](const Eigen::VectorXd& x) {
        answer(x);
        return Eigen::VectorXd(x + along(moved));
      },
      along(step), kMaxProducts, kLinearTolerance);
  answer(w);
  step -= moved;
}

std::vector<VertexContact> FrictionStep::contactsAt(const StepEquation& e, const Eigen::VectorXd& v,
                                                    const Point& at) const {
  std::vector<VertexContact> out;
  for (const StepContact& c : e.contacts) {
    const int dof = first_dof_[c.vertex];
    const Vec3 u = relative(c, v, dof);
    const Vec3 y = Vec3(at.forces.segment<3>(dof)) - stiffening(e, c) * deSaxce(c, u);
    VertexContact contact;
    contact.mode = modeOf(c, y);
    contact.obstacle = c.obstacle;
    contact.gap_m = e.h_s * u.dot(c.normal);
    contact.force_N = projectOnFrictionCone(y, c.normal, c.friction).point;
    if (contact.mode != ContactMode::kOff) contact.slip_m_per_s = u - u.dot(c.normal) * c.normal;
    out.push_back(contact);
  }
  return out;
}

StepOutcome FrictionStep::solve(const StepEquation& e, ClothState& state, Eigen::VectorXd& v,
                                const std::function<bool()>& stop) {
  StepOutcome out;
  Point now, trial;
  evaluate(e, v, state, now);
  Eigen::VectorXd best_v = v, step;
  double best = now.largest;
  int last_gain = 0;
  while (now.largest > tolerance_N_ && std::isfinite(now.norm)) {
    if (out.iterations - last_gain > kPatience || out.iterations >= kMaxIterations) break;
    if ((stop && stop()) || !direction(e, v, state, now, step, out)) break;
    ++out.iterations;
    double scale = 1.0;
    for (int cut = 0;; ++cut, scale *= kCut) {
      evaluate(e, v + scale * step, state, trial);
      if (trial.norm <= kGrowth * now.norm || cut == kMaxCuts) break;
    }
    v += scale * step;
    std::swap(now, trial);
    if (!(now.largest < best)) continue;
    best = now.largest;
    best_v = v;
    last_gain = out.iterations;
  }
  v = best_v;
  evaluate(e, v, state, now);
  out.residual_N = now.largest;
  const double enough = out.iterations > 0 ? kRoundingShare * tolerance_N_ : tolerance_N_;
  out.converged = std::isfinite(now.norm) && now.largest <= enough;
  out.contacts = contactsAt(e, v, now);
  return out;
}

}  // namespace tenter
