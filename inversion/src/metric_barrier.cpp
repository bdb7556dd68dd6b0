// SPDX-License-Identifier: GPL-3.0-or-later
#include "metric_barrier.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "free_coordinates.h"

namespace tenter {
namespace {

/// Keeps the normal matrix definite where supports leave it singular.
constexpr double kRegular = 1e-13;
constexpr int kRefinements = 2;
constexpr Eigen::Index kColumns = 48;  ///< Of a product that one thread makes.

int slotOf(const SparseLower& m, int row, int column) {
  const auto begin = m.row.begin() + m.column_begin[column];
  const auto end = m.row.begin() + m.column_begin[column + 1];
  const auto at = std::lower_bound(begin, end, row);
  require(at != end && *at == row, "MetricBarrier: an entry outside the pattern");
  return static_cast<int>(at - m.row.begin());
}

SparseLower patternOf(const InverseShell& shell, const std::vector<int>& fixed) {
  auto system = shell.system(shell.target().positions, fixed);
  require(static_cast<bool>(system), "MetricBarrier: the target is no shell");
  return system->hessian(system->restState(), Projection::kNone);
}

Eigen::VectorXd bounds(const MetricElements& elements, double MetricElement::*side) {
  Eigen::VectorXd out(elements.count());
  for (int i = 0; i < elements.count(); ++i) out[i] = elements.all()[i].*side;
  return out;
}

}  // namespace

MetricBarrier::MetricBarrier(const InverseShell& shell, const MetricElements& elements,
                             std::vector<int> fixed, std::vector<Contact> contacts)
    : shell_(shell),
      elements_(elements),
      fixed_(std::move(fixed)),
      contacts_(std::move(contacts)),
      first_row_(firstDofs(shell.vertexCount(), fixed_)),
      normal_(patternOf(shell, fixed_)),
      cholesky_(normal_),
      lower_(bounds(elements, &MetricElement::lower)),
      upper_(bounds(elements, &MetricElement::upper)) {
  const Points3& x = shell.target().positions;
  row_count_ = normal_.size;
  unit_N_ = shell.weight_N(x) / shell.vertexCount();
  const Eigen::VectorXd mass = shell.mass(x);
  mass_.resize(3 * mass.size());
  Eigen::VectorXd weight(mass_.size());
  for (Eigen::Index v = 0; v < mass.size(); ++v) {
    mass_.segment<3>(3 * v).setConstant(mass[v]);
    weight.segment<3>(3 * v) = -mass[v] * shell.material().gravity_m_per_s2;
  }
  weight_ = rows(weight) / unit_N_;
  for (const MetricElement& e : elements.all())
    for (int c = 0; c < 3 * e.node_count; ++c)
      for (int r = 0; r < 3 * e.node_count; ++r) {
        const int row = rowOf(e.nodes[r / 3]), column = rowOf(e.nodes[c / 3]);
        const bool lower = row >= 0 && column >= 0 && row + r % 3 >= column + c % 3;
        slots_.push_back(lower ? slotOf(normal_, row + r % 3, column + c % 3) : -1);
      }
  for (const Contact& c : contacts_) {
    std::array<int, 6> slots{};
    int k = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b)
        slots[k++] = slotOf(normal_, rowOf(c.vertex) + b, rowOf(c.vertex) + a);
    contact_slots_.push_back(slots);
  }
}

Eigen::VectorXd MetricBarrier::rows(const Eigen::VectorXd& coordinates) const {
  Eigen::VectorXd out(row_count_);
  for (std::size_t v = 0; v < first_row_.size(); ++v)
    if (first_row_[v] >= 0)
      out.segment<3>(first_row_[v]) = coordinates.segment<3>(3 * static_cast<Eigen::Index>(v));
  return out;
}

Eigen::VectorXd MetricBarrier::coordinates(const Eigen::VectorXd& rows) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(first_row_.size()));
  for (std::size_t v = 0; v < first_row_.size(); ++v)
    if (first_row_[v] >= 0)
      out.segment<3>(3 * static_cast<Eigen::Index>(v)) = rows.segment<3>(first_row_[v]);
  return out;
}

Eigen::VectorXd MetricBarrier::residual(const Eigen::VectorXd& z, const Eigen::VectorXd& f) const {
  Eigen::VectorXd out = rows(elements_.forces(z)) / unit_N_ + weight_;
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    out.segment<3>(rowOf(contacts_[i].vertex)) -= f.segment<3>(3 * static_cast<Eigen::Index>(i));
  return out;
}

