// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <embree3/rtcore.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "pattern.h"
#include "tenter/core/mesh.h"

namespace tenter {

/// How a triangle looks.
struct Surface {
  double albedo = 0.3;
  const Pattern* pattern = nullptr;  ///< On the front, in place of `albedo`; outlives the scene.
};

/// Triangles with one of the scene's surfaces each. The front is where they turn counter-clockwise.
struct RayMesh {
  Points3 positions;  ///< [m], rig's frame.
  Points2 places;     ///< Of the vertices in the pattern; 2 x 0 if there is none.
  Points3 normals;    ///< Of the vertices, smooth; 3 x 0: those of the triangles.
  std::vector<Triangle> triangles;
  std::vector<std::uint16_t> surfaces;  ///< One a triangle.

  /// Two triangles over four corners, counter-clockwise from the front.
  void addQuad(const std::array<Vec3, 4>& corners, const std::array<Vec2, 4>& corner_places,
               std::uint16_t surface);
  void addBox(const Vec3& min_m, const Vec3& max_m, const Eigen::Isometry3d& rig_from_box,
              std::uint16_t surface);
  void addCylinder(const Vec3& from, const Vec3& to, double radius_m, std::uint16_t surface);

 private:
  int addVertex(const Vec3& position, const Vec2& place);
};

/// Normals of a mesh's vertices, weighted by the triangles' areas.
Points3 smoothNormals(const Points3& positions, const std::vector<Triangle>& triangles);

/// The ray tracer. One serves many scenes.
class RayDevice {
 public:
  static Result<std::shared_ptr<RayDevice>> make();
  ~RayDevice();
  RayDevice(const RayDevice&) = delete;
  RayDevice& operator=(const RayDevice&) = delete;
  RTCDevice handle() const { return device_; }

 private:
  explicit RayDevice(RTCDevice device) : device_(device) {}
  RTCDevice device_;
};

/// Meshes under the rig's soft light. Lambert's law, no shadows. Safe from any thread.
class RayScene {
 public:
  RayScene(std::shared_ptr<RayDevice> device, std::vector<Surface> surfaces,
           std::vector<RayMesh> meshes);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Light that comes back along a ray: 1 is what a perfectly white, level surface sends.
  /// @param size_per_length  width of what the ray stands for, over the length of `direction`.
  double radiance(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                  double size_per_length) const;

 private:
  std::shared_ptr<RayDevice> device_;
  RTCScene scene_;
  std::vector<Surface> surfaces_;
  std::vector<RayMesh> meshes_;
};

}  // namespace tenter
