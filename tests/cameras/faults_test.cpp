// SPDX-License-Identifier: GPL-3.0-or-later
// Each fault of a camera is named for what it is, and no image is taken for what it is not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "served_cameras.h"
#include "tenter/acquisition/camera_bank.h"
#include "tenter/twin/image_source.h"

namespace tenter::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr int kCameras = 3;
constexpr auto kStart = 20s;

class CameraFaults : public testing::Test {
 protected:
  CameraFaults() : served_(kCameras, 640, 480) {}

  void start(const CameraSection& section) {
    bank_ = std::make_unique<CameraBank>(section);
    ASSERT_TRUE(bank_->awaitAll(kStart)) << bank_->status()[0].fault;
  }
  void start() { start(served_.section()); }

  /// Sets until one is as wished; fails after so long.
  FrameSet takeUntil(const std::function<bool(const FrameSet&)>& wished) {
    const auto until = std::chrono::steady_clock::now() + kStart;
    for (;;) {
      FrameSet set = bank_->takeSet();
      checkImages(set);
      if (wished(set)) return set;
      if (std::chrono::steady_clock::now() > until) {
        ADD_FAILURE() << "last: " << faults(set);
        return set;
      }
      std::this_thread::sleep_for(20ms);
    }
  }

  static std::string faults(const FrameSet& set) {
    std::string text;
    for (const SetFrame& frame : set.frames) text += std::string(frameFaultName(frame.fault)) + ";";
    return text;
  }

  /// What is given as an image of a camera is one, unless it is marked.
  static void checkImages(const FrameSet& set) {
    for (std::size_t i = 0; i < set.frames.size(); ++i) {
      if (set.frames[i].fault != FrameFault::kNone) continue;
      const auto mark = readTestPattern(set.frames[i].image.pixels);
      ASSERT_TRUE(mark) << "camera " << i;
      EXPECT_EQ(mark->camera, static_cast<int>(i));
    }
  }

  ServedCameras served_;
  std::unique_ptr<CameraBank> bank_;
};

/// Small packets, so that there are some hundred of them in an image.
TEST_F(CameraFaults, LostPacketsHaveTheSetTakenAgain) {
  CameraSection section = served_.section();
  section.packet_bytes = 9000;
  section.retakes = 20;
  start(section);
  for (const double share : {0.001, 0.01}) {
    for (int i = 0; i < kCameras; ++i) {
      served_.tell("lose " + std::to_string(i) + " " + std::to_string(share));
    }
    int retakes = 0;
    for (int i = 0; i < 12; ++i) {
      const FrameSet set = bank_->takeSet();
      checkImages(set);
      EXPECT_TRUE(set.complete()) << faults(set);
      for (const SetEvent& event : set.events) {
        EXPECT_TRUE(event.fault == FrameFault::kLostPackets || event.fault == FrameFault::kNoFrame)
            << frameFaultName(event.fault);
      }
      retakes += set.retakes;
    }
    if (share > 0.005) {
      EXPECT_GT(retakes, 0);
    }
  }
}

TEST_F(CameraFaults, WhereEverythingIsLostTheSetSaysSo) {
  CameraSection section = served_.section();
  section.retakes = 1;
  start(section);
  served_.tell("lose 1 1.0");
  const auto begin = std::chrono::steady_clock::now();
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faults(set), ";no-frame;;");
  EXPECT_EQ(set.retakes, 1);
  checkImages(set);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 6s);  // two time-outs of 2 s, and a little
}

TEST_F(CameraFaults, ACameraThatIsUnpluggedIsNamedAndComesBack) {
  start();
  served_.tell("unplug 2");
  const FrameSet without =
      takeUntil([](const FrameSet& s) { return s.frames[2].fault == FrameFault::kNotConnected; });
  EXPECT_EQ(without.frames[0].fault, FrameFault::kNone);
  EXPECT_EQ(without.frames[1].fault, FrameFault::kNone);
  served_.tell("replug 2");
  const FrameSet again = takeUntil([](const FrameSet& s) { return s.complete(); });
  EXPECT_EQ(faults(again), ";;;");
}

TEST_F(CameraFaults, AFrozenCameraIsNamedAndItsImagesAreNotKept) {
  start();
  (void)bank_->takeSet();
  served_.tell("freeze 0 1");
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faults(set), "frozen;;;");
  EXPECT_TRUE(set.frames[0].image.pixels.empty());
  served_.tell("freeze 0 0");
  EXPECT_EQ(faults(bank_->takeSet()), ";;;");
}

TEST_F(CameraFaults, OverExposedAndDefocusedImagesAreMarked) {
  start();
  for (int i = 0; i < 4; ++i) EXPECT_EQ(faults(bank_->takeSet()), ";;;");
  served_.tell("overexpose 1 1");
  EXPECT_EQ(faults(bank_->takeSet()), ";saturated;;");
  served_.tell("overexpose 1 0");
  served_.tell("defocus 1 3.0");
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faults(set), ";blurred;;");
  EXPECT_TRUE(set.complete());  // the image is there, and marked
  served_.tell("defocus 1 0");
  EXPECT_EQ(faults(bank_->takeSet()), ";;;");
}

TEST_F(CameraFaults, ExchangedCablesAreNamed) {
  start();
  served_.tell("exchange 0 1");
  const FrameSet set = takeUntil([](const FrameSet& s) {
    return s.frames[0].fault == FrameFault::kSwapped && s.frames[1].fault == FrameFault::kSwapped;
  });
  EXPECT_EQ(set.frames[2].fault, FrameFault::kNone);
  EXPECT_THAT(bank_->status()[0].fault, HasSubstr("TWIN-2"));
  served_.tell("exchange 0 1");
  EXPECT_EQ(faults(takeUntil([](const FrameSet& s) { return s.complete(); })), ";;;");
}

}  // namespace
}  // namespace tenter::test
