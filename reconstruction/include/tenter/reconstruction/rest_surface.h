// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tenter/core/mesh.h"
#include "tenter/reconstruction/correlate.h"
#include "tenter/reconstruction/systematic_error.h"

namespace tenter {

struct SurfaceOptions {
  CorrelateOptions correlate;  ///< Of subsets between views and between frames.
  /// A vertex whose sightings lie farther from its projections is not valid [px RMS].
  double max_residual_px = 0.5;
  int vertices_per_side = 100;  ///< Of the longer side of the mesh.
};

/// A sighting of a vertex and the middle of the subset by which it is found again.
struct VertexSighting {
  Sighting sighting;
  Vec2 centre = Vec2::Zero();
  /// What share of that subset's pixels those are by which the sighting was found.
  double shared = 1.0;
};

/// The noise of heights that come of passes over the surface, in the variance that their last
/// matches alone give them (docs/reconstruction.md).
struct HeightNoise {
  double own = 1.0;            ///< Variance.
  double with_match = 1.0;     ///< Covariance with that of the last matches.
  double with_tracking = 1.0;  ///< Covariance with what following the same subsets makes of it.
};

/// A vertex of the mesh at rest.
struct RestVertex {
  PointState state = PointState::kNotFound;
  SpacePoint point;                       ///< If valid.
  std::vector<VertexSighting> sightings;  ///< The views that show it; at least two if valid.
  double zncc = 0.0;                      ///< Least of those between views.
  bool warped = false;  ///< Matched with the surface's shape taken out, by heights around it.
  /// Heights of this vertex: how much a displacement changes them, and the direction in which they
  /// err, along which that is 1.
  Vec3 normal = Vec3::Zero(), ray = Vec3::Zero();
  double shape_variance_m2 = 0.0;  ///< Of the height, beyond noise: what a subset does not follow.
  /// Of its place at rest, where a systematic error is known (RestSurface::systematic).
  SystematicError::PlaceRows by_parameters;
};

/// The surface at rest and what is needed to follow it.
struct RestSurface {
  TriangleMesh mesh;  ///< In space, with (u, v) [m].
  std::vector<RestVertex> vertices;
  int columns = 0, rows = 0;  ///< Of the whole grid; the mesh may hold a part of it.
  std::vector<int> node_of_vertex;
  double pixel_m = 0.0;      ///< What a pixel covers, the median.
  double residual_px = 0.0;  ///< Median over valid vertices.
  HeightNoise height_noise;  ///< Of vertices that are `warped`.
  /// What sightings' sigmas fall short of their residuals, at least 1, where each view's offset
  /// that varies linearly over its image is left out ...
  double inflation = 1.0;
  double offset_px = 0.0;  ///< ... and its standard deviation per axis: calibrations err.
  /// What is added to a place's covariance for that; null: nothing.
  std::shared_ptr<const SystematicError> systematic;
  std::vector<std::string> warnings;

  std::size_t validCount() const;
  /// Systematic part of a vertex's place, seen by `sightings`. Along the surface a vertex is where
  /// its node is, whatever the calibration: there only what has changed since rest errs. `gradient`
  /// takes vectors along the surface from rest to the moment. Zero where nothing is known.
  Mat3 systematicAt(int vertex, const Vec3& position_m, std::span<const Sighting> sightings,
                    const Mat3& gradient) const;
  /// The sightings at rest.
  std::vector<Sighting> sightingsOf(int vertex) const;
};

/// By the calibration's covariance, or where it states none (or none is given) by how far views
/// disagree; says so in the surface's warnings.
void addSystematicError(const CameraCalibration* calibration, const std::vector<CameraView>& views,
                        RestSurface& surface);

/// The part of a sheet to be meshed: nodes origin + (i, j) spacing in the sheet's plane.
struct SheetGrid {
  Eigen::Isometry3d space_from_sheet = Eigen::Isometry3d::Identity();
  Vec2 origin_m = Vec2::Zero(), spacing_m = Vec2::Zero();
  int columns = 0, rows = 0;
  /// Whether the cloth can be seen at a place of the sheet [m]: subsets stay where it can.
  std::function<bool(const Vec2&)> free;
  double margin_m = 0.0;  ///< How much `free` may err outwards.
  /// Whether subsets of vertices near what is not free are moved to where all is free; otherwise
  /// such vertices are left out.
  bool to_the_edge = false;
  /// Material coordinates of a place.
  std::function<Vec2(const Vec2&)> uv;

  Vec2 place(int node) const {
    return origin_m + Vec2(node % columns, node / columns).cwiseProduct(spacing_m);
  }
};

/// Surface from images of one moment without any knowledge of where it lies: semi-global matching
/// finds it, subsets between views refine it. (u, v) are coordinates in the plane nearest to the
/// surface, u as the columns of the first view run, from the mesh's corner. Views with an empty
/// image are left out. `inside` (may be empty) says which pixels of the first view count. Error
/// (without a file): nothing in common between the views, texture that repeats, too few vertices.
Result<RestSurface> findSurface(const std::vector<CameraView>& views,
                                const std::vector<GrayImage>& images, const SurfaceOptions& options,
                                const std::function<bool(const Vec2&)>& inside = {});

/// The same on a grid that is given: a sheet that lies near its plane.
Result<RestSurface> findSheet(const std::vector<CameraView>& views,
                              const std::vector<GrayImage>& images, const SurfaceOptions& options,
                              const SheetGrid& grid);

}  // namespace tenter