/// mu^2 f_N^2 - |f_T|^2 inside the cone, f_N where there is no friction; not positive outside.
double MetricBarrier::coneValue(const Vec3& f, std::size_t contact) const {
  const Contact& c = contacts_[contact];
  const double normal = f.dot(c.normal);
  if (c.friction <= 0.0 || normal <= 0.0) return normal;
  return std::pow(c.friction * normal, 2) - (f - normal * c.normal).squaredNorm();
}

double MetricBarrier::barrier(const Eigen::VectorXd& z, const Eigen::VectorXd& f) const {
  if ((z.array() <= lower_.array()).any() || (z.array() >= upper_.array()).any())
    return std::numeric_limits<double>::infinity();
  double sum = -((upper_ - z).array().log() + (z - lower_).array().log()).sum();
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const double value = coneValue(f.segment<3>(3 * static_cast<Eigen::Index>(i)), i);
    if (!(value > 0.0)) return std::numeric_limits<double>::infinity();
    sum -= std::log(value);
  }
  return sum;
}

/// Gradient and inverse second derivative of the barrier.
void MetricBarrier::weigh(const Eigen::VectorXd& z, const Eigen::VectorXd& f) {
  const Eigen::ArrayXd above = (upper_ - z).array().inverse(),
                       below = (z - lower_).array().inverse();
  slope_z_ = above - below;
  inverse_z_ = (above.square() + below.square()).inverse();
  slope_f_.resize(f.size());
  inverse_f_.resize(contacts_.size());
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& c = contacts_[i];
    const Vec3 at = f.segment<3>(3 * static_cast<Eigen::Index>(i));
    const double value = coneValue(at, i);
    if (c.friction <= 0.0) {  // f stays on the normal
      slope_f_.segment<3>(3 * static_cast<Eigen::Index>(i)) = -c.normal / value;
      inverse_f_[i] = value * value * c.normal * c.normal.transpose();
      continue;
    }
    const Mat3 along = c.normal * c.normal.transpose();
    const Mat3 metric = c.friction * c.friction * along - (Mat3::Identity() - along);
    const Vec3 slope = 2.0 * metric * at;
    slope_f_.segment<3>(3 * static_cast<Eigen::Index>(i)) = -slope / value;
    const Mat3 curvature = slope * slope.transpose() / (value * value) - 2.0 / value * metric;
    inverse_f_[i] = curvature.inverse();
  }
}

bool MetricBarrier::factorize() {
  std::fill(normal_.value.begin(), normal_.value.end(), 0.0);
  std::size_t slot = 0;
  for (int i = 0; i < elements_.count(); ++i) {
    const MetricElement& e = elements_.all()[i];
    const double scale = inverse_z_[i] / (unit_N_ * unit_N_);
    for (int c = 0; c < 3 * e.node_count; ++c)
      for (int r = 0; r < 3 * e.node_count; ++r, ++slot)
        if (slots_[slot] >= 0) normal_.value[slots_[slot]] += scale * e.force[r] * e.force[c];
  }
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    int k = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) normal_.value[contact_slots_[i][k++]] += inverse_f_[i](b, a);
  }
  Eigen::VectorXd diagonal(row_count_);
  for (int c = 0; c < row_count_; ++c) diagonal[c] = normal_.value[normal_.column_begin[c]];
  ++factorizations_;
  return cholesky_.factorize(normal_, kRegular, &diagonal);
}

/// D d + A^T nu = -g, A d = -residual, with the factors at hand.
MetricBarrier::Step MetricBarrier::newton(const Eigen::VectorXd& gz, const Eigen::VectorXd& gf,
                                          const Eigen::VectorXd& residual) {
  const auto directed = [&](const Eigen::VectorXd& nu, Step& step) {
    step.z = -inverse_z_.cwiseProduct(gz + elements_.works(coordinates(nu)) / unit_N_);
    step.f.resize(gf.size());
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      const auto at = 3 * static_cast<Eigen::Index>(i);
      step.f.segment<3>(at) =
          -inverse_f_[i] * (gf.segment<3>(at) - nu.segment<3>(rowOf(contacts_[i].vertex)));
    }
    step.nu = nu;
  };
  const auto applied = [&](const Step& step) {
    return Eigen::VectorXd(this->residual(step.z, step.f) - weight_);
  };
  Step step;
  Eigen::VectorXd nu = Eigen::VectorXd::Zero(row_count_), correction;
  directed(nu, step);
  for (int k = 0; k <= kRefinements; ++k) {
    cholesky_.solve(Eigen::VectorXd(applied(step) + residual), correction);
    nu += correction;
    directed(nu, step);
  }
  return step;
}

