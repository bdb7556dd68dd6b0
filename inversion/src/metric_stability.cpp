// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "metric_barrier.h"
#include "reduced_hessian.h"
#include "second_order_cone.h"

namespace tenter {
namespace {

/// Below the smallest eigenvalue, of it: where lambda begins.
constexpr double kFirstRoom = 0.5;
/// What is still to be gained, of lambda, when the search for more ends.
constexpr double kNothingLeft = 1e-3;
/// Of the largest: modes of a proof that are left out.
constexpr double kLightMode = 1e-12;
constexpr int kRefinements = 3;
constexpr Eigen::Index kColumns = 96;  ///< Solved for together, between looks at the time.
/// Steps shorter than this no longer lead anywhere.
constexpr double kNoStep = 1e-6;
constexpr double kDrawnInwards = 0.2;
/// Of the complementarity: what a step leaves at least.
constexpr double kLeastCentring = 0.02;

/// Share of the way on which I + t m stays definite, at most `most`.
double stepTo(const Eigen::MatrixXd& m, double most) {
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m, Eigen::EigenvaluesOnly).eigenvalues()[0];
  return -least * most > kToBorder ? kToBorder / -least : most;
}

double stepTo(const Eigen::VectorXd& at, const Eigen::VectorXd& step, double most) {
  for (Eigen::Index i = 0; i < at.size(); ++i)
    if (-step[i] * most > kToBorder * at[i]) most = kToBorder * at[i] / -step[i];
  return most;
}

}  // namespace

Eigen::MatrixXd MetricBarrier::softest(const Eigen::MatrixXd& columns, int count) const {
  Eigen::MatrixXd copy = columns;
  const ReducedHessian reduced_to(elements_, copy, mass_);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(reduced_to.hessian(z_));
  return copy * eigen.eigenvectors().leftCols(std::min<Eigen::Index>(count, copy.cols()));
}

/// Primal-dual steps for: maximise lambda such that S = columns^T (H(z) - lambda M) columns >= 0,
/// z within bounds, f in cones, balanced; in Nesterov and Todd's scaling of S and its dual V, of
/// bounds and of cones. The dual's V and row multipliers are the proof where there is one.
class MetricBarrier::Stability {
 public:
  Stability(MetricBarrier& barrier, Eigen::MatrixXd& columns)
      : b_(barrier),
        columns_(columns),
        reduced_(b_.elements_, columns, b_.mass_),
        r_(reduced_.size()),
        identity_(Eigen::MatrixXd::Identity(r_, r_)) {}

  Outcome run(double wanted_per_s2, const Limits& limits) {
    // Where the last search ended, drawn away from the bounds.
    b_.z_ = kDrawnInwards * b_.central_z_ + (1.0 - kDrawnInwards) * b_.z_;
    b_.f_ = kDrawnInwards * b_.central_f_ + (1.0 - kDrawnInwards) * b_.f_;
    Eigen::MatrixXd h = reduced_.hessian(b_.z_);
    double& lambda = b_.lambda_;
    b_.bound_ = std::numeric_limits<double>::infinity();
    lambda = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(h).eigenvalues()[0];
    if (lambda >= wanted_per_s2) return Outcome::kReached;
    lambda -= std::max(wanted_per_s2, kFirstRoom * std::abs(lambda));
    for (int k = 0; k < limits.max_steps; ++k) {
      if (limits.stop && limits.stop()) return ended();
      s_ = h - lambda * identity_;
      if (k == 0) start();
      if (!scale() || !b_.factorize() || !prepare(limits.stop)) return ended();
      // How far a step towards nothing left would come says how much to leave.
      const double mu = complementarity();
      Direction way = direction(0.0);
      const auto [primal, dual] = stepLengths(way);
      const double left = 1.0 - std::min(primal, dual);
      way = direction(mu * std::clamp(left * left * left, kLeastCentring, 1.0));
      if (!way.step.z.allFinite() || !std::isfinite(way.lambda)) return ended();
      const auto [by_primal, by_dual] = stepLengths(way);
      move(way, by_primal, by_dual);
      measureBound();
      if (b_.provedEnough()) return Outcome::kInfeasible;
      if (lambda >= wanted_per_s2) return Outcome::kReached;
      if (b_.bound_ - lambda < kNothingLeft * std::abs(lambda)) break;
      if (by_primal < kNoStep && by_dual < kNoStep) break;
      h = reduced_.hessian(b_.z_);
    }
    return ended();
  }

 private:
  Outcome ended() const { return b_.proof_ ? Outcome::kInfeasible : Outcome::kStalled; }

  struct Direction {
    Step step;  ///< With the multipliers of the rows as they will be.
    double lambda = 0.0;
    Eigen::MatrixXd scaled_s, scaled_v;  ///< R dS R^T, R^-T dV R^-1.
    Eigen::VectorXd above, below;        ///< Of the bounds' multipliers.
    Eigen::VectorXd cones;
  };

  Eigen::VectorXd roomAbove() const { return b_.upper_ - b_.z_; }
  Eigen::VectorXd roomBelow() const { return b_.z_ - b_.lower_; }

