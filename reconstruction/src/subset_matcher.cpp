// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/subset_matcher.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "subset_sums.h"
#include "warp_algebra.h"

namespace tenter {

namespace {

/// Below this the subset holds no structure but rounding [grey levels RMS].
constexpr double kLeastContrast = 0.5;
/// Pivot of the normal equations below which a direction of motion is not seen.
constexpr double kLeastPivot = 1e-6;
/// Independent values that the smoothed misfit of a subset must hold to tell its noise.
constexpr double kLeastFreedom = 20.0;
/// What interpolation may shift a match by though there is no noise at all [px RMS].
constexpr double kInterpolationError_px = 0.0015;
/// Of a point off the centre of its subset: what terms beyond the warp's order may add, of what the
/// highest adds.
constexpr double kTruncation = 1.0;
/// A subset whose area changes by more than this factor has been folded or lost.
constexpr double kLargestStretch = 4.0;
template <int kOrder>
class Matching {
 public:
  static constexpr int kTerms = kOrder == 1 ? 3 : 6;  ///< Monomials of the warp.
  static constexpr int kParameters = 2 * kTerms;
  using Vector = Eigen::Matrix<double, kParameters, 1>;
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;

  Matching(const GradientImage& reference, const MatchOptions& options, const SubsetGrid& grid,
           MatchScratch& scratch)
      : reference_(reference), options_(options), grid_(grid), s_(scratch) {
    for (auto* values : {&s_.f, &s_.gx, &s_.gy, &s_.x, &s_.y, &s_.g}) values->resize(grid.size());
  }

  SubsetMatch run(const SplineImage& deformed, const Vec2& point, const Vec2& centre,
                  const SubsetWarp& guess) {
    SubsetMatch result;
    result.warp = guess;
    const int cx = static_cast<int>(std::lround(centre.x()));
    const int cy = static_cast<int>(std::lround(centre.y()));
    const int r = grid_.radius;
    if (cx < r || cy < r || cx + r >= reference_.width() || cy + r >= reference_.height()) {
      result.end = MatchEnd::kOutside;
      return result;
    }
    if (!prepare(cx, cy)) {
      result.end = MatchEnd::kNoTexture;
      return result;
    }
    const Vec2 offset(point.x() - cx, point.y() - cy);
    const SubsetWarp start = withoutHigherTerms(guess.movedBy(-offset));
    SubsetWarp warp = start;
    result.end = iterate(deformed, cx, cy, start, warp, result);
    if (result.end != MatchEnd::kConverged) return result;
    result.covariance_px2 = covarianceAt(offset, warp, result, cx, cy);
    result.warp = warp.movedBy(offset);
    return result;
  }

 private:
  SubsetWarp withoutHigherTerms(SubsetWarp warp) const {
    for (int k = kTerms; k < 6; ++k) warp.u[k] = warp.v[k] = 0.0;
    return warp;
  }

  /// Reads the subset and factorises its normal equations; false if it has too little texture.
  bool prepare(int cx, int cy) {
    readSubset(cx, cy);
    f_norm_ = removeMean(grid_, s_.f);
    if (!(f_norm_ >= kLeastContrast * grid_.side)) return false;
    Matrix h = normalMatrix();
    // Offset and gain are estimated too: what they explain of a motion's effect is not seen.
    const Vector ones = joined(projectOnes(grid_, s_.gx), projectOnes(grid_, s_.gy));
    const Vector texture = project(s_.f);
    h -= ones * ones.transpose() / grid_.count();
    h -= texture * texture.transpose() / (f_norm_ * f_norm_);
    h *= reference_.sharpness();
    factor_.compute(h);
    const auto pivots = factor_.vectorD().array();
    return factor_.info() == Eigen::Success &&
           pivots.minCoeff() > kLeastPivot * std::max(pivots.maxCoeff(), 1.0);
  }

  void readSubset(int cx, int cy) {
    for (int row = 0; row < grid_.side; ++row) {
      const int x = cx - grid_.radius, y = cy - grid_.radius + row;
      const auto copy = [&](const float* from, std::vector<float>& to) {
        float* target = &to[static_cast<std::size_t>(row) * grid_.stride];
        std::copy_n(from, grid_.side, target);
        std::fill(target + grid_.side, target + grid_.stride, 0.0F);
      };
      copy(reference_.values(x, y), s_.f);
      copy(reference_.slopesX(x, y), s_.gx);
      copy(reference_.slopesY(x, y), s_.gy);
    }
  }