/// (D^-1 - D^-1 A^T N^-1 A D^-1) columns, for columns of z alone; rows of z alone.
Eigen::MatrixXd MetricBarrier::reduced(const Eigen::MatrixXd& columns) {
  const auto& all = elements_.all();
  Eigen::MatrixXd pulled = Eigen::MatrixXd::Zero(row_count_, columns.cols());
  Eigen::MatrixXd out(columns.rows(), columns.cols());
  const auto inBlocks = [&](const auto& work) {
    // Always the same parts: rounding must not depend on which thread is free.
    tbb::parallel_for(
        tbb::blocked_range<Eigen::Index>(0, columns.cols(), kColumns),
        [&](const auto& range) { work(range.begin(), range.end() - range.begin()); },
        tbb::simple_partitioner());
  };
  inBlocks([&](Eigen::Index first, Eigen::Index count) {
    auto part = out.middleCols(first, count);
    part = inverse_z_.asDiagonal() * columns.middleCols(first, count);
    for (int i = 0; i < elements_.count(); ++i)
      for (int a = 0; a < all[i].node_count; ++a)
        if (const int row = rowOf(all[i].nodes[a]); row >= 0)
          pulled.block(row, first, 3, count).noalias() +=
              all[i].force.segment<3>(3 * a) / unit_N_ * part.row(i);
  });
  const Eigen::MatrixXd nu = cholesky_.solve(pulled);
  inBlocks([&](Eigen::Index first, Eigen::Index count) {
    for (int i = 0; i < elements_.count(); ++i)
      for (int a = 0; a < all[i].node_count; ++a)
        if (const int row = rowOf(all[i].nodes[a]); row >= 0)
          out.row(i).segment(first, count).noalias() -= inverse_z_[i] / unit_N_ *
                                                        all[i].force.segment<3>(3 * a).transpose() *
                                                        nu.block(row, first, 3, count);
  });
  return out;
}

/// How much of a step stays clear of the border, at most all of it.
double MetricBarrier::longest(const Step& step) const {
  double t = 1.0;
  for (Eigen::Index i = 0; i < z_.size(); ++i) {
    const double room = step.z[i] > 0.0 ? upper_[i] - z_[i] : z_[i] - lower_[i];
    if (std::abs(step.z[i]) * t > kToBorder * room) t = kToBorder * room / std::abs(step.z[i]);
  }
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const auto at = 3 * static_cast<Eigen::Index>(i);
    const Vec3 f = f_.segment<3>(at), d = step.f.segment<3>(at);
    // Near the apex both factors of the value shrink.
    const double least = std::pow(1.0 - kToBorder, 2) * coneValue(f, i);
    while (t > kLeastBarrierStep && !(coneValue(f + t * d, i) >= least)) t *= kShorterStep;
  }
  return t;
}

/// A share of a step that lowers the barrier and a linear objective, of that slope, as predicted.
double MetricBarrier::acceptable(const Step& step, double slope, double decrement) const {
  const double here = barrier(z_, f_);
  double t = longest(step);
  while (t > kLeastBarrierStep && !(t * slope + barrier(z_ + t * step.z, f_ + t * step.f) <=
                                    here - kSufficientDecrease * t * decrement * decrement))
    t *= kShorterStep;
  return t;
}

/// Positive inside { y : y_N >= mu |y_T| }, the motions against which no force of a cone works.
double MetricBarrier::dualRoom(const Contact& c, const Vec3& y) {
  const double normal = y.dot(c.normal);
  return normal - c.friction * (y - normal * c.normal).norm();
}

/// Whether no force of a cone does negative work along the motion of -nu.
bool MetricBarrier::coneHolds(const Eigen::VectorXd& nu) const {
  return std::ranges::all_of(contacts_, [&](const Contact& c) {
    return dualRoom(c, -nu.segment<3>(rowOf(c.vertex))) >= 0.0;
  });
}

void MetricBarrier::set(const Eigen::VectorXd& z) {
  z_ = z;
  f_ = forcesOf(z);
  mend();
}

/// Rounding that steps have left in the balance, taken away in the barrier's metric.
void MetricBarrier::mend() {
  weigh(z_, f_);
  if (!factorize()) return;
  const Eigen::VectorXd none_z = Eigen::VectorXd::Zero(z_.size()),
                        none_f = Eigen::VectorXd::Zero(f_.size());
  for (int k = 0; k < kRefinements; ++k) {
    const Step step = newton(none_z, none_f, residual(z_, f_));
    z_ += step.z;
    f_ += step.f;
  }
}

