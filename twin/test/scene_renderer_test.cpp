// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures against what the camera's model says that they must be.
#include "tenter/twin/scene_renderer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "exposure.h"
#include "pattern.h"
#include "tenter/calib/marker_cells.h"
#include "tenter/session/mounting.h"
#include "tenter/twin/protocol.h"
#include "tenter/twin/rig_mounting.h"

namespace tenter {
namespace {

constexpr double kSubpixelTolerance = 0.02;
constexpr int kWidth_px = 640;

RenderOptions clean() {
  RenderOptions options;
  options.noise = false;
  options.facets = 60;
  return options;
}

std::vector<VirtualCamera> someCameras(const std::string& protocol = "stretch-weft",
                                       int count = 2) {
  return rigCameras({protocol, count, kWidth_px, 3}).value();
}

/// A flat sample, moved as a whole.
SheetShape flatShape(const Eigen::Isometry3d& motion, std::size_t clips) {
  const std::vector<double> lines = {0.0, 0.025, 0.05, 0.075, 0.1};
  SheetShape shape{{lines, lines}, {}, {}, {}, {}};
  shape.nodes = motion * gridSheet(shape.lines).rest.positions;
  shape.clips.assign(clips, motion);
  return shape;
}

Eigen::Isometry3d tilt() {
  Eigen::Isometry3d motion(Eigen::AngleAxisd(0.15, Vec3(1.0, 0.4, 0.2).normalized()));
  motion.translation() = Vec3(0.002, -0.003, 0.001);
  return motion;
}

std::unique_ptr<SceneRenderer> rendererOf(const std::string& protocol,
                                          const std::vector<VirtualCamera>& cameras,
                                          const RenderOptions& options) {
  return SceneRenderer::make(rigMounting("knit-12", protocol).value(), cameras, options).value();
}

/// Where the darkness of a tag has its middle, by projecting points of its plane.
Vec2 darknessByProjection(const VirtualCamera& camera, const Eigen::Isometry3d& rig_from_tag,
                          const ClipTag& tag) {
  const CellPattern pattern(*markerCells(tag.family, tag.id), tag.size_m);
  constexpr int kPoints = 320;  // a side; a multiple of the cells, so that none is cut
  const double reach = tag.size_m, step = reach / kPoints;
  Vec2 sum = Vec2::Zero();
  double weight = 0.0;
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const double x = -0.5 * reach + (i + 0.5) * step, y = -0.5 * reach + (j + 0.5) * step;
      const auto project = [&](double px, double py) {
        return *camera.model.project(camera.camera_from_rig * (rig_from_tag * Vec3(px, py, 0.0)));
      };
      const double dark = kWhiteAlbedo - pattern.albedo(x, y, 1e-3 * step);
      if (dark < 1e-6) continue;
      const Vec2 pixel = project(x, y);
      const Vec2 a = project(x + step, y) - pixel, b = project(x, y + step) - pixel;
      const double area = std::abs(a.x() * b.y() - a.y() * b.x());
      sum += dark * area * pixel;
      weight += dark * area;
    }
  }
  return sum / weight;
}

/// The same from the picture, over the tag and a part of its white margin.
Vec2 darknessInPicture(const ByteImage& image, const VirtualCamera& camera,
                       const Eigen::Isometry3d& rig_from_tag, const ClipTag& tag) {
  const Eigen::Isometry3d tag_from_camera = (camera.camera_from_rig * rig_from_tag).inverse();
  const double reach = 0.5 * tag.size_m * 1.18;
  double white = 0.0;
  const auto inside = [&](int x, int y) {
    const Vec2 n = *camera.model.normalized(Vec2(x, y));
    const Vec3 from = tag_from_camera.translation();
    const Vec3 along = tag_from_camera.linear() * Vec3(n.x(), n.y(), 1.0);
    const Vec3 place = from - from.z() / along.z() * along;
    return place.head<2>().cwiseAbs().maxCoeff() < reach;
  };
  const Vec2 middle = *camera.model.project(camera.camera_from_rig * rig_from_tag.translation());
  const int cx = static_cast<int>(middle.x()), cy = static_cast<int>(middle.y());
  constexpr int kReach_px = 30;
  Vec2 sum = Vec2::Zero();
  double weight = 0.0;
  for (int y = cy - kReach_px; y <= cy + kReach_px; ++y) {
    for (int x = cx - kReach_px; x <= cx + kReach_px; ++x) {
      if (inside(x, y)) white = std::max(white, static_cast<double>(image.at(x, y)));
    }
  }
  for (int y = cy - kReach_px; y <= cy + kReach_px; ++y) {
    for (int x = cx - kReach_px; x <= cx + kReach_px; ++x) {
      if (!inside(x, y)) continue;
      const double dark = white - image.at(x, y);
      sum += dark * Vec2(x, y);
      weight += dark;
    }
  }
  return sum / weight;
}

