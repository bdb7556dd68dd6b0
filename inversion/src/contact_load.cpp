// SPDX-License-Identifier: GPL-3.0-or-later
#include "contact_load.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "second_order_cone.h"

namespace tenter {
namespace {

constexpr int kMaxIterations = 80;
/// Of the load, and of the complementarity at the start. The cones are solved for with a margin, so
/// no more is needed, and rounding allows no more where the contacts alone hold the shell.
constexpr double kTolerance = 1e-7;
constexpr double kUsable = 1e-4;  ///< What is still worth going on with.
constexpr double kWorse = 100.0;
constexpr double kToTheBoundary = 0.995;  ///< Share of the way to the cones' boundary in one step.
constexpr double kLeastShift = 1e-13;     ///< Of the stiffest entry: H may be singular.

struct Cone {
  int dof;
  Mat3 from_motion;         ///< s = T u: normal, then mu times two tangents.
  std::array<int, 9> slot;  ///< Lower-triangle entries of its block; -1 above.
  Vec3 s, z;
  Vec3 ds, dz;
  ConeScaling scaling;
};

class Solver {
 public:
  Solver(const SparseLower& h, const Eigen::VectorXd& load, const std::vector<LoadCone>& cones,
         SparseCholesky& cholesky)
      : h_(h), load_(load), cholesky_(cholesky), k_(h) {
    for (const LoadCone& c : cones) addCone(c);
    double stiffest = 0.0;
    for (int c = 0; c < h.size; ++c) stiffest = std::max(stiffest, h.value[h.column_begin[c]]);
    shift_ = kLeastShift * stiffest;
  }

  ContactLoadResult solve(const std::function<bool()>& stop) {
    ContactLoadResult out;
    out.forces = Points3::Zero(3, static_cast<Eigen::Index>(cones_.size()));
    out.motion = Eigen::VectorXd::Zero(h_.size);
    if (start()) iterate(stop, &out);
    out.motion = u_;
    for (std::size_t i = 0; i < cones_.size(); ++i)
      out.forces.col(static_cast<Eigen::Index>(i)) =
          cones_[i].from_motion.transpose() * cones_[i].z;
    out.factorizations = factorizations_;
    return out;
  }

 private:
  void addCone(const LoadCone& c) {
    Cone cone;
    cone.dof = c.first_dof;
    const Vec3 t1 = c.normal.unitOrthogonal(), t2 = c.normal.cross(t1);
    cone.from_motion << c.normal.transpose(), c.friction * t1.transpose(),
        c.friction * t2.transpose();
    cone.slot.fill(-1);
    for (int b = 0; b < 3; ++b) {
      const int column = c.first_dof + b;
      for (int k = h_.column_begin[column]; k < h_.column_begin[column + 1]; ++k) {
        const int a = h_.row[k] - c.first_dof;
        if (a >= b && a < 3) cone.slot[3 * a + b] = k;
      }
    }
    cones_.push_back(cone);
  }

  bool factorize(bool scaled) {
    std::copy(h_.value.begin(), h_.value.end(), k_.value.begin());
    for (const Cone& c : cones_) {
      Mat3 weighted = c.from_motion;
      if (scaled) weighted = c.scaling.w_inverse * c.from_motion;
      const Mat3 block = weighted.transpose() * weighted * (scaled ? 1.0 : start_weight_);
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) k_.value[c.slot[3 * a + b]] += block(a, b);
    }
    ++factorizations_;
    return cholesky_.factorize(k_, shift_);
  }

  /// A pair inside the cones near the solution of the problem with springs at the contacts.
  bool start() {
    double mean = 0.0;
    for (int c = 0; c < h_.size; ++c) mean += h_.value[h_.column_begin[c]] / h_.size;
    start_weight_ = mean;
    if (!factorize(false)) return false;
    cholesky_.solve(load_, u_);
    double reach = 0.0, push = 0.0;
    for (Cone& c : cones_) {
      c.s = c.from_motion * u_.segment<3>(c.dof);
      c.z = -start_weight_ * c.s;
      reach = std::max(reach, std::hypot(c.s[1], c.s[2]) - c.s[0]);
      push = std::max(push, std::hypot(c.z[1], c.z[2]) - c.z[0]);
    }
    const double least = std::max(u_.cwiseAbs().maxCoeff(), 1e-12);
    for (Cone& c : cones_) {
      c.s[0] += std::max(0.0, reach) + 0.1 * least;
      c.z[0] += std::max(0.0, push) + 0.1 * start_weight_ * least;
    }
    return true;
  }

  double gap() const {
    double sum = 0.0;
    for (const Cone& c : cones_) sum += c.s.dot(c.z);
    return sum / std::max<double>(1.0, static_cast<double>(cones_.size()));
  }

  Eigen::VectorXd dualResidual() const {
    Eigen::VectorXd r;
    multiply(h_, u_, r);
    r -= load_;
    for (const Cone& c : cones_) r.segment<3>(c.dof) -= c.from_motion.transpose() * c.z;
    return r;
  }