  /// On the central path but for the rows of the dual.
  void start() {
    const Eigen::MatrixXd inverse = s_.llt().solve(identity_);
    const double mu = 1.0 / inverse.trace();
    v_ = mu * inverse;
    above_ = mu * roomAbove().cwiseInverse();
    below_ = mu * roomBelow().cwiseInverse();
    b_.weigh(b_.z_, b_.f_);
    cones_ = -mu * b_.slope_f_;
    nu_ = Eigen::VectorXd::Zero(b_.row_count_);
  }

  double complementarity() const {
    const double sum = s_.cwiseProduct(v_).sum() + above_.dot(roomAbove()) +
                       below_.dot(roomBelow()) + cones_.dot(b_.f_);
    double count = static_cast<double>(r_ + 2 * b_.z_.size());
    for (const Contact& c : b_.contacts_) count += c.friction > 0.0 ? 2.0 : 1.0;
    return sum / count;
  }

  /// R with R S R^T = R^-T V R^-1 = Sigma; weights of bounds and cones.
  bool scale() {
    const Eigen::LLT<Eigen::MatrixXd> s(s_), v(v_);
    if (s.info() != Eigen::Success || v.info() != Eigen::Success) return false;
    const Eigen::MatrixXd lower_s = s.matrixL(), lower_v = v.matrixL();
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(lower_v.transpose() * lower_s, Eigen::ComputeFullV);
    sigma_ = svd.singularValues();
    if (!(sigma_.minCoeff() > 0.0)) return false;
    scale_ = sigma_.cwiseSqrt().asDiagonal() * svd.matrixV().transpose() *
             Eigen::MatrixXd(s.matrixL().solve(identity_));
    inverse_s_ = s.solve(identity_);
    b_.weigh(b_.z_, b_.f_);
    b_.inverse_z_ =
        (above_.cwiseQuotient(roomAbove()) + below_.cwiseQuotient(roomBelow())).cwiseInverse();
    for (std::size_t i = 0; i < b_.contacts_.size(); ++i)
      b_.inverse_f_[i] =
          coneWeight(b_.contacts_[i], b_.f_.segment<3>(at(i)), cones_.segment<3>(at(i)));
    return true;
  }

  static Eigen::Index at(std::size_t contact) { return 3 * static_cast<Eigen::Index>(contact); }

  /// Force to the cone |(y1, y2)| <= y0.
  static Mat3 toCone(const Contact& c) {
    const Vec3 t1 = c.normal.unitOrthogonal(), t2 = c.normal.cross(t1);
    Mat3 out;
    out << c.friction * c.normal.transpose(), t1.transpose(), t2.transpose();
    return out;
  }

  /// Inverse of the scaling's square: how a force answers to a pull.
  static Mat3 coneWeight(const Contact& c, const Vec3& f, const Vec3& dual) {
    if (c.friction <= 0.0)
      return f.dot(c.normal) / dual.dot(c.normal) * c.normal * c.normal.transpose();
    const Mat3 to = toCone(c), from = to.inverse();
    const ConeScaling scaling = scaleCone(to * f, from.transpose() * dual);
    const Mat3 half = from * scaling.w;
    return half * half.transpose();
  }

  /// False when it was stopped.
  bool prepare(const std::function<bool()>& stop) {
    by_z_ = reduced_.byZ(scale_);
    by_lambda_.resize(reduced_.packedSize());
    pack(-scale_ * scale_.transpose(), by_lambda_);
    // Symmetric: blocks on and below the diagonal, of which LDLT reads no more.
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(by_z_.cols(), by_z_.cols());
    for (Eigen::Index first = 0; first < system.cols(); first += kColumns) {
      if (stop && stop()) return false;
      const Eigen::Index count = std::min(kColumns, system.cols() - first);
      const Eigen::MatrixXd answers = b_.reduced(by_z_.middleCols(first, count));
      tbb::parallel_for(
          tbb::blocked_range<Eigen::Index>(first, system.rows(), kColumns),
          [&](const auto& range) {
            const auto rows = range.end() - range.begin();
            system.block(range.begin(), first, rows, count).noalias() =
                by_z_.middleCols(range.begin(), rows).transpose() * answers;
          },
          tbb::simple_partitioner());
    }
    system.diagonal().array() += 1.0;
    solver_.compute(system);
    by_lambda_solved_ = solver_.solve(by_lambda_);
    // Of log det S by each z: <S^-1, dS/dz> = <R S^-1 R^T ...>, R^-T S^-1 R^-1 = Sigma^-1.
    Eigen::VectorXd packed(by_lambda_.size());
    pack(Eigen::MatrixXd(sigma_.cwiseInverse().asDiagonal()), packed);
    log_by_z_ = by_z_ * packed;
    off_ = b_.residual(b_.z_, b_.f_);
    return true;
  }