TEST(SceneRendererTest, TagsAreWhereTheirClipsAre) {
  const auto cameras = someCameras();
  RenderOptions fine = clean();
  fine.samples = 8;  // what few would scatter is not what is asked
  const auto renderer = rendererOf("stretch-weft", cameras, fine);
  const Mounting mounting = rigMounting("knit-12", "stretch-weft").value();
  const SheetShape shape = flatShape(tilt(), mounting.clips.size());
  const auto images = renderer->render(shape, 0);
  // Light that falls off across a tag moves its centroid of darkness a little to either side.
  constexpr double kOneTag_px = 0.05;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    Vec2 sum = Vec2::Zero();
    int count = 0;
    for (const MountedClip& clip : mounting.clips) {
      for (const ClipTag& tag : clip.tags) {
        const Eigen::Isometry3d pose = tilt() * tag.clip_from_tag;
        const Vec2 seen = darknessInPicture(images[c], cameras[c], pose, tag);
        const Vec2 expected = darknessByProjection(cameras[c], pose, tag);
        EXPECT_NEAR((seen - expected).norm(), 0.0, kOneTag_px)
            << cameras[c].name << ", tag " << tag.id << ": " << (seen - expected).transpose();
        sum += seen - expected;
        ++count;
      }
    }
    EXPECT_NEAR((sum / count).norm(), 0.0, kSubpixelTolerance) << cameras[c].name;
  }
}

/// What a pixel of the tilted, printed plane must be, up to a factor, by 4 x 4 places in the pixel.
double expectedLight(const VirtualCamera& camera, const NoisePattern& pattern, int x, int y) {
  const Eigen::Isometry3d plane_from_camera = (camera.camera_from_rig * tilt()).inverse();
  constexpr int kPlaces = 4;
  double sum = 0.0;
  for (int k = 0; k < kPlaces * kPlaces; ++k) {
    const Vec2 pixel(x + (k % kPlaces + 0.5) / kPlaces - 0.5,
                     y + (k / kPlaces + 0.5) / kPlaces - 0.5);
    const Vec2 n = *camera.model.normalized(pixel);
    const Vec3 from = plane_from_camera.translation();
    const Vec3 along = plane_from_camera.linear() * Vec3(n.x(), n.y(), 1.0);
    const Vec3 place = from - from.z() / along.z() * along;
    sum += pattern.albedo(place.x(), place.y(), 0.0);
  }
  return sum / (kPlaces * kPlaces);
}

TEST(SceneRendererTest, TheTextureIsWhereTheMeshIs) {
  auto cameras = someCameras();
  for (VirtualCamera& camera : cameras) camera.aperture_m = 0.0;
  const auto renderer = rendererOf("corner-pull", cameras, clean());
  const auto images = renderer->render(flatShape(tilt(), 4), 0);
  const NoisePattern pattern(0.1, renderer->featureSize_m(), 1);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (const Vec2& place : {Vec2(0.05, 0.05), Vec2(0.03, 0.06), Vec2(0.07, 0.04)}) {
      const Vec2 middle = *cameras[c].model.project(cameras[c].camera_from_rig *
                                                    (tilt() * Vec3(place.x(), place.y(), 0.0)));
      const int cx = static_cast<int>(middle.x()), cy = static_cast<int>(middle.y());
      constexpr int kReach_px = 12;
      // Linear least squares for shift, gain and offset.
      Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
      Eigen::Vector4d right = Eigen::Vector4d::Zero();
      for (int y = cy - kReach_px; y <= cy + kReach_px; ++y) {
        for (int x = cx - kReach_px; x <= cx + kReach_px; ++x) {
          const auto light = [&](int px, int py) {
            return 100.0 * expectedLight(cameras[c], pattern, px, py);
          };
          const Eigen::Vector4d row(0.5 * (light(x + 1, y) - light(x - 1, y)),
                                    0.5 * (light(x, y + 1) - light(x, y - 1)), light(x, y), 1.0);
          normal += row * row.transpose();
          right += row * images[c].at(x, y);
        }
      }
      const Eigen::Vector4d fit = normal.ldlt().solve(right);
      ASSERT_GT(fit[2], 0.5) << "the picture does not show the pattern";
      EXPECT_NEAR((fit.head<2>() / fit[2]).norm(), 0.0, kSubpixelTolerance)
          << cameras[c].name << " at " << place.transpose();
    }
  }
}