  /// Newton step for the residuals rx, T u - s (times `share`) and the products' targets.
  void direction(const Eigen::VectorXd& rx, double share, const std::vector<Vec3>& targets) {
    Eigen::VectorXd rhs = -share * rx;
    std::vector<Vec3> pull(cones_.size());
    for (std::size_t i = 0; i < cones_.size(); ++i) {
      const Cone& c = cones_[i];
      const Vec3 rz = c.s - c.from_motion * u_.segment<3>(c.dof);
      pull[i] = c.scaling.w * coneQuotient(targets[i], c.scaling.lambda) + share * rz;
      rhs.segment<3>(c.dof) +=
          c.from_motion.transpose() * (c.scaling.w_inverse * (c.scaling.w_inverse * pull[i]));
    }
    cholesky_.solve(rhs, du_);
    multiply(k_, du_, product_);  // one step of refinement: K is ill-conditioned near the end
    cholesky_.solve(rhs - product_, correction_);
    du_ += correction_;
    for (std::size_t i = 0; i < cones_.size(); ++i) {
      Cone& c = cones_[i];
      const Vec3 rz = c.s - c.from_motion * u_.segment<3>(c.dof);
      const Vec3 moved = c.from_motion * du_.segment<3>(c.dof);
      c.dz = c.scaling.w_inverse * (c.scaling.w_inverse * (pull[i] - moved));
      c.ds = moved - share * rz;
    }
  }

  double longestStep() const {
    double step = 1.0 / kToTheBoundary;
    for (const Cone& c : cones_) {
      step = std::min({step, stepToCone(c.scaling.lambda, c.scaling.w_inverse * c.ds),
                       stepToCone(c.scaling.lambda, c.scaling.w * c.dz)});
    }
    return step;
  }

  void iterate(const std::function<bool()>& stop, ContactLoadResult* out) {
    const double first_gap = std::max(gap(), 1e-300);
    const double load_size = std::max(load_.norm(), 1e-300);
    std::vector<Vec3> targets(cones_.size());
    struct Best {
      double error;
      Eigen::VectorXd u;
      std::vector<Cone> cones;
    } best{std::numeric_limits<double>::infinity(), u_, cones_};
    for (int k = 0; k < kMaxIterations; ++k) {
      const Eigen::VectorXd rx = dualResidual();
      const double mu = gap();
      double slack = 0.0;
      for (const Cone& c : cones_)
        slack = std::max(slack, (c.s - c.from_motion * u_.segment<3>(c.dof)).norm());
      const double error = std::max({rx.norm() / load_size, mu / first_gap,
                                     slack / std::max(u_.cwiseAbs().maxCoeff(), 1e-300)});
      if (!std::isfinite(error)) break;
      if (error < best.error) best = {error, u_, cones_};
      if (best.error <= kTolerance || cones_.empty() || (stop && stop())) break;
      // Rounding has taken over.
      if (best.error <= kUsable && error > kWorse * best.error) break;
      for (Cone& c : cones_) c.scaling = scaleCone(c.s, c.z);
      if (!factorize(true)) break;
      for (std::size_t i = 0; i < cones_.size(); ++i) {
        const Vec3& l = cones_[i].scaling.lambda;
        targets[i] = -coneProduct(l, l);
      }
      direction(rx, 1.0, targets);
      const double affine = std::min(1.0, longestStep());
      const double sigma = std::pow(1.0 - affine, 3);
      for (std::size_t i = 0; i < cones_.size(); ++i) {
        const Cone& c = cones_[i];
        targets[i] -= coneProduct(c.scaling.w_inverse * c.ds, c.scaling.w * c.dz);
        targets[i][0] += sigma * mu;
      }
      direction(rx, 1.0 - sigma, targets);
      const double step = std::min(1.0, kToTheBoundary * longestStep());
      u_ += step * du_;
      for (Cone& c : cones_) {
        c.s += step * c.ds;
        c.z += step * c.dz;
      }
    }
    out->converged = cones_.empty() || best.error <= kUsable;
    if (out->converged) {
      u_ = best.u;
      cones_ = std::move(best.cones);
    }
  }

  const SparseLower& h_;
  const Eigen::VectorXd& load_;
  SparseCholesky& cholesky_;
  SparseLower k_;
  std::vector<Cone> cones_;
  Eigen::VectorXd u_, du_, product_, correction_;
  double shift_ = 0.0, start_weight_ = 1.0;
  int factorizations_ = 0;
};

}  // namespace

ContactLoadResult solveContactLoad(const SparseLower& h, const Eigen::VectorXd& load,
                                   const std::vector<LoadCone>& cones, SparseCholesky& cholesky,
                                   const std::function<bool()>& stop) {
  return Solver(h, load, cones, cholesky).solve(stop);
}

}  // namespace tenter
