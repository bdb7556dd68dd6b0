// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tenter/calib/byte_image.h"
#include "tenter/session/mounting.h"
#include "tenter/twin/rig_cameras.h"
#include "tenter/twin/sheet_shape.h"

namespace tenter {

struct RenderOptions {
  int samples = 2;              ///< Rays a pixel, per side: 4 a pixel. 1 to 8.
  bool noise = true;            ///< Photons' and the read-out's.
  double full_well_e = 30'000;  ///< Electrons of a saturated pixel.
  double read_noise_e = 7.0;
  std::uint64_t seed = 1;  ///< Of noise; the texture has its own.
  unsigned texture_seed = 1;
  double feature_m = 0.0;  ///< Finest dots of the texture are one to two of it; 0: 4 pixels.
  int facets = 297;        ///< Quads a side of the rendered sheet.
};

/// Pictures of the virtual rig: cloth printed with wavelet noise, clips with tags, cords, the
/// table, as the cameras see them through lenses with distortion and a finite depth of field
/// (docs/twin.md). Equal arguments give equal images, whatever the number of threads.
class SceneRenderer {
 public:
  /// Errors: a tag of an unknown family, options out of range, no ray tracer.
  static Result<std::unique_ptr<SceneRenderer>> make(Mounting mounting,
                                                     std::vector<VirtualCamera> cameras,
                                                     const RenderOptions& options);
  ~SceneRenderer();

  /// One image a camera, in their order, by all cores. `number` tells the noise of one set from
  /// that of another. Precondition: as many clips as the mounting has, or none.
  std::vector<ByteImage> render(const SheetShape& shape, std::uint64_t number) const;

  const std::vector<VirtualCamera>& cameras() const;
  /// For what may happen to a camera: another exposure, another focus, a push. The image's size
  /// stays.
  void setCamera(std::size_t index, const VirtualCamera& camera);
  double featureSize_m() const;

 private:
  struct Impl;
  explicit SceneRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
