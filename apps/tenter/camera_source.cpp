// SPDX-License-Identifier: GPL-3.0-or-later
#include "camera_source.h"

namespace tenter::app {

namespace {

constexpr int kMostPixels = 8192;

}  // namespace

void declareCameraSource(CLI::App& command, CameraSourceOptions& o, int default_count) {
  o.cameras = default_count;
  command.add_option("--cameras", o.cameras, "Virtual GigE Vision cameras")
      ->check(CLI::Range(default_count > 0 ? 1 : 0, VirtualCamerasOptions::kMostCameras))
      ->capture_default_str();
  command
      .add_option("--images", o.images,
                  "What they show: test-pattern, a picture, or a folder of pictures")
      ->capture_default_str();
  command.add_option("--width-px", o.width_px, "Of the images; 0: as the pictures, or 1936")
      ->check(CLI::Range(0, kMostPixels));
  command
      .add_option("--height-px", o.height_px,
                  "Of the images; 0: as the pictures, or five eighths of the width")
      ->check(CLI::Range(0, kMostPixels));
}

void declareRigCameras(CLI::App& command, CameraSourceOptions& o) {
  o.images = CameraSourceOptions::kScene;
  declareCameraSource(command, o, 0);
  command.get_option("--images")
      ->description(
          "What they show: scene (the sample as it hangs), test-pattern, a picture, or a folder of "
          "pictures");
}

Result<void> addCameras(const CameraSourceOptions& o, ServedRigOptions& rig) {
  if (o.cameras == 0) return {};
  if (o.images == CameraSourceOptions::kScene) {
    ServedRigOptions::Scene scene;
    scene.cameras.count = o.cameras;
    if (o.width_px > 0) scene.cameras.width_px = o.width_px;
    rig.scene = scene;
    return {};
  }
  auto cameras = camerasOf(o, rig.mount.seed);
  if (!cameras) return cameras.error();
  rig.cameras = *std::move(cameras);
  return {};
}

Result<VirtualCamerasOptions> camerasOf(const CameraSourceOptions& o, std::uint64_t seed) {
  VirtualCamerasOptions options;
  options.count = o.cameras;
  options.seed = seed;
  if (o.images == CameraSourceOptions::kTestPattern) {
    options.source = std::make_shared<TestPatternSource>();
    if (o.width_px > 0) options.height_px = o.width_px * 5 / 8;
  } else {
    const auto pictures = PictureSource::open(o.images, seed);
    if (!pictures) return pictures.error();
    options.width_px = (*pictures)->width_px();
    options.height_px = (*pictures)->height_px();
    options.source = *pictures;
  }
  if (o.width_px > 0) options.width_px = o.width_px;
  if (o.height_px > 0) options.height_px = o.height_px;
  return options;
}

}  // namespace tenter::app
