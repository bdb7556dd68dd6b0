// SPDX-License-Identifier: GPL-3.0-or-later
#include "ray_scene.h"

#include <cmath>
#include <numbers>

namespace tenter {
namespace {

constexpr double kBackground = 0.01;
constexpr double kAmbient = 0.35, kLamps = 0.65;  // share of a level surface's light
constexpr int kCylinderSides = 24;

/// Four large lamps at half height around the rig, and what the room sends back.
double irradiance(const Vec3& normal) {
  static const double kHalf = std::sqrt(0.5);
  const double up = kHalf * normal.z(), along_x = 0.5 * normal.x(), along_y = 0.5 * normal.y();
  const double lamps =
      std::max(0.0, up + along_x + along_y) + std::max(0.0, up + along_x - along_y) +
      std::max(0.0, up - along_x + along_y) + std::max(0.0, up - along_x - along_y);
  return kAmbient + kLamps * lamps / (4.0 * kHalf);
}

}  // namespace

int RayMesh::addVertex(const Vec3& position, const Vec2& place) {
  const Eigen::Index n = positions.cols();
  positions.conservativeResize(3, n + 1);
  positions.col(n) = position;
  places.conservativeResize(2, n + 1);
  places.col(n) = place;
  return static_cast<int>(n);
}

void RayMesh::addQuad(const std::array<Vec3, 4>& corners, const std::array<Vec2, 4>& corner_places,
                      std::uint16_t surface) {
  std::array<int, 4> id{};
  for (std::size_t i = 0; i < 4; ++i) id[i] = addVertex(corners[i], corner_places[i]);
  triangles.push_back({id[0], id[1], id[2]});
  triangles.push_back({id[0], id[2], id[3]});
  surfaces.insert(surfaces.end(), 2, surface);
}

void RayMesh::addBox(const Vec3& min_m, const Vec3& max_m, const Eigen::Isometry3d& rig_from_box,
                     std::uint16_t surface) {
  const auto corner = [&](int bits) {
    return Vec3(rig_from_box * Vec3((bits & 1) != 0 ? max_m.x() : min_m.x(),
                                    (bits & 2) != 0 ? max_m.y() : min_m.y(),
                                    (bits & 4) != 0 ? max_m.z() : min_m.z()));
  };
  constexpr std::array<std::array<int, 4>, 6> kFaces = {
      {{4, 5, 7, 6}, {0, 2, 3, 1}, {0, 1, 5, 4}, {2, 6, 7, 3}, {1, 3, 7, 5}, {0, 4, 6, 2}}};
  for (const auto& face : kFaces) {
    addQuad({corner(face[0]), corner(face[1]), corner(face[2]), corner(face[3])},
            {Vec2::Zero(), Vec2::Zero(), Vec2::Zero(), Vec2::Zero()}, surface);
  }
}

void RayMesh::addCylinder(const Vec3& from, const Vec3& to, double radius_m,
                          std::uint16_t surface) {
  const Vec3 axis = (to - from).normalized();
  const Vec3 side = axis.unitOrthogonal(), other = axis.cross(side);
  const auto rim = [&](const Vec3& end, int i) {
    const double angle = 2.0 * std::numbers::pi * i / kCylinderSides;
    return Vec3(end + radius_m * (std::cos(angle) * side + std::sin(angle) * other));
  };
  for (int i = 0; i < kCylinderSides; ++i) {
    addQuad({rim(from, i), rim(from, i + 1), rim(to, i + 1), rim(to, i)},
            {Vec2::Zero(), Vec2::Zero(), Vec2::Zero(), Vec2::Zero()}, surface);
  }
}

Points3 smoothNormals(const Points3& positions, const std::vector<Triangle>& triangles) {
  Points3 normals = Points3::Zero(3, positions.cols());
  for (const Triangle& t : triangles) {
    const Vec3 a = positions.col(t[0]);
    const Vec3 doubled = (positions.col(t[1]) - a).cross(positions.col(t[2]) - a);
    for (const int v : t) normals.col(v) += doubled;
  }
  for (auto normal : normals.colwise()) normal.normalize();
  return normals;
}

Result<std::shared_ptr<RayDevice>> RayDevice::make() {
  RTCDevice device = rtcNewDevice(nullptr);
  if (device == nullptr) {
    return Error{ErrorKind::kHardware, "", "", "the ray tracer does not start on this processor",
                 ""};
  }
  return std::shared_ptr<RayDevice>(new RayDevice(device));
}

RayDevice::~RayDevice() { rtcReleaseDevice(device_); }

RayScene::RayScene(std::shared_ptr<RayDevice> device, std::vector<Surface> surfaces,
                   std::vector<RayMesh> meshes)
    : device_(std::move(device)),
      scene_(rtcNewScene(device_->handle())),
      surfaces_(std::move(surfaces)),
      meshes_(std::move(meshes)) {
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    const RayMesh& mesh = meshes_[m];
    RTCGeometry geometry = rtcNewGeometry(device_->handle(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
        static_cast<std::size_t>(mesh.positions.cols())));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), mesh.triangles.size()));
    Eigen::Map<Eigen::Matrix3Xf>(vertices, 3, mesh.positions.cols()) = mesh.positions.cast<float>();
    for (const Triangle& t : mesh.triangles) {
      for (const int v : t) *indices++ = static_cast<unsigned>(v);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_, geometry, static_cast<unsigned>(m));
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene_);
}

RayScene::~RayScene() { rtcReleaseScene(scene_); }

double RayScene::radiance(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                          double size_per_length) const {
  RTCRayHit ray;
  ray.ray.org_x = origin.x();
  ray.ray.org_y = origin.y();
  ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tnear = 0.0F;
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.time = 0.0F;
  ray.ray.mask = ~0U;
  ray.ray.id = 0;
  ray.ray.flags = 0;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1(scene_, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return kBackground;

  const RayMesh& mesh = meshes_[ray.hit.geomID];
  const Triangle& t = mesh.triangles[ray.hit.primID];
  const Surface& surface = surfaces_[mesh.surfaces[ray.hit.primID]];
  const double u = ray.hit.u, v = ray.hit.v, w = 1.0 - u - v;
  Vec3 normal(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z);
  const Vec3 along = direction.cast<double>();
  const bool front = normal.dot(along) < 0.0;
  if (mesh.normals.cols() > 0) {
    normal = w * mesh.normals.col(t[0]) + u * mesh.normals.col(t[1]) + v * mesh.normals.col(t[2]);
    if (!front) normal = -normal;
  } else if (!front) {
    normal = -normal;
  }
  double albedo = surface.albedo;
  if (front && surface.pattern != nullptr) {
    const Vec2 place =
        w * mesh.places.col(t[0]) + u * mesh.places.col(t[1]) + v * mesh.places.col(t[2]);
    albedo = surface.pattern->albedo(place.x(), place.y(), ray.ray.tfar * size_per_length);
  }
  return albedo * irradiance(normal.normalized());
}

}  // namespace tenter