  Matrix normalMatrix() const {
    const GradientMoments moments = gradientMoments(grid_, s_.gx, s_.gy, 2 * kOrder);
    Matrix h;
    for (int k = 0; k < kTerms; ++k) {
      for (int l = 0; l < kTerms; ++l) {
        const Monomial &p = kMonomials[k], &q = kMonomials[l];
        const double factor = p.factor * q.factor;
        const int i = p.i + q.i, j = p.j + q.j;
        h(k, l) = factor * moments.xx[i][j];
        h(k, kTerms + l) = h(kTerms + l, k) = factor * moments.xy[i][j];
        h(kTerms + k, kTerms + l) = factor * moments.yy[i][j];
      }
    }
    return h;
  }

  static Vector joined(const std::array<double, 6>& x, const std::array<double, 6>& y) {
    Vector both;
    for (int k = 0; k < kTerms; ++k) {
      both(k) = x[k];
      both(kTerms + k) = y[k];
    }
    return both;
  }

  /// Sums over the subset of `values` times the derivatives by the parameters.
  Vector project(const std::vector<float>& values) const {
    return joined(projectOn(grid_, values, s_.gx), projectOn(grid_, values, s_.gy));
  }

  MatchEnd iterate(const SplineImage& deformed, int cx, int cy, const SubsetWarp& start,
                   SubsetWarp& warp, SubsetMatch& result) {
    for (int i = 1; i <= options_.max_iterations; ++i) {
      result.iterations = i;
      if (!sampleWarped(deformed, cx, cy, warp)) return MatchEnd::kOutside;
      const double g_norm = removeMean(grid_, s_.g);
      if (!(g_norm > 0.0)) return MatchEnd::kNoTexture;
      result.zncc = dot(grid_, s_.f, s_.g) / (f_norm_ * g_norm);
      result.gain = g_norm / f_norm_;
      subtractFrom(s_.f, static_cast<float>(f_norm_ / g_norm), s_.g);
      const Vector step = factor_.solve(project(s_.g));
      if (!composeWithInverse(warp, incrementOf(-step), kOrder)) return MatchEnd::kDiverged;
      const double moved = (warp.displacement() - start.displacement()).norm();
      const double area = warp.linear().determinant();
      if (!(moved <= grid_.radius) || !(area > 1.0 / kLargestStretch) ||
          !(area < kLargestStretch)) {
        return MatchEnd::kDiverged;
      }
      if (step.norm() < options_.tolerance_px) return MatchEnd::kConverged;
    }
    return MatchEnd::kNotConverged;
  }

  /// From offsets over the radius to offsets in pixels.
  SubsetWarp incrementOf(const Vector& step) const {
    const double r = grid_.radius;
    SubsetWarp increment;
    for (int k = 0; k < kTerms; ++k) {
      const double scale = k == 0 ? 1.0 : k < 3 ? 1.0 / r : 1.0 / (r * r);
      increment.u[k] = scale * step(k);
      increment.v[k] = scale * step(kTerms + k);
    }
    return increment;
  }

  /// Puts the deformed image at the warped pixels into the scratch; false if some are outside.
  bool sampleWarped(const SplineImage& deformed, int cx, int cy, const SubsetWarp& warp) {
    const double x0 = cx + warp.u[0], y0 = cy + warp.v[0];
    if (!(x0 >= 0.0 && y0 >= 0.0 && x0 < deformed.width() && y0 < deformed.height())) return false;
    // Near enough for single precision, far enough that the whole subset lies beyond.
    const int reach = 3 * grid_.side;
    const int base_x = static_cast<int>(x0) - reach, base_y = static_cast<int>(y0) - reach;
    const Extent x = warpedPlaces(grid_, warp.u, x0 - base_x, true, s_.x);
    const Extent y = warpedPlaces(grid_, warp.v, y0 - base_y, false, s_.y);
    const auto inside = [](const Extent& extent, int base, int size) {
      return extent.min >= static_cast<float>(std::max(0, -base)) &&
             extent.max <= static_cast<float>(size - 1 - base);
    };
    if (!inside(x, base_x, deformed.width()) || !inside(y, base_y, deformed.height())) return false;
    for (int row = 0; row < grid_.side; ++row) {
      const std::size_t begin = static_cast<std::size_t>(row) * grid_.stride;
      const auto count = static_cast<std::size_t>(grid_.side);
      deformed.sample(base_x, base_y, {&s_.x[begin], count}, {&s_.y[begin], count},
                      {&s_.g[begin], count});
    }
    return true;
  }

