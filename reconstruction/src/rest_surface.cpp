// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/rest_surface.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "coarse_surface.h"
#include "grid_mesh.h"
#include "parallel_for.h"
#include "shape_error.h"
#include "sheet_heights.h"
#include "subset_centres.h"
#include "surface_warp.h"
#include "tenter/core/median.h"
#include "view_matcher.h"
#include "view_offsets.h"

namespace tenter {

namespace {

/// Cells of the coarse surface [px].
constexpr double kCell_px = 4.0;
/// Passes of matching: the first from the coarse surface, the last on the exact nodes.
constexpr int kPasses = 2;
/// Passes of matching what the surface's own shape has been taken out of.
constexpr int kWarpPasses = 3;
/// How far heights are smoothed between them each way, in subsets' sides, but at least so many
/// nodes.
constexpr double kSmoothing = 0.6;
constexpr int kLeastReach = 2;
/// Places tried for texture that occurs again, each way, and the correlation that counts.
constexpr int kRepeatPlaces = 3;
constexpr double kRepeats = 0.85;
constexpr std::size_t kLeastVertices = 9;
/// A sheet lies this near to its plane at rest, in parts of its size.
constexpr double kFlatness = 0.05;
/// How much larger than the sheet the part of the cloud is that counts.
constexpr double kBorder = 0.05;

double shareOf(int freedom) {
  const double k = freedom;
  return k * std::pow(1.0 - 2.0 / (9.0 * k), 3.0);
}

/// The place nearest to a node around which a subset sees nothing but cloth.
std::optional<Vec2> subsetPlace(const SheetGrid& grid, const Vec2& place, double half_m) {
  const auto free = freeSquare(place, half_m, grid.free);
  if (free && *free != place && !grid.to_the_edge) return std::nullopt;
  return free;
}

void matchNodes(const SheetGrid& grid, const SheetHeights& heights, const ViewMatcher& matcher,
                const SurfaceOptions& options, std::vector<RestVertex>& vertices) {
  const int threads = options.correlate.threads;
  std::vector<MatchScratch> scratch(static_cast<std::size_t>(std::max(threads, 1)));
  parallelFor(vertices.size(), threads, [&](std::size_t i, std::size_t worker) {
    const int node = static_cast<int>(i);
    vertices[i] = {};
    if (!heights.known(node)) return;
    const SurfaceElement element = heights.element(node);
    const double half_m = matcher.halfSubset_m(element);
    vertices[i].state = PointState::kOutside;
    if (!(half_m > 0.0)) return;
    const auto middle = subsetPlace(grid, grid.place(node), half_m + grid.margin_m);
    if (!middle || !heights.known(heights.nodeNear(*middle))) return;
    vertices[i] = matcher.match(element, heights.elementAt(*middle), scratch[worker]);
  });
}

/// Moves matched vertices along the surface onto their nodes, sightings with them.
void settleOnNodes(const std::vector<CameraView>& views, const SheetGrid& grid,
                   const SheetHeights& heights, std::vector<RestVertex>& vertices) {
  const Eigen::Isometry3d sheet_from_space = grid.space_from_sheet.inverse();
  for (int node = 0; node < static_cast<int>(vertices.size()); ++node) {
    RestVertex& vertex = vertices[node];
    if (vertex.state != PointState::kValid) continue;
    SurfaceElement element = heights.element(node);
    element.point_m = vertex.point.position_m;
    const Vec2 off = grid.place(node) - (sheet_from_space * element.point_m).head<2>();
    vertex.point.position_m += element.tangents * off;
    for (VertexSighting& s : vertex.sightings) {
      const auto seen = viewElement(views[s.sighting.view], element);
      if (!seen) continue;
      s.sighting.pixel += seen->pixel_from_tangents * off;
      s.centre += seen->pixel_from_tangents * off;
    }
  }
}

/// Error if the texture occurs again at most of the places looked at.
Result<void> checkRepeats(const SheetGrid& grid, const SheetHeights& heights,
                          const ViewMatcher& matcher) {
  int tried = 0, repeated = 0;
  Vec2 offset = Vec2::Zero();
  for (int i = 1; i <= kRepeatPlaces; ++i) {
    for (int j = 1; j <= kRepeatPlaces; ++j) {
      const int node = (grid.rows * i / (kRepeatPlaces + 1)) * grid.columns +
                       grid.columns * j / (kRepeatPlaces + 1);
      if (!heights.known(node)) continue;
      ++tried;
      const auto repeat = matcher.repeatOf(heights.element(node));
      if (!repeat || repeat->zncc < kRepeats) continue;
      ++repeated;
      offset = repeat->offset_px;
    }
  }
  if (tried == 0 || 2 * repeated <= tried) return {};
  return badInput("", "",
                  "the texture repeats: pieces of it occur again (" +
                      std::to_string(std::lround(offset.x())) + ", " +
                      std::to_string(std::lround(offset.y())) + ") px away",
                  "print a texture without period, such as that of tenter pattern texture");
}

void judgeResiduals(const std::vector<CameraView>& views, RestSurface& surface) {
  const ViewOffsets offsets(views, surface.vertices);
  surface.offset_px = offsets.offsetPx();
  std::vector<double> residuals, ratios;
  for (const RestVertex& vertex : surface.vertices) {
    if (vertex.state != PointState::kValid) continue;
    residuals.push_back(vertex.point.residual_px);
    ratios.push_back(offsets.chi2(vertex) /
                     shareOf(2 * static_cast<int>(vertex.sightings.size()) - 3));
  }
  surface.residual_px = medianOf(residuals);
  surface.inflation = std::sqrt(std::max(1.0, medianOf(ratios)));
  const double factor = surface.inflation * surface.inflation;
  for (RestVertex& vertex : surface.vertices) {
    vertex.point.covariance_m2 *= factor;
    for (VertexSighting& s : vertex.sightings) s.sighting.covariance_px2 *= factor;
  }
}

/// A subset does not see a height that scatters within it, so what views are laid over must not.
SurfacePasses passesOver(const SheetGrid& grid, const SurfaceOptions& options, double pixel_m) {
  const MatchOptions& match = options.correlate.match;
  const double side_cells = match.subset_px * pixel_m / grid.spacing_m.mean();
  const int reach = static_cast<int>(std::lround(kSmoothing * side_cells));
  return {match.order, 0.5 * side_cells, std::max(kLeastReach, reach), kWarpPasses};
}

Result<RestSurface> surfaceOn(const std::vector<CameraView>& views,
                              const std::vector<GrayImage>& images, const SurfaceOptions& options,
                              const SheetGrid& grid, const HeightField& coarse, double pixel_m) {
  const ViewMatcher matcher(views, images, options);
  SheetHeights heights(grid, coarse);
  if (auto unique = checkRepeats(grid, heights, matcher); !unique) return unique.error();
  std::vector<RestVertex> vertices(static_cast<std::size_t>(grid.columns) *
                                   static_cast<std::size_t>(grid.rows));
  for (int pass = 1; pass <= kPasses; ++pass) {
    const auto& keep_going = options.correlate.keep_going;
    if (keep_going && !keep_going(static_cast<double>(pass) / (kPasses + 1))) {
      return notConverged("stopped by the user");
    }
    matchNodes(grid, heights, matcher, options, vertices);
    heights.refine(vertices, pixel_m);
  }
  const SheetHeights first = heights;
  const SurfacePasses passes = passesOver(grid, options, pixel_m);
  for (int pass = 0; pass < passes.passes; ++pass) {
    const SheetHeights smooth = heights.smoothed(passes.reach);
    SurfaceWarp(views, images, options, grid, smooth).refine(vertices);
    heights.refine(vertices, pixel_m);
  }
  settleOnNodes(views, grid, heights, vertices);
  auto surface = meshOnGrid(grid, heights, std::move(vertices));
  if (!surface) return surface;
  surface->pixel_m = pixel_m;
  judgeResiduals(views, *surface);
  addShapeErrors(views, grid, first, heights, passes, *surface);
  if (surface->validCount() >= kLeastVertices) return surface;
  return badInput(
      "", "",
      "only " + std::to_string(surface->validCount()) + " vertices could be found in two views",
      "do the images show the same texture, in focus and unsaturated?");
}

}  // namespace

std::size_t RestSurface::validCount() const {
  return static_cast<std::size_t>(
      std::count_if(vertices.begin(), vertices.end(),
                    [](const RestVertex& vertex) { return vertex.state == PointState::kValid; }));
}

std::vector<Sighting> RestSurface::sightingsOf(int vertex) const {
  std::vector<Sighting> seen;
  for (const VertexSighting& s : vertices[vertex].sightings) seen.push_back(s.sighting);
  return seen;
}

Mat3 RestSurface::systematicAt(int vertex, const Vec3& position_m,
                               std::span<const Sighting> sightings, const Mat3& gradient) const {
  if (!systematic) return Mat3::Zero();
  const SystematicError::PlaceRows now = systematic->placeByParameters(position_m, sightings);
  const SystematicError::PlaceRows& at_rest = vertices[vertex].by_parameters;
  if (at_rest.cols() == 0) return systematic->covarianceOf(now);
  return systematic->covarianceOf(now - gradient * at_rest);
}

void addSystematicError(const CameraCalibration* calibration, const std::vector<CameraView>& views,
                        RestSurface& surface) {
  auto stated = calibration != nullptr ? SystematicError::ofCalibration(*calibration, views)
                                       : std::optional<SystematicError>();
  if (!stated) {
    stated = SystematicError::ofOffsets(views, surface.offset_px);
    char text[160];
    std::snprintf(text, sizeof text,
                  "the calibration does not state its covariance: sigma goes by how far the views "
                  "disagree, %.3f px",
                  surface.offset_px);
    surface.warnings.emplace_back(text);
  }
  surface.systematic = std::make_shared<const SystematicError>(std::move(*stated));
  for (int i = 0; i < static_cast<int>(surface.vertices.size()); ++i)
    if (surface.vertices[i].state == PointState::kValid)
      surface.vertices[i].by_parameters = surface.systematic->placeByParameters(
          surface.mesh.positions.col(i), surface.sightingsOf(i));
}

Result<RestSurface> findSurface(const std::vector<CameraView>& views,
                                const std::vector<GrayImage>& images, const SurfaceOptions& options,
                                const std::function<bool(const Vec2&)>& inside) {
  const auto going = [&] {
    return !options.correlate.keep_going || options.correlate.keep_going(0.0);
  };
  auto cloud = coarseCloud(views, images, going);
  if (!cloud) return cloud.error();
  if (inside) {
    std::erase_if(cloud->points_m, [&](const Vec3& point) {
      const auto pixel = views.front().project(point);
      return !pixel || !inside(*pixel);
    });
    if (cloud->points_m.size() < kLeastVertices) {
      return badInput("", "", "no surface was found in the region", "check --roi");
    }
  }
  SheetGrid grid;
  grid.space_from_sheet = planeOf(*cloud, views);
  const Eigen::Isometry3d sheet_from_space = grid.space_from_sheet.inverse();
  std::vector<Vec3> points;
  for (const Vec3& point : cloud->points_m) points.push_back(sheet_from_space * point);
  HeightField coarse(points, kCell_px * cloud->pixel_m);
  coarse.keepLargest();
  const double rim_m = (options.correlate.match.subset_px / 2) * cloud->pixel_m;
  const Vec2 extent = coarse.most() - coarse.least() - Vec2::Constant(2.0 * rim_m);
  if (!(extent.minCoeff() > 0.0)) {
    return badInput("", "", "the surface is smaller than a subset", "choose a smaller --subset");
  }
  const double spacing = extent.maxCoeff() / (options.vertices_per_side - 1);
  grid.origin_m = coarse.least() + Vec2::Constant(rim_m);
  grid.spacing_m = Vec2::Constant(spacing);
  grid.columns = static_cast<int>(extent.x() / spacing + 1e-9) + 1;
  grid.rows = static_cast<int>(extent.y() / spacing + 1e-9) + 1;
  grid.margin_m = coarse.cell_m();
  grid.free = [&coarse](const Vec2& place) { return coarse.knows(place); };
  grid.uv = [&grid](const Vec2& place) -> Vec2 { return place - grid.origin_m; };
  auto surface = surfaceOn(views, images, options, grid, coarse, cloud->pixel_m);
  if (surface)
    surface->warnings.insert(surface->warnings.begin(), cloud->warnings.begin(),
                             cloud->warnings.end());
  return surface;
}

Result<RestSurface> findSheet(const std::vector<CameraView>& views,
                              const std::vector<GrayImage>& images, const SurfaceOptions& options,
                              const SheetGrid& grid) {
  const auto going = [&] {
    return !options.correlate.keep_going || options.correlate.keep_going(0.0);
  };
  const Vec2 size = Vec2(grid.columns - 1, grid.rows - 1).cwiseProduct(grid.spacing_m);
  const double thickness_m = kFlatness * size.maxCoeff();
  const FlatPrior prior{grid.space_from_sheet * Vec3(grid.origin_m.x(), grid.origin_m.y(), 0.0),
                        grid.space_from_sheet.linear().col(2), thickness_m};
  auto cloud = coarseCloud(views, images, going, &prior);
  if (!cloud) return cloud.error();
  const Eigen::Isometry3d sheet_from_space = grid.space_from_sheet.inverse();
  const Vec2 border = Vec2::Constant(kBorder * size.maxCoeff());
  std::vector<Vec3> points;
  for (const Vec3& point : cloud->points_m) {
    const Vec3 at = sheet_from_space * point;
    const Vec2 place = at.head<2>() - grid.origin_m;
    const bool over = (place.array() >= -border.array()).all() &&
                      (place.array() <= (size + border).array()).all();
    if (over && std::abs(at.z()) <= thickness_m) points.push_back(at);
  }
  if (points.size() < kLeastVertices) {
    return badInput("", "", "no surface was found where the sample should lie",
                    "is the rig's place in the calibration right?");
  }
  const HeightField coarse(points, kCell_px * cloud->pixel_m);
  auto surface = surfaceOn(views, images, options, grid, coarse, cloud->pixel_m);
  if (surface)
    surface->warnings.insert(surface->warnings.begin(), cloud->warnings.begin(),
                             cloud->warnings.end());
  return surface;
}

}  // namespace tenter