TEST(SceneRendererTest, ThreadsDoNotMatter) {
  RenderOptions options = clean();
  options.noise = true;
  const auto cameras = rigCameras({"shear", 2, 320, 3}).value();
  const auto renderer = rendererOf("shear", cameras, options);
  const SheetShape shape = flatShape(tilt(), 4);
  const auto many = renderer->render(shape, 5);
  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  const auto one = renderer->render(shape, 5);
  EXPECT_EQ(many[0].pixels, one[0].pixels);
  EXPECT_EQ(many[1].pixels, one[1].pixels);
  EXPECT_NE(many[0].pixels, renderer->render(shape, 6)[0].pixels);
}

TEST(SceneRendererTest, ExposureSaturatesAndFocusBlurs) {
  auto cameras = rigCameras({"shear", 2, 320, 3}).value();
  RenderOptions fine = clean();
  fine.samples = 8;  // a wide aperture through few rays is noise
  const auto renderer = rendererOf("shear", cameras, fine);
  const SheetShape shape = flatShape(Eigen::Isometry3d::Identity(), 4);
  const auto contrast = [](const ByteImage& image) {
    double sum = 0.0;
    for (int y = image.height / 2 - 20; y < image.height / 2 + 20; ++y) {
      for (int x = image.width / 2 - 20; x < image.width / 2 + 20; ++x) {
        sum += std::abs(image.at(x + 1, y) - image.at(x, y));
      }
    }
    return sum;
  };
  const ByteImage sharp = renderer->render(shape, 0)[0];
  VirtualCamera changed = cameras[0];
  changed.exposure = 20.0;
  renderer->setCamera(0, changed);
  EXPECT_EQ(renderer->render(shape, 0)[0].at(160, 100), 255);
  changed = cameras[0];
  changed.focus_m = 0.3;
  changed.aperture_m = 0.012;
  renderer->setCamera(0, changed);
  EXPECT_LT(contrast(renderer->render(shape, 0)[0]), 0.5 * contrast(sharp));
}

TEST(SceneRendererTest, RefusesUnknownTagsAndOptions) {
  Mounting mounting = rigMounting("knit-12", "shear").value();
  RenderOptions options = clean();
  options.samples = 0;
  EXPECT_FALSE(SceneRenderer::make(mounting, someCameras(), options).ok());
  mounting.clips[0].tags[0].family = "runes";
  const auto refused = SceneRenderer::make(mounting, someCameras(), clean());
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().reason.find("runes"), std::string::npos);
}

TEST(PixelDirectionsTest, AreTheLensInverse) {
  for (const VirtualCamera& camera : someCameras("bend-weft", 4)) {
    const PixelDirections directions(camera.model);
    for (int i = 0; i < 200; ++i) {
      const Vec2 pixel(std::fmod(37.7 * i, kWidth_px - 1.0),
                       std::fmod(23.3 * i, camera.model.heightPx() - 1.0));
      const Vec2 n = directions.at(pixel.x(), pixel.y());
      const auto back = camera.model.project(Vec3(n.x(), n.y(), 1.0));
      EXPECT_NEAR((*back - pixel).norm(), 0.0, 1e-3);
    }
  }
}

}  // namespace
}  // namespace tenter