  /// sigma^2 (J' J)^-1 at an offset from the centre, as the warp carries it to the deformed image.
  Mat2 covarianceAt(const Vec2& offset, const SubsetWarp& warp, const SubsetMatch& match, int cx,
                    int cy) {
    const double noise = noiseVariance(warp, match, cx, cy);
    Eigen::Matrix<double, kParameters, 2> at;
    at.setZero();
    const auto monomials = monomialsAt(offset / grid_.radius);
    for (int k = 0; k < kTerms; ++k) at(k, 0) = at(kTerms + k, 1) = monomials[k];
    const Mat2 here = noise / reference_.sharpness() * at.transpose() * factor_.solve(at);
    const Mat2 linear = warp.movedBy(offset).linear();
    const Mat2 random = linear * here * linear.transpose();
    // What the next order would add off the centre is not known; the last one says how much it may.
    const Vec2 affine = warp.displacement() + (warp.linear() - Mat2::Identity()) * offset;
    const double truncated_px = kTruncation * (warp.displacementAt(offset) - affine).norm();
    const double fixed = kInterpolationError_px * kInterpolationError_px;
    return random + (fixed + truncated_px * truncated_px) * Mat2::Identity();
  }

  /// Of both images together, from the misfit that the last step left in the scratch. Only noise as
  /// coarse as the texture moves a match, so the misfit is smoothed before its squares are summed:
  /// interpolation neither adds to that part nor takes much away. Takes both images as equally
  /// noisy.
  double noiseVariance(const SubsetWarp& warp, const SubsetMatch& match, int cx, int cy) {
    // The deformed image's noise was scaled with its contrast before it was compared.
    const double share = 1.0 / (1.0 + match.gain * match.gain);
    const double left_by_interpolation = 1.0 - share + share * meanNoiseGain(grid_, warp, cx, cy);
    const double fitted = kParameters + 2.0;
    const double pixels = (grid_.side - 2.0) * (grid_.side - 2.0);
    const double freedom = kSmoothingGain * pixels - reference_.smoothedShare() * fitted;
    if (freedom > kLeastFreedom) {
      return smoothedSquares(grid_, s_.g, s_.x) / freedom / left_by_interpolation;
    }
    const double misfit = 2.0 * f_norm_ * f_norm_ * std::max(0.0, 1.0 - match.zncc);
    return misfit / (grid_.count() - fitted) / left_by_interpolation;
  }

  const GradientImage& reference_;
  const MatchOptions& options_;
  const SubsetGrid& grid_;
  MatchScratch& s_;
  Eigen::LDLT<Matrix> factor_;
  double f_norm_ = 0.0;
};

}  // namespace

Result<void> checkMatchOptions(const MatchOptions& options) {
  if (options.subset_px < 7 || options.subset_px > 255 || options.subset_px % 2 == 0) {
    return usageError("--subset must be an odd number from 7 to 255");
  }
  if (options.order != 1 && options.order != 2) return usageError("--order must be 1 or 2");
  if (options.max_iterations < 1) return usageError("at least one iteration is needed");
  if (!(options.tolerance_px > 0.0)) return usageError("the tolerance must be positive");
  return {};
}

SubsetMatcher::SubsetMatcher(const GradientImage& reference, const MatchOptions& options)
    : reference_(reference),
      options_(options),
      grid_(std::make_shared<const SubsetGrid>(options.subset_px)) {
  const auto usable = checkMatchOptions(options);
  require(usable.ok(), usable.ok() ? "" : usable.error().message());
}

SubsetMatch SubsetMatcher::match(const SplineImage& deformed, const Vec2& point, const Vec2& centre,
                                 const SubsetWarp& guess, MatchScratch& scratch) const {
  if (options_.order == 1) {
    return Matching<1>(reference_, options_, *grid_, scratch).run(deformed, point, centre, guess);
  }
  return Matching<2>(reference_, options_, *grid_, scratch).run(deformed, point, centre, guess);
}

}  // namespace tenter