/// What z leaves at the contacts, in units.
Eigen::VectorXd MetricBarrier::forcesOf(const Eigen::VectorXd& z) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(contacts_.size()));
  const Eigen::VectorXd left = residual(z, out);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& c = contacts_[i];
    Vec3 force = left.segment<3>(rowOf(c.vertex));
    if (c.friction <= 0.0) force = force.dot(c.normal) * c.normal;  // the rest is not balanced
    out.segment<3>(3 * static_cast<Eigen::Index>(i)) = force;
  }
  return out;
}

bool MetricBarrier::inside(const Eigen::VectorXd& z) const {
  return std::isfinite(barrier(z, forcesOf(z)));
}

/// A proof counts once it has been checked.
void MetricBarrier::keepProof(Points3 motion, std::vector<Points3> modes) {
  SoftnessProof proof{std::move(motion), std::move(modes)};
  if (!proves(proof, shell_, fixed_, contacts_)) return;
  proof.bound = boundOf(proof, shell_, fixed_, contacts_);
  proof.weight_change = weightChangeOf(proof, shell_, fixed_, contacts_);
  if (!proof_ || proof.weight_change > proof_->weight_change) proof_ = std::move(proof);
}

/// Largest value of c . z within the bounds.
double MetricBarrier::slackOf(const Eigen::VectorXd& c) const {
  return c.cwiseProduct(lower_).cwiseMax(c.cwiseProduct(upper_)).sum();
}

/// Balanced states' analytic centre, about.
MetricBarrier::Outcome MetricBarrier::centre(const Limits& limits) {
  for (int k = 0; k < limits.max_steps; ++k) {
    if (limits.stop && limits.stop()) return Outcome::kStalled;
    weigh(z_, f_);
    if (!factorize()) return Outcome::kStalled;
    const Step step = newton(slope_z_, slope_f_, residual(z_, f_));
    const double decrement =
        std::sqrt(std::max(0.0, -(slope_z_.dot(step.z) + slope_f_.dot(step.f))));
    const double t = acceptable(step, 0.0, decrement);
    if (t <= kLeastBarrierStep) break;
    z_ += t * step.z;
    f_ += t * step.f;
    if (decrement < kCentralDecrement) break;
  }
  central_z_ = z_;
  central_f_ = f_;
  return Outcome::kReached;
}

MetricBarrier::Outcome MetricBarrier::balance(const Limits& limits) {
  z_ = Eigen::VectorXd::Zero(elements_.count());
  f_ = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(contacts_.size()));
  const double share = static_cast<double>(first_row_.size()) /
                       std::max<double>(1.0, static_cast<double>(contacts_.size()));
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    f_.segment<3>(3 * static_cast<Eigen::Index>(i)) = share * contacts_[i].normal;
  const Eigen::VectorXd start = residual(z_, f_);
  double left = 1.0, push = 1.0;
  for (int k = 0; k < limits.max_steps; ++k) {
    if (limits.stop && limits.stop()) return Outcome::kStalled;
    weigh(z_, f_);
    if (!factorize()) return Outcome::kStalled;
    const Eigen::VectorXd off = residual(z_, f_) - left * start;
    Step step = newton(slope_z_, slope_f_, off);
    const Eigen::VectorXd none_z = Eigen::VectorXd::Zero(z_.size()),
                          none_f = Eigen::VectorXd::Zero(f_.size());
    const Step by_left = newton(none_z, none_f, -start);
    const double change = (-push + start.dot(step.nu)) / (-start.dot(by_left.nu));
    step.z += change * by_left.z;
    step.f += change * by_left.f;
    step.nu += change * by_left.nu;
    if (coneHolds(step.nu)) {
      const Eigen::VectorXd y = coordinates(-step.nu);
      // Rows are in units of force, so is this work's bound.
      const double bound = slackOf(elements_.works(y) / unit_N_) - weight_.dot(step.nu);
      const double scale = y.cwiseAbs().maxCoeff();
      if (bound < 0.0) keepProof(Eigen::Map<const Points3>(y.data(), 3, y.size() / 3) / scale, {});
    }
    if (provedEnough()) return Outcome::kInfeasible;
    const double decrement =
        std::sqrt(std::max(0.0, -(slope_z_.dot(step.z) + slope_f_.dot(step.f) + push * change)));
    double t = acceptable(step, push * change, decrement);
    if (t <= kLeastBarrierStep) break;
    const bool reached = left + t * change <= 0.0;
    if (reached) t = left / -change;
    z_ += t * step.z;
    f_ += t * step.f;
    left += t * change;
    if (reached) return centre(limits);
    if (decrement < kCentralDecrement) push *= kBarrierGrowth;
  }
  return proof_ ? Outcome::kInfeasible : Outcome::kStalled;
}

}  // namespace tenter
