// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "served_cameras.h"
#include "tenter/acquisition/camera_bank.h"
#include "tenter/twin/image_source.h"

namespace tenter::test {
namespace {

using namespace std::chrono_literals;
using testing::Eq;

constexpr int kWidth_px = 640, kHeight_px = 480;
constexpr auto kStart = 20s;

/// Of each camera, the frame that the set's image says it is; checks that it is whole and of that
/// camera.
std::vector<std::uint64_t> framesOf(const FrameSet& set) {
  std::vector<std::uint64_t> frames;
  for (std::size_t i = 0; i < set.frames.size(); ++i) {
    const auto mark = readTestPattern(set.frames[i].image.pixels);
    EXPECT_TRUE(mark) << "set " << set.number << ", camera " << i << ": "
                      << frameFaultName(set.frames[i].fault) << " " << set.frames[i].detail;
    if (!mark) return {};
    EXPECT_EQ(mark->camera, static_cast<int>(i));
    frames.push_back(mark->frame);
  }
  return frames;
}

/// Every set has the next frame of every camera: nothing is torn, and nothing of another moment.
TEST(CameraSets, FourHundredSetsOfFourCamerasAreWholeAndPaired) {
  ServedCameras served(4, kWidth_px, kHeight_px);
  CameraBank bank(served.section());
  ASSERT_TRUE(bank.awaitAll(kStart));
  std::vector<std::uint64_t> before;
  std::int64_t worst_skew_ns = 0;
  int retakes = 0;
  for (int i = 0; i < 400; ++i) {
    const FrameSet set = bank.takeSet();
    const auto frames = framesOf(set);
    ASSERT_EQ(frames.size(), 4U);
    // A busy machine may lose one; then all cameras go on by one more.
    for (std::size_t k = 0; k < before.size(); ++k) {
      ASSERT_EQ(frames[k], before[k] + 1 + static_cast<std::uint64_t>(set.retakes)) << "set " << i;
    }
    before = frames;
    retakes += set.retakes;
    worst_skew_ns = std::max(worst_skew_ns, set.skew_ns.value_or(0));
  }
  RecordProperty("retakes", retakes);
  RecordProperty("worst_skew_us", static_cast<int>(worst_skew_ns / 1000));
  EXPECT_LE(retakes, 4);
}

}  // namespace
}  // namespace tenter::test
