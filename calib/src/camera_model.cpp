// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/camera_model.h"

#include <ceres/jet.h>

#include <cmath>
#include <string>

#include "lens_equations.h"

namespace tenter {

namespace {

constexpr int kMaxSize_px = 65536;
constexpr double kMaxFocal_px = 1e7;
/// Ten image sizes: an optical axis that far off is a swapped number.
constexpr double kMaxCentreOffset = 10.0;
/// tan(72 degrees); a pinhole model describes no wider lens.
constexpr double kMaxRadius = 3.0;
constexpr double kMinDepth = 1e-9;

using Jet2 = ceres::Jet<double, 2>;
using Jet3 = ceres::Jet<double, 3>;
using Distortion = std::array<double, kDistortionTerms>;

template <class T>
std::array<T, kDistortionTerms> coefficientsAs(const Distortion& values) {
  std::array<T, kDistortionTerms> out;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = T(values[i]);
  return out;
}

/// First radius at which r * radial(r) stops growing, or kMaxRadius.
double firstFold(const Distortion& d) {
  constexpr int kSteps = 3000;
  double before = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = kMaxRadius * i / kSteps, r2 = r * r;
    const double upper = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double lower = 1.0 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
    const double now = r * upper / lower;
    if (!(now > before) || !(lower > 0.0)) return kMaxRadius * (i - 1) / kSteps;
    before = now;
  }
  return kMaxRadius;
}

Error wrong(const std::string& field, const std::string& reason) {
  return badInput("", field, reason, "check the unit");
}

}  // namespace

Result<CameraModel> CameraModel::make(int width_px, int height_px, const Lens& lens) {
  if (width_px < 1 || width_px > kMaxSize_px) return wrong("width_px", "must be 1 to 65536");
  if (height_px < 1 || height_px > kMaxSize_px) return wrong("height_px", "must be 1 to 65536");
  for (const auto& [field, value] : {std::pair{"fx_px", lens.fx_px}, {"fy_px", lens.fy_px}}) {
    if (!(value > 0.0 && value <= kMaxFocal_px)) return wrong(field, "must lie in 0 to 1e7");
  }
  const auto centred = [](double centre, int size) {
    return std::abs(centre) <= kMaxCentreOffset * size;
  };
  if (!centred(lens.cx_px, width_px)) return wrong("cx_px", "lies far outside of the image");
  if (!centred(lens.cy_px, height_px)) return wrong("cy_px", "lies far outside of the image");
  for (const double coefficient : lens.distortion) {
    if (!std::isfinite(coefficient)) return wrong("distortion", "must be finite numbers");
  }
  CameraModel model;
  model.width_px_ = width_px;
  model.height_px_ = height_px;
  model.lens_ = lens;
  model.radius_limit_ = firstFold(lens.distortion);
  return model;
}

std::optional<Vec2> CameraModel::project(const Vec3& point_m,
                                         Eigen::Matrix<double, 2, 3>* jacobian) const {
  if (!(point_m.z() > kMinDepth)) return std::nullopt;
  if (point_m.head<2>().norm() > radius_limit_ * point_m.z()) return std::nullopt;
  if (jacobian == nullptr) {
    double x = 0.0, y = 0.0;
    lens_equations::distort<true>(lens_.distortion.data(), point_m.x() / point_m.z(),
                                  point_m.y() / point_m.z(), x, y);
    return Vec2(lens_.fx_px * x + lens_.cx_px, lens_.fy_px * y + lens_.cy_px);
  }
  const auto coefficients = coefficientsAs<Jet3>(lens_.distortion);
  const Jet3 depth(point_m.z(), 2);
  Jet3 x, y;
  lens_equations::distort<true>(coefficients.data(), Jet3(point_m.x(), 0) / depth,
                                Jet3(point_m.y(), 1) / depth, x, y);
  jacobian->row(0) = lens_.fx_px * x.v.transpose();
  jacobian->row(1) = lens_.fy_px * y.v.transpose();
  return Vec2(lens_.fx_px * x.a + lens_.cx_px, lens_.fy_px * y.a + lens_.cy_px);
}

std::optional<Vec2> CameraModel::normalized(const Vec2& pixel) const {
  constexpr int kMaxIterations = 50;
  constexpr double kTolerance = 1e-12;
  const Vec2 target((pixel.x() - lens_.cx_px) / lens_.fx_px,
                    (pixel.y() - lens_.cy_px) / lens_.fy_px);
  if (!target.allFinite()) return std::nullopt;
  const auto coefficients = coefficientsAs<Jet2>(lens_.distortion);
  Vec2 guess = target;
  if (guess.norm() > radius_limit_) guess *= radius_limit_ / guess.norm();
  for (int i = 0; i < kMaxIterations; ++i) {
    Jet2 x, y;
    lens_equations::distort<true>(coefficients.data(), Jet2(guess.x(), 0), Jet2(guess.y(), 1), x,
                                  y);
    const Vec2 error = Vec2(x.a, y.a) - target;
    if (error.norm() < kTolerance * (1.0 + target.norm())) return guess;
    Mat2 slope;
    slope << x.v.transpose(), y.v.transpose();
    if (!(slope.determinant() > 0.0)) return std::nullopt;
    Vec2 step = slope.inverse() * error;
    // Newton may jump over the fold; a step that would is shortened until it does not.
    while ((guess - step).norm() > radius_limit_ && step.norm() > kTolerance) step *= 0.5;
    guess -= step;
  }
  return std::nullopt;
}

bool CameraModel::contains(const Vec2& pixel) const {
  return pixel.x() >= -0.5 && pixel.x() <= width_px_ - 0.5 && pixel.y() >= -0.5 &&
         pixel.y() <= height_px_ - 0.5;
}

}  // namespace tenter
