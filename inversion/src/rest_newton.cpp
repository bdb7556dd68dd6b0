// SPDX-License-Identifier: GPL-3.0-or-later
#include "rest_newton.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tenter {
namespace {

/// A rest triangle may shrink or grow this much against the target's.
constexpr double kLeastArea = 1e-3, kMostArea = 1e3;
/// A rigid motion moves fixed vertices less than this, relatively: nothing stops it.
constexpr double kUnstopped = 1e-6;
/// A step that could be this much longer is tried so.
constexpr double kWorthLonger = 4.0;
/// Forces below this multiple of what rounding the rest positions makes of them are zero.
constexpr double kRounding = 3.0;
/// So many steps in a row shorter than this share of Newton's: it does not get there.
constexpr double kShort = 0.06;
constexpr int kMostShort = 4;

Eigen::VectorXd areasOf(const TriangleMesh& mesh, const Points3& x) {
  Eigen::VectorXd areas(static_cast<Eigen::Index>(mesh.triangles.size()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& ids = mesh.triangles[t];
    const Vec3 a = x.col(ids[1]) - x.col(ids[0]), b = x.col(ids[2]) - x.col(ids[0]);
    areas[static_cast<Eigen::Index>(t)] = 0.5 * a.cross(b).norm();
  }
  return areas;
}

/// Unit rigid motions of all vertices, rotations about the centre and per size: 3 n x 6.
Eigen::MatrixXd rigidMotions(const Points3& pose) {
  const Vec3 centre = pose.rowwise().mean();
  const double size = sizeOf(pose);
  Eigen::MatrixXd out(pose.size(), 6);
  for (Eigen::Index v = 0; v < pose.cols(); ++v) {
    out.block<3, 3>(3 * v, 0).setIdentity();
    for (int a = 0; a < 3; ++a)
      out.block<3, 1>(3 * v, 3 + a) = Vec3::Unit(a).cross(Vec3(pose.col(v) - centre)) / size;
  }
  return out;
}

}  // namespace

RestNewton::RestNewton(InverseShell& shell, Points3 pose, std::vector<int> fixed,
                       std::vector<Contact> contacts)
    : shell_(shell),
      pose_(std::move(pose)),
      fixed_(std::move(fixed)),
      contacts_(std::move(contacts)),
      gravity_(shell.material().gravity_m_per_s2),
      target_area_(areasOf(shell.target(), pose_)),
      weight_N_(std::max(shell.weight_N(pose_), 1e-300)),
      path_(shell.target(), fixed_),
      row_of_(static_cast<std::size_t>(shell.coordinateCount()), 0) {
  for (const int v : fixed_)
    for (int a = 0; a < 3; ++a) row_of_[static_cast<std::size_t>(3 * v + a)] = -1;
  int rows = 0;
  for (int& row : row_of_)
    if (row >= 0) row = rows++;
  findGauge();
}

/// Rigid motions of the rest shape that leave the fixed vertices alone, and as many coordinates
/// whose values say where it is.
void RestNewton::findGauge() {
  const Eigen::MatrixXd all = rigidMotions(pose_);
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(std::max<Eigen::Index>(all.rows(), 6), 6);
  for (Eigen::Index c = 0; c < all.rows(); ++c)
    if (row_of_[static_cast<std::size_t>(c)] < 0) held.row(c) = all.row(c);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(held.transpose() * held, Eigen::ComputeFullV);
  const double largest = static_cast<double>(pose_.cols());
  int count = 0;
  for (int k = 0; k < 6; ++k)
    if (svd.singularValues()[k] < kUnstopped * kUnstopped * largest) ++count;
  // Without contacts nothing could bear what these motions move: the rows stand as they are.
  if (contacts_.empty()) count = 0;
  motions_ = Eigen::MatrixXd::Zero(shell_.coordinateCount(), count);
  motions_.topRows(all.rows()) = all * svd.matrixV().rightCols(count);
  column_of_ = row_of_;
  coordinate_of_.clear();
  for (std::size_t c = 0; c < row_of_.size(); ++c)
    if (row_of_[c] >= 0) coordinate_of_.push_back(static_cast<int>(c));
  border_column_.clear();
  if (count == 0) return;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(motions_.transpose());
  for (int k = 0; k < count; ++k) {
    const auto kept = static_cast<std::size_t>(qr.colsPermutation().indices()[k]);
    border_column_.push_back(row_of_[kept]);
    coordinate_of_[static_cast<std::size_t>(row_of_[kept])] = -1;
    column_of_[kept] = -1;
  }
}

/// How the global balance moves contact forces: the border's columns.
void RestNewton::bind(const Points3& forces) {
  border_ = Eigen::MatrixXd::Zero(motions_.rows(), motions_.cols());
  if (border_.cols() == 0) return;
  const double least = 1e-9 * weight_N_ / static_cast<double>(contacts_.size());
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Eigen::Index row = 3 * contacts_[i].vertex;
    const double share = forces.col(static_cast<Eigen::Index>(i)).norm() + least;
    border_.middleRows<3>(row) = share * motions_.middleRows<3>(row);
  }
}

