// SPDX-License-Identifier: GPL-3.0-or-later
#include "shape_error.h"

#include <algorithm>

#include "height_filter.h"

namespace tenter {

namespace {

/// What the passes would find, less what there is, if the surface found were the true one and
/// images had no noise; by node.
std::vector<double> biasOf(const SheetHeights& found, const SurfacePasses& how,
                           const std::vector<int>& warped_nodes) {
  const SubsetWeights subset(how.half_cells);
  const SheetHeights truth = found.smoothed(how.reach);
  const SheetHeights truth_seen = truth.seenBySubsets(subset, 1);
  SheetHeights heights = truth.seenBySubsets(subset, how.order);
  for (int pass = 0; pass < how.passes; ++pass) {
    const SheetHeights smooth = heights.smoothed(how.reach);
    const SheetHeights smooth_seen = smooth.seenBySubsets(subset, 1);
    for (const int node : warped_nodes)
      heights.setHeight(node,
                        smooth.height(node) + truth_seen.height(node) - smooth_seen.height(node));
  }
  std::vector<double> bias;
  for (int node = 0; node < found.count(); ++node)
    bias.push_back(heights.height(node) - truth.height(node));
  return bias;
}

}  // namespace

void addShapeErrors(const std::vector<CameraView>& views, const SheetGrid& grid,
                    const SheetHeights& first, const SheetHeights& last, const SurfacePasses& how,
                    RestSurface& surface) {
  const HeightFilter filter = heightFilter(how.order, how.half_cells, how.reach, how.passes);
  surface.height_noise = filter.noise;
  std::vector<int> warped_nodes;
  double beyond_m2 = 0.0;  // of first matches: their variance less that of their noise
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    RestVertex& vertex = surface.vertices[i];
    const int node = surface.node_of_vertex[i];
    if (vertex.state != PointState::kValid) continue;
    const SurfaceElement element = last.element(node);
    const Vec3 normal = element.tangents.col(0).cross(element.tangents.col(1));
    const Vec3 ray =
        vertex.point.position_m - views[vertex.sightings.front().sighting.view].centre();
    vertex.normal = normal / normal.dot(grid.space_from_sheet.linear().col(2));
    vertex.ray = ray / ray.dot(vertex.normal);
    if (!vertex.warped || !first.matched(node)) continue;
    warped_nodes.push_back(node);
    const double noise_m2 = vertex.normal.dot(vertex.point.covariance_m2 * vertex.normal);
    const double off_m = first.height(node) - last.height(node);
    beyond_m2 += off_m * off_m - filter.difference * noise_m2;
  }
  const double count = std::max(1.0, static_cast<double>(warped_nodes.size()));
  beyond_m2 = std::max(0.0, beyond_m2 / count);
  const std::vector<double> bias_m = biasOf(last, how, warped_nodes);
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    RestVertex& vertex = surface.vertices[i];
    if (vertex.state != PointState::kValid) continue;
    const double bias_m2 = bias_m[surface.node_of_vertex[i]] * bias_m[surface.node_of_vertex[i]];
    vertex.shape_variance_m2 =
        vertex.warped ? bias_m2 + filter.leak * beyond_m2 : std::max(bias_m2, beyond_m2);
    Mat3& covariance = vertex.point.covariance_m2;
    const Vec3 with_height = covariance * vertex.normal;
    double added_m2 = vertex.shape_variance_m2;
    if (vertex.warped) {
      const Mat3 both = with_height * vertex.ray.transpose();
      covariance += (filter.noise.with_match - 1.0) * (both + both.transpose());
      added_m2 +=
          (filter.noise.own - 2.0 * filter.noise.with_match + 1.0) * with_height.dot(vertex.normal);
    }
    covariance += added_m2 * vertex.ray * vertex.ray.transpose();
  }
}

}  // namespace tenter
