// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracked_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace tenter {

namespace {

using PlaceByPixel = Eigen::Matrix<double, 3, 2>;
using PixelByPlace = Eigen::Matrix<double, 2, 3>;

/// How a triangulated place moves with each sighting; also how the views see it.
struct Triangulated {
  std::vector<PlaceByPixel> place_by_pixel;
  std::vector<PixelByPlace> pixel_by_place;
};

Triangulated derivatives(const std::vector<CameraView>& views, const Vec3& place_m,
                         const std::vector<Sighting>& sightings) {
  Triangulated out;
  Mat3 normal = Mat3::Zero();
  for (const Sighting& sighting : sightings) {
    PixelByPlace jacobian = PixelByPlace::Zero();
    views[sighting.view].project(place_m, &jacobian);
    const PlaceByPixel weighted = jacobian.transpose() * sighting.covariance_px2.inverse();
    normal += weighted * jacobian;
    out.pixel_by_place.push_back(jacobian);
    out.place_by_pixel.push_back(weighted);
  }
  const Eigen::LDLT<Mat3> factor(normal);
  for (PlaceByPixel& rows : out.place_by_pixel) rows = factor.solve(rows).eval();
  return out;
}

Mat3 twice(const Mat3& m) { return m + m.transpose(); }

}  // namespace

void TrackedSightings::drop(std::size_t k) {
  const auto at = static_cast<std::ptrdiff_t>(k);
  now.erase(now.begin() + at);
  places.erase(places.begin() + at);
  now_from_rest_px.erase(now_from_rest_px.begin() + at);
}

Mat3 trackedCovariance(const std::vector<CameraView>& views, const RestSurface& surface, int vertex,
                       const Vec3& position_m, const TrackedSightings& seen, const Mat3& gradient) {
  const RestVertex& rest = surface.vertices[vertex];
  const Triangulated now = derivatives(views, position_m, seen.now);
  const Triangulated then =
      derivatives(views, surface.mesh.positions.col(vertex), surface.sightingsOf(vertex));
  // Of the displacement that a sighting's error at rest causes now: what is followed, less what
  // was taken back along the surface when the vertex was put on its node.
  std::vector<PlaceByPixel> by_rest;
  for (const PlaceByPixel& placed : then.place_by_pixel) by_rest.push_back(-gradient * placed);
  Mat3 covariance = Mat3::Zero(), now_from_rest = Mat3::Zero();
  std::vector<PlaceByPixel> followed(by_rest.size(), PlaceByPixel::Zero());
  for (std::size_t k = 0; k < seen.now.size(); ++k) {
    const std::size_t place = seen.places[k];
    const PlaceByPixel& by_pixel = now.place_by_pixel[k];
    covariance += by_pixel * seen.now[k].covariance_px2 * by_pixel.transpose();
    followed[place] = by_pixel * seen.now_from_rest_px[k];
    now_from_rest += followed[place] * then.pixel_by_place[place];
    by_rest[place] += followed[place];
  }
  const HeightNoise one, noise = rest.warped ? surface.height_noise : one;
  const double inflation2 = surface.inflation * surface.inflation;
  const Vec3 height_error = (now_from_rest - gradient) * rest.ray;
  double height_m2 = 0.0;
  Mat3 with_height = Mat3::Zero(), shared_errors = Mat3::Zero();
  for (std::size_t k = 0; k < by_rest.size(); ++k) {
    const Mat2& all = rest.sightings[k].sighting.covariance_px2;
    const Mat2 matched = all / inflation2;
    const double shared = rest.sightings[k].shared;
    const Eigen::RowVector2d height_by_pixel = rest.normal.transpose() * then.place_by_pixel[k];
    const Vec2 to_height = matched * height_by_pixel.transpose();
    height_m2 += height_by_pixel.dot(to_height);
    covariance += by_rest[k] * all * by_rest[k].transpose();
    shared_errors += twice(shared * followed[k] * matched * by_rest[k].transpose());
    with_height += ((noise.with_match - 1.0) * by_rest[k] -
                    shared * (noise.with_tracking - 1.0) * followed[k]) *
                   to_height * height_error.transpose();
  }
  const double shape_m2 =
      (noise.own - 2.0 * noise.with_match + 1.0) * height_m2 + rest.shape_variance_m2;
  covariance += shape_m2 * height_error * height_error.transpose();
  const Mat3 joint = covariance - shared_errors + twice(with_height);
  // What errors have in common is estimated. Where it would outweigh them, on a slope that one view
  // hardly sees, they are taken as independent.
  return Eigen::LLT<Mat3>(joint).info() == Eigen::Success ? joint : covariance;
}

}  // namespace tenter
