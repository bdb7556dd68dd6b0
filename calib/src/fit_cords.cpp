// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "tenter/calib/cord_calibration.h"
#include "tenter/calib/cord_friction.h"

namespace tenter {
namespace {

constexpr int kLeastSamples = 50;
constexpr double kTautShare = 0.2;  // of the highest tension; below, the cord may hang through
constexpr double kLeastTension_N = 0.1;
constexpr double kDependent = 1e-9;  // columns that differ by less say the same
constexpr double kLeastWay_m = 5e-4;
constexpr double kShortest_m = 5e-6, kLongest_m = 5e-3;  // of presliding
constexpr int kGrid = 25, kGolden = 30;

struct LinearFit {
  Eigen::VectorXd coefficients, sigmas;
  double squares = 0.0, rms = 0.0;
  int samples = 0;
};

/// Least squares of `y` on the columns of `a`.
std::optional<LinearFit> solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& y) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
  qr.setThreshold(kDependent);
  if (qr.rank() < a.cols() || a.rows() <= a.cols()) return std::nullopt;
  LinearFit fit;
  fit.coefficients = qr.solve(y);
  fit.squares = (a * fit.coefficients - y).squaredNorm();
  const double variance = fit.squares / static_cast<double>(a.rows() - a.cols());
  fit.sigmas = (variance * (a.transpose() * a).inverse().diagonal()).cwiseSqrt();
  fit.rms = std::sqrt(variance);
  fit.samples = static_cast<int>(a.rows());
  return fit;
}

/// Samples in which the cord surely pulls.
std::vector<Eigen::Index> tautSamples(const CordRecord& record) {
  double highest_N = 0.0;
  for (const double tension_N : record.tensions_N) {
    if (std::isfinite(tension_N)) highest_N = std::max(highest_N, tension_N);
  }
  std::vector<Eigen::Index> taut;
  if (highest_N < kLeastTension_N) return taut;
  for (std::size_t i = 0; i < record.tensions_N.size(); ++i) {
    const double tension_N = record.tensions_N[i];
    if (std::isfinite(tension_N) && tension_N > kTautShare * highest_N) {
      taut.push_back(static_cast<Eigen::Index>(i));
    }
  }
  return taut;
}

double wayOf(const CordRecord& record) {
  const auto [least, most] =
      std::minmax_element(record.positions_m.begin(), record.positions_m.end());
  return record.positions_m.empty() ? 0.0 : *most - *least;
}

Error cannot(const CordRecord& record, const std::string& why, const std::string& advice) {
  return badInput("", record.axis, why, advice);
}

/// Tension = constant + spring * x + friction * share(x), the share by travel with that presliding.
std::optional<LinearFit> fitLoop(const CordRecord& record, const std::vector<Eigen::Index>& taut,
                                 double presliding_m) {
  const auto rows = static_cast<Eigen::Index>(taut.size());
  std::vector<double> shares;
  PulleyFriction friction(presliding_m, -1.0);
  for (std::size_t i = 0; i < record.positions_m.size(); ++i) {
    const double before_m = record.positions_m[i > 0 ? i - 1 : 0];
    shares.push_back(friction.follow(record.positions_m[i] - before_m));
  }
  Eigen::MatrixXd a(rows, 3);
  Eigen::VectorXd y(rows);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const auto i = static_cast<std::size_t>(taut[static_cast<std::size_t>(r)]);
    a.row(r) << 1.0, record.positions_m[i], shares[i];
    y[r] = record.tensions_N[i];
  }
  return solve(a, y);
}

/// Where the residual is smallest: a grid, then the golden section.
template <class Function>
double minimum(const Function& squares) {
  const double low = std::log(kShortest_m), high = std::log(kLongest_m);
  int best = 0;
  double best_squares = 1e300;
  const auto at = [&](int i) { return low + (high - low) * i / (kGrid - 1); };
  for (int i = 0; i < kGrid; ++i) {
    const double here = squares(std::exp(at(i)));
    if (here < best_squares) {
      best_squares = here;
      best = i;
    }
  }
  double left = at(std::max(0, best - 1)), right = at(std::min(kGrid - 1, best + 1));
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  for (int i = 0; i < kGolden; ++i) {
    const double a = right - ratio * (right - left), b = left + ratio * (right - left);
    if (squares(std::exp(a)) < squares(std::exp(b))) {
      right = b;
    } else {
      left = a;
    }
  }
  return std::exp(0.5 * (left + right));
}

}  // namespace

Result<CordFrictionFit> fitCordFriction(const CordRecord& record) {
  require(record.positions_m.size() == record.tensions_N.size(),
          "fitCordFriction: as many tensions as positions");
  const std::vector<Eigen::Index> taut = tautSamples(record);
  if (taut.size() < kLeastSamples || wayOf(record) < kLeastWay_m) {
    return cannot(record, "has too few readings under tension",
                  "draw the cord in on a spring, well above its slack, and let it out again");
  }
  const auto squares = [&](double presliding_m) {
    const auto fit = fitLoop(record, taut, presliding_m);
    return fit ? fit->squares : 1e300;
  };
  const double presliding_m = minimum(squares);
  const auto fit = fitLoop(record, taut, presliding_m);
  if (!fit) {
    return cannot(record, "goes one way only, so that friction does not show",
                  "draw the cord in and let it out again");
  }
  return CordFrictionFit{fit->coefficients[2], fit->sigmas[2], presliding_m,
                         fit->coefficients[1], fit->rms,       fit->samples};
}

Result<CordStretchFit> fitCordStretch(const CordRecord& record) {
  require(record.positions_m.size() == record.tensions_N.size(),
          "fitCordStretch: as many tensions as positions");
  const std::vector<Eigen::Index> taut = tautSamples(record);
  const auto rows = static_cast<Eigen::Index>(taut.size());
  if (rows < kLeastSamples) {
    return cannot(record, "has too few readings under tension",
                  "draw the cord in against its held end");
  }
  CordStretchFit out;
  for (const Eigen::Index i : taut) {
    out.at_m += record.positions_m[static_cast<std::size_t>(i)] / static_cast<double>(rows);
  }
  Eigen::MatrixXd a(rows, 3);
  Eigen::VectorXd y(rows);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const auto i = static_cast<std::size_t>(taut[static_cast<std::size_t>(r)]);
    const double x = record.positions_m[i] - out.at_m;
    a.row(r) << 1.0, x, 0.5 * x * x;
    y[r] = record.tensions_N[i];
  }
  const auto fit = solve(a, y);
  if (!fit || !(fit->coefficients[1] > 0.0)) {
    return cannot(record, "does not get tighter as it is drawn in", "is its end held?");
  }
  out.stiffness_N_per_m = fit->coefficients[1];
  out.stiffness_sigma_N_per_m = fit->sigmas[1];
  out.curvature_N_per_m2 = fit->coefficients[2];
  out.rms_N = fit->rms;
  out.samples = fit->samples;
  return out;
}

}  // namespace tenter