Eigen::VectorXd RestNewton::gradient(const RestUnknowns& u, double load) const {
  Eigen::VectorXd g;
  shell_.setGravity(load * gravity_);
  shell_.gradient(shell_.coordinates(pose_, u.rotations), u.rest, g);
  shell_.setGravity(gravity_);
  return g;
}

const InverseShell::Sparse& RestNewton::gradientByRest(const RestUnknowns& u, double load) const {
  shell_.setGravity(load * gravity_);
  const auto& j = shell_.gradientByRest(shell_.coordinates(pose_, u.rotations), u.rest);
  shell_.setGravity(gravity_);
  return j;
}

Points3 RestNewton::contactForces(const Eigen::VectorXd& gradient) const {
  Points3 forces(3, static_cast<Eigen::Index>(contacts_.size()));
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    forces.col(static_cast<Eigen::Index>(i)) = gradient.segment<3>(3 * contacts_[i].vertex);
  return forces;
}

Eigen::VectorXd RestNewton::residual(const RestUnknowns& u, const Points3& forces,
                                     double load) const {
  Eigen::VectorXd r(static_cast<Eigen::Index>(coordinate_of_.size()));
  Eigen::VectorXd g = gradient(u, load);
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    g.segment<3>(3 * contacts_[i].vertex) -= forces.col(static_cast<Eigen::Index>(i));
  for (std::size_t c = 0; c < row_of_.size(); ++c)
    if (row_of_[c] >= 0) r[row_of_[c]] = g[static_cast<Eigen::Index>(c)];
  return r;
}

bool RestNewton::factorize(const RestUnknowns& u, double load) {
  const auto& j = gradientByRest(u, load);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(j.nonZeros() + border_.size()));
  double square_sum = 0.0;
  for (int c = 0; c < j.outerSize(); ++c) {
    const int column = column_of_[static_cast<std::size_t>(c)];
    if (column < 0) continue;
    const double place = c < u.rest.size() ? u.rest.data()[c] : 0.0;
    for (InverseShell::Sparse::InnerIterator it(j, c); it; ++it) {
      const int row = row_of_[static_cast<std::size_t>(it.row())];
      if (row < 0) continue;
      entries.emplace_back(row, column, it.value());
      square_sum += it.value() * place * it.value() * place;
    }
  }
  for (const Contact& c : contacts_)
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < border_.cols(); ++k)
        entries.emplace_back(row_of_[static_cast<std::size_t>(3 * c.vertex + a)], border_column_[k],
                             -border_(3 * c.vertex + a, k));
  rounding_ =
      kRounding * std::numeric_limits<double>::epsilon() * std::sqrt(square_sum) / weight_N_;
  const int n = static_cast<int>(coordinate_of_.size());
  Eigen::SparseMatrix<double> square(n, n);
  square.setFromTriplets(entries.begin(), entries.end());
  return lu_.factorize(square);
}

void RestNewton::move(RestUnknowns& u, Points3& forces, const Eigen::VectorXd& step,
                      double share) const {
  const Eigen::Index positions = u.rest.size();
  Points3 displacement = Points3::Zero(3, pose_.cols());
  for (std::size_t k = 0; k < coordinate_of_.size(); ++k) {
    const Eigen::Index c = coordinate_of_[k];
    if (c < 0) continue;
    const double d = share * step[static_cast<Eigen::Index>(k)];
    if (c < positions)
      displacement.data()[c] = d;
    else
      u.rotations[c - positions] += d;
  }
  u.rest = path_.moved(u.rest, displacement);
  const Eigen::VectorXd moved = border_ * (share * step(border_column_));
  for (std::size_t i = 0; i < contacts_.size() && border_.cols() > 0; ++i)
    forces.col(static_cast<Eigen::Index>(i)) += moved.segment<3>(3 * contacts_[i].vertex);
}

bool RestNewton::plausible(const Points3& rest) const {
  const Eigen::ArrayXd share = areasOf(shell_.target(), rest).array() / target_area_.array();
  return rest.allFinite() && share.minCoeff() > kLeastArea && share.maxCoeff() < kMostArea;
}