  Direction direction(double mu) {
    const Eigen::VectorXd gz = mu * (b_.slope_z_ - log_by_z_), gf = mu * b_.slope_f_;
    const double glambda = mu * inverse_s_.trace() - 1.0;
    Direction way;
    way.step = b_.newton(gz, gf, off_);
    const double pivot = by_lambda_.dot(by_lambda_solved_);
    Eigen::VectorXd w = Eigen::VectorXd::Zero(by_lambda_.size());
    for (int k = 0; k <= kRefinements; ++k) {
      const Eigen::VectorXd missed = by_z_.transpose() * way.step.z + way.lambda * by_lambda_ - w;
      const Eigen::VectorXd mended = solver_.solve(missed);
      const double more = (-glambda - by_lambda_.dot(w) - by_lambda_.dot(mended)) / pivot;
      way.lambda += more;
      w += mended + more * by_lambda_solved_;
      way.step = b_.newton(gz + by_z_ * w, gf, off_);
    }
    way.scaled_s = unpack(w, r_);
    way.scaled_v = -way.scaled_s;
    way.scaled_v.diagonal() += mu * sigma_.cwiseInverse() - sigma_;
    const Eigen::VectorXd s = roomAbove(), t = roomBelow(), &dz = way.step.z;
    way.above = (mu * s.cwiseInverse() - above_) + above_.cwiseQuotient(s).cwiseProduct(dz);
    way.below = (mu * t.cwiseInverse() - below_) - below_.cwiseQuotient(t).cwiseProduct(dz);
    way.cones = -cones_;
    for (std::size_t i = 0; i < b_.contacts_.size(); ++i)
      way.cones.segment<3>(at(i)) -= way.step.nu.segment<3>(b_.rowOf(b_.contacts_[i].vertex));
    return way;
  }

  std::pair<double, double> stepLengths(const Direction& way) const {
    const auto half = sigma_.cwiseSqrt().cwiseInverse().asDiagonal();
    double primal = stepTo(half * way.scaled_s * half, b_.longest(way.step));
    double dual = stepTo(half * way.scaled_v * half, 1.0);
    dual = stepTo(above_, way.above, stepTo(below_, way.below, dual));
    for (std::size_t i = 0; i < b_.contacts_.size(); ++i) {
      const Contact& c = b_.contacts_[i];
      const Vec3 from = cones_.segment<3>(at(i)), d = way.cones.segment<3>(at(i));
      const double least = (1.0 - kToBorder) * dualRoom(c, from);
      while (dual > kLeastBarrierStep && dualRoom(c, from + dual * d) < least) dual *= kShorterStep;
    }
    return {primal, dual};
  }

  void move(const Direction& way, double primal, double dual) {
    b_.z_ += primal * way.step.z;
    b_.f_ += primal * way.step.f;
    b_.lambda_ += primal * way.lambda;
    v_ += dual * (scale_.transpose() * way.scaled_v * scale_);
    v_ = 0.5 * (v_ + v_.transpose()).eval();
    above_ += dual * way.above;
    below_ += dual * way.below;
    cones_ += dual * way.cones;
    nu_ += dual * (way.step.nu - nu_);
  }

  /// What no state exceeds by the dual as it is, whatever its rows lack.
  void measureBound() {
    if (!b_.coneHolds(nu_)) return;
    const double trace = v_.trace();
    const Eigen::VectorXd y = b_.coordinates(-nu_) / trace;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(v_ / trace);
    const Eigen::MatrixXd modes = columns_ * eigen.eigenvectors() *
                                  eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    const Eigen::VectorXd slope =
        b_.elements_.curvatures(modes) + b_.elements_.works(y) / b_.unit_N_;
    const double elastic = v_.cwiseProduct(reduced_.elastic()).sum() / trace;
    b_.bound_ = std::min(b_.bound_, b_.slackOf(slope) + elastic - b_.weight_.dot(nu_) / trace);
    if (b_.bound_ >= 0.0) return;
    std::vector<Points3> kept;
    for (Eigen::Index m = 0; m < r_; ++m)
      if (eigen.eigenvalues()[m] > kLightMode * eigen.eigenvalues()[r_ - 1])
        kept.emplace_back(Eigen::Map<const Points3>(modes.col(m).data(), 3, modes.rows() / 3));
    b_.keepProof(Eigen::Map<const Points3>(y.data(), 3, y.size() / 3) / b_.unit_N_,
                 std::move(kept));
  }

  MetricBarrier& b_;
  const Eigen::MatrixXd& columns_;
  const ReducedHessian reduced_;
  const Eigen::Index r_;
  const Eigen::MatrixXd identity_;
  Eigen::MatrixXd s_, v_, scale_, inverse_s_, by_z_;
  Eigen::VectorXd sigma_, above_, below_, cones_, nu_;
  Eigen::VectorXd by_lambda_, by_lambda_solved_, log_by_z_, off_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
};

MetricBarrier::Outcome MetricBarrier::stabilize(Eigen::MatrixXd& columns, double wanted_per_s2,
                                                const Limits& limits) {
  return Stability(*this, columns).run(wanted_per_s2, limits);
}

}  // namespace tenter
