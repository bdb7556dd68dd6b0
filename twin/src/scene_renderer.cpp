// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/scene_renderer.h"

#include <algorithm>

#include "exposure.h"
#include "rig_setup.h"
#include "sheet_sampler.h"
#include "tenter/calib/marker_cells.h"

namespace tenter {
namespace {

constexpr double kPixelsAFeature = 4.0;
constexpr double kQuietZone = 10.0 / 8.0;  // a tag's white margin of one of its cells
constexpr double kBackOfCloth = 0.45, kBody = 0.25, kCord = 0.75, kTable = 0.06;
constexpr double kTableThickness_m = 0.003, kTableReach_m = 0.2, kBenchReach_m = 0.25;
constexpr double kUnderCloth_m = 5e-5;

enum SurfaceIndex : std::uint16_t { kSheetSurface, kBodySurface, kCordSurface, kTableSurface };
constexpr std::uint16_t kFirstTag = kTableSurface + 1;

std::vector<double> evenLines(double length, int intervals) {
  std::vector<double> lines;
  for (int i = 0; i <= intervals; ++i) lines.push_back(length * i / intervals);
  return lines;
}

}  // namespace

struct SceneRenderer::Impl {
  Mounting mounting;
  std::vector<VirtualCamera> cameras;
  RenderOptions options;
  std::shared_ptr<RayDevice> device;
  std::vector<std::unique_ptr<Pattern>> patterns;
  std::vector<Surface> surfaces;
  std::vector<PixelDirections> directions;
  TriangleMesh flat;  ///< The sheet at rest, as fine as it is drawn.

  Result<void> prepare();
  RayMesh sheetMesh(const SheetShape& shape) const;
  RayMesh propMesh(const SheetShape& shape) const;
  void addClips(const SheetShape& shape, RayMesh& mesh) const;
  void addTable(bool rests, RayMesh& mesh) const;
};

Result<void> SceneRenderer::Impl::prepare() {
  if (options.samples < 1 || options.samples > 8)
    return usageError("1 to 8 rays a side of a pixel");
  if (options.facets < 10 || options.facets > 2000) return usageError("10 to 2000 facets a side");
  if (cameras.empty()) return usageError("pictures need a camera");
  auto made = RayDevice::make();
  if (!made) return made.error();
  device = *std::move(made);
  if (options.feature_m <= 0.0) {
    const VirtualCamera& camera = cameras.front();
    options.feature_m = kPixelsAFeature * camera.focus_m / camera.model.lens().fx_px;
  }
  const double reach_m = mounting.sample_size_m.maxCoeff();
  patterns.push_back(
      std::make_unique<NoisePattern>(reach_m, options.feature_m, options.texture_seed));
  surfaces = {{kBackOfCloth, patterns.front().get()}, {kBody}, {kCord}, {kTable}};
  for (const MountedClip& clip : mounting.clips) {
    for (const ClipTag& tag : clip.tags) {
      const auto cells = markerCells(tag.family, tag.id);
      if (!cells) {
        return badInput(
            kMountingFile, "clips." + clip.id,
            "has tag " + std::to_string(tag.id) + ", which " + tag.family + " does not have");
      }
      patterns.push_back(std::make_unique<CellPattern>(*cells, tag.size_m));
      surfaces.push_back({kWhiteAlbedo, patterns.back().get()});
    }
  }
  for (const VirtualCamera& camera : cameras) directions.emplace_back(camera.model);
  flat = gridSheet({evenLines(mounting.sample_size_m.x(), options.facets),
                    evenLines(mounting.sample_size_m.y(), options.facets)})
             .rest;
  return {};
}

RayMesh SceneRenderer::Impl::sheetMesh(const SheetShape& shape) const {
  const SheetSampler sampler(shape.lines, flat.uv, Sampling::kCubic, shape.breaks_x,
                             shape.breaks_y);
  RayMesh mesh;
  mesh.positions = sampler.sample(shape.nodes);
  mesh.places = flat.uv;
  mesh.triangles = flat.triangles;
  mesh.normals = smoothNormals(mesh.positions, mesh.triangles);
  mesh.surfaces.assign(mesh.triangles.size(), kSheetSurface);
  return mesh;
}

void SceneRenderer::Impl::addClips(const SheetShape& shape, RayMesh& mesh) const {
  std::uint16_t surface = kFirstTag;
  for (std::size_t c = 0; c < mounting.clips.size(); ++c) {
    const MountedClip& clip = mounting.clips[c];
    const Eigen::Isometry3d& pose = shape.clips[c];
    for (const ClipBox& body : clip.bodies) mesh.addBox(body.min_m, body.max_m, pose, kBodySurface);
    for (const ClipTag& tag : clip.tags) {
      const double h = 0.5 * kQuietZone * tag.size_m;
      // The tag's z points into the clip, so that its corners turn clockwise when seen.
      const std::array<Vec2, 4> places = {Vec2(-h, -h), Vec2(-h, h), Vec2(h, h), Vec2(h, -h)};
      std::array<Vec3, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) {
        corners[i] = pose * (tag.clip_from_tag * Vec3(places[i].x(), places[i].y(), 0.0));
      }
      mesh.addQuad(corners, places, surface++);
    }
    for (const MountedCord& cord : mounting.cords) {
      if (cord.clip != clip.id || !cord.pulley_m) continue;
      mesh.addCylinder(pose * cord.attachment_m, *cord.pulley_m, 0.5 * cord.diameter_m,
                       kCordSurface);
    }
  }
}