double RestNewton::lengthOf(const Eigen::VectorXd& step) const {
  Eigen::VectorXd positions = step;
  positions(border_column_).setZero();
  return positions.norm();
}

RestNewtonResult RestNewton::solve(RestUnknowns& u, Points3& forces, double load,
                                   const RestNewtonOptions& options) {
  RestNewtonResult out;
  bind(forces);
  Eigen::VectorXd r = residual(u, forces, load), step, left;
  double damping = 1.0, last_length = 0.0;
  bool stagnant = false;
  int short_steps = 0;
  for (;; ++out.iterations) {
    out.residual = r.norm() / weight_N_;
    if (options.progress) options.progress(out.iterations, out.residual, damping);
    out.converged = out.residual <= options.tolerance || (stagnant && out.residual <= rounding_);
    if (out.converged || out.iterations >= options.max_iterations ||
        (options.stop && options.stop()))
      return out;
    ++out.factorizations;
    if (!factorize(u, load) || !lu_.solve(-r, step)) return out;
    const double length = lengthOf(step);
    if (out.iterations > 0) {
      // How much the last correction was off foretells how far this step may go.
      const double off = std::max(lengthOf(left - step) * length, 1e-300);
      damping =
          std::clamp(damping * last_length * lengthOf(left) / off, options.least_damping, 1.0);
    }
    last_length = length;
    for (bool grown = false;;) {
      if (options.stop && options.stop()) return out;
      RestUnknowns trial = u;
      Points3 trial_forces = forces;
      move(trial, trial_forces, step, damping);
      Eigen::VectorXd trial_r;
      double remains = std::numeric_limits<double>::infinity(), foretold = 0.5 * damping;
      if (plausible(trial.rest)) {
        trial_r = residual(trial, trial_forces, load);
        if (trial_r.allFinite() && lu_.solve(-trial_r, left)) {
          remains = lengthOf(left);
          const double off = lengthOf(left - (1.0 - damping) * step);
          foretold = 0.5 * length * damping * damping / std::max(off, 1e-300);
        }
      }
      const bool rounded = trial_r.size() > 0 && trial_r.norm() <= rounding_ * weight_N_;
      if (remains >= length && !rounded) {
        damping = std::min(foretold, 0.5 * damping);
        if (damping < options.least_damping) return out;
        continue;
      }
      if (!grown && foretold >= kWorthLonger * damping && damping < 1.0) {
        damping = std::min(1.0, foretold);
        grown = true;
        continue;
      }
      short_steps = damping < kShort ? short_steps + 1 : 0;
      if (short_steps > kMostShort) return out;
      stagnant = trial_r.norm() > 0.5 * r.norm();
      u = std::move(trial);
      forces = std::move(trial_forces);
      r = std::move(trial_r);
      break;
    }
  }
}

std::vector<Points3> RestNewton::globalMotions() const {
  std::vector<Points3> out;
  for (Eigen::Index k = 0; k < motions_.cols(); ++k) out.push_back(contactForces(motions_.col(k)));
  return out;
}

std::vector<HoldDerivative> RestNewton::derivatives(const RestUnknowns& u, const Points3& forces,
                                                    const Eigen::MatrixXd& by_unknowns) {
  std::vector<HoldDerivative> out;
  bind(forces);
  if (!factorize(u, 1.0)) return out;
  const auto& j = gradientByRest(u, 1.0);
  for (Eigen::Index k = 0; k < by_unknowns.cols(); ++k) {
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(coordinate_of_.size()));
    for (std::size_t c = 0; c < coordinate_of_.size(); ++c)
      if (coordinate_of_[c] >= 0)
        rhs[static_cast<Eigen::Index>(c)] = by_unknowns(coordinate_of_[c], k);
    Eigen::VectorXd rows;
    if (!lu_.solveTransposed(rhs, rows)) return {};
    Eigen::VectorXd adjoint = Eigen::VectorXd::Zero(shell_.coordinateCount());
    for (std::size_t c = 0; c < row_of_.size(); ++c)
      if (row_of_[c] >= 0) adjoint[static_cast<Eigen::Index>(c)] = rows[row_of_[c]];
    const Eigen::VectorXd direct = by_unknowns.col(k) - j.transpose() * adjoint;
    HoldDerivative d;
    d.by_forces = contactForces(adjoint);
    d.by_fixed.resize(3, static_cast<Eigen::Index>(fixed_.size()));
    for (std::size_t i = 0; i < fixed_.size(); ++i)
      d.by_fixed.col(static_cast<Eigen::Index>(i)) = direct.segment<3>(3 * fixed_[i]);
    out.push_back(std::move(d));
  }
  return out;
}

}  // namespace tenter