/// The table whose edge the sample is pushed over, or the bench that it lies on at rest.
void SceneRenderer::Impl::addTable(bool rests, RayMesh& mesh) const {
  const double top = -0.5 * mounting.thickness_m - kUnderCloth_m;
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
  const Vec2 middle = mounting.sample_corner_m + 0.5 * mounting.sample_size_m;
  if (mounting.table) {
    const MountedTable& table = *mounting.table;
    const Vec3 across = Vec3::UnitZ().cross(table.push);
    Eigen::Isometry3d rig_from_table = here;
    rig_from_table.linear() << table.push, across, Vec3::UnitZ();
    rig_from_table.translation() = table.edge_m;
    const double side = across.dot(Vec3(middle.x(), middle.y(), 0.0) - table.edge_m);
    mesh.addBox({-kTableReach_m, side - 0.5 * kTableReach_m, top - kTableThickness_m},
                {0.0, side + 0.5 * kTableReach_m, top}, rig_from_table, kTableSurface);
  } else if (rests) {
    mesh.addBox({middle.x() - kBenchReach_m, middle.y() - kBenchReach_m, top - kTableThickness_m},
                {middle.x() + kBenchReach_m, middle.y() + kBenchReach_m, top}, here, kTableSurface);
  }
}

RayMesh SceneRenderer::Impl::propMesh(const SheetShape& shape) const {
  RayMesh mesh;
  if (!shape.clips.empty()) addClips(shape, mesh);
  addTable(shape.clips.empty(), mesh);
  return mesh;
}

Result<std::unique_ptr<SceneRenderer>> SceneRenderer::make(Mounting mounting,
                                                           std::vector<VirtualCamera> cameras,
                                                           const RenderOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->mounting = std::move(mounting);
  impl->cameras = std::move(cameras);
  impl->options = options;
  if (auto ready = impl->prepare(); !ready) return ready.error();
  return std::unique_ptr<SceneRenderer>(new SceneRenderer(std::move(impl)));
}

SceneRenderer::SceneRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SceneRenderer::~SceneRenderer() = default;

std::vector<ByteImage> SceneRenderer::render(const SheetShape& shape, std::uint64_t number) const {
  require(shape.clips.empty() || shape.clips.size() == impl_->mounting.clips.size(),
          "SceneRenderer: as many clips as the mounting has, or none");
  std::vector<RayMesh> meshes;
  meshes.push_back(impl_->sheetMesh(shape));
  meshes.push_back(impl_->propMesh(shape));
  const RayScene scene(impl_->device, impl_->surfaces, std::move(meshes));
  std::vector<ByteImage> images;
  for (std::size_t c = 0; c < impl_->cameras.size(); ++c) {
    images.push_back(
        expose(scene, impl_->cameras[c], impl_->directions[c], impl_->options, number));
  }
  return images;
}

const std::vector<VirtualCamera>& SceneRenderer::cameras() const { return impl_->cameras; }

void SceneRenderer::setCamera(std::size_t index, const VirtualCamera& camera) {
  VirtualCamera& old = impl_->cameras.at(index);
  require(camera.model.widthPx() == old.model.widthPx() &&
              camera.model.heightPx() == old.model.heightPx(),
          "SceneRenderer: a camera's image keeps its size");
  impl_->directions[index] = PixelDirections(camera.model);
  old = camera;
}

double SceneRenderer::featureSize_m() const { return impl_->options.feature_m; }

}  // namespace tenter
