// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/acquisition/camera_bank.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scripted_camera.h"

namespace tenter {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr auto kStart = 5s;

std::string faultsOf(const FrameSet& set) {
  std::string text;
  for (const SetFrame& frame : set.frames) text += std::string(frameFaultName(frame.fault)) + ";";
  return text;
}

class CameraBankTest : public testing::Test {
 protected:
  CameraBankTest() : cameras_(3) {}
  void start() {
    bank_ = std::make_unique<CameraBank>(cameras_.section, cameras_.opener());
    ASSERT_TRUE(bank_->awaitAll(kStart));
  }
  ScriptedCameras cameras_;
  std::unique_ptr<CameraBank> bank_;
};

TEST_F(CameraBankTest, ASetHasAFrameOfEachCameraAndItsSkew) {
  start();
  for (int i = 0; i < 20; ++i) {
    const FrameSet set = bank_->takeSet();
    EXPECT_EQ(faultsOf(set), ";;;");
    EXPECT_EQ(set.retakes, 0);
    EXPECT_EQ(set.number, i);
    ASSERT_TRUE(set.skew_ns);
    EXPECT_GE(*set.skew_ns, 0);
    EXPECT_LT(*set.skew_ns, 100'000'000);
    // The warm-up's frame was thrown away.
    for (const SetFrame& frame : set.frames) {
      EXPECT_EQ(frame.image.frame_id, static_cast<std::uint64_t>(i) + 2);
    }
  }
}

TEST_F(CameraBankTest, ALostFrameHasTheWholeSetTakenAgain) {
  start();
  cameras_.set("b", [](CameraScript& script) { script.torn = 2; });
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faultsOf(set), ";;;");
  EXPECT_EQ(set.retakes, 2);
  ASSERT_EQ(set.events.size(), 2U);
  EXPECT_EQ(set.events[1].camera, 1);
  EXPECT_EQ(set.events[1].attempt, 1);
  EXPECT_EQ(set.events[1].fault, FrameFault::kLostPackets);
  for (const SetFrame& frame : set.frames) EXPECT_EQ(frame.image.frame_id, 4U);
}

TEST_F(CameraBankTest, RetakesEnd) {
  start();
  cameras_.set("b", [](CameraScript& script) { script.torn = 100; });
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(set.retakes, 3);
  EXPECT_EQ(faultsOf(set), ";lost-packets;;");
  EXPECT_FALSE(set.complete());
  EXPECT_THAT(set.frames[1].image.pixels, IsEmpty());
  EXPECT_THAT(bank_->status()[1].fault, HasSubstr("lost-packets"));
}

/// A frame that comes too late is not taken for the next set's.
TEST_F(CameraBankTest, AFrameOfTheTriggerBeforeIsThrownAway) {
  start();
  (void)bank_->takeSet();
  cameras_.set("c", [](CameraScript& script) { script.delayed = 1; });
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faultsOf(set), ";;;");
  EXPECT_EQ(set.retakes, 1);
  ASSERT_EQ(set.events.size(), 1U);
  EXPECT_EQ(set.events[0].fault, FrameFault::kNoFrame);
  for (const SetFrame& frame : set.frames) EXPECT_EQ(frame.image.frame_id, 4U);
}

TEST_F(CameraBankTest, ATriggerThatTheCameraSwallowedCostsOneRetake) {
  start();
  (void)bank_->takeSet();
  cameras_.set("c", [](CameraScript& script) { script.swallowed = 1; });
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faultsOf(set), ";;;");
  EXPECT_EQ(set.retakes, 1);
}

TEST_F(CameraBankTest, AFrozenCameraIsNamedAndItsImageNotKept) {
  start();
  cameras_.set("a", [](CameraScript& script) { script.same = true; });
  (void)bank_->takeSet();
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faultsOf(set), "frozen;;;");
  EXPECT_THAT(set.frames[0].image.pixels, IsEmpty());
}

TEST_F(CameraBankTest, AFrameNumberThatComesTwiceIsNamed) {
  start();
  cameras_.set("a", [](CameraScript& script) { script.same_id = true; });
  EXPECT_EQ(faultsOf(bank_->takeSet()), ";;;");
  EXPECT_EQ(faultsOf(bank_->takeSet()), "repeated-frame;;;");
}

TEST_F(CameraBankTest, AnOverExposedImageIsKeptAndMarked) {
  start();
  cameras_.set("b", [](CameraScript& script) { script.grey = 250; });
  const FrameSet set = bank_->takeSet();
  EXPECT_EQ(faultsOf(set), ";saturated;;");
  EXPECT_TRUE(set.complete());
  EXPECT_EQ(set.retakes, 0);
  EXPECT_GT(set.frames[1].quality.saturated_share, 0.5);
}

TEST_F(CameraBankTest, ACameraOutOfFocusIsNamedAgainstItsOwnPast) {
  cameras_.section.cameras.resize(1);  // nothing to be compared with
  start();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(faultsOf(bank_->takeSet()), ";");
  cameras_.set("a", [](CameraScript& script) { script.blur = 7; });
  EXPECT_EQ(faultsOf(bank_->takeSet()), "blurred;");
}

TEST_F(CameraBankTest, ACameraThatNeverWasInFocusIsNamedAgainstTheOthers) {
  cameras_.set("c", [](CameraScript& script) { script.blur = 7; });
  start();
  EXPECT_EQ(faultsOf(bank_->takeSet()), ";;blurred;");
}

TEST_F(CameraBankTest, ACameraThatLeavesComesBack) {
  start();
  cameras_.set("b", [](CameraScript& script) { script.there = false; });
  FrameSet set = bank_->takeSet();
  for (int i = 0; i < 10 && set.frames[1].fault != FrameFault::kNotConnected; ++i) {
    std::this_thread::sleep_for(100ms);
    set = bank_->takeSet();
  }
  EXPECT_EQ(faultsOf(set), ";not-connected;;");
  EXPECT_EQ(set.retakes, 0);
  cameras_.set("b", [](CameraScript& script) { script.there = true; });
  ASSERT_TRUE(bank_->awaitAll(kStart));
  EXPECT_EQ(faultsOf(bank_->takeSet()), ";;;");
}

/// As it happens where the driver loses a stream's packets (docs/traps.md).
TEST_F(CameraBankTest, ACameraThatSendsNothingThroughAWholeSetIsOpenedAnew) {
  start();
  cameras_.set("b", [](CameraScript& script) { script.mute = true; });
  EXPECT_EQ(faultsOf(bank_->takeSet()), ";no-frame;;");
  ASSERT_TRUE(bank_->awaitAll(kStart));
  EXPECT_EQ(faultsOf(bank_->takeSet()), ";;;");
}

TEST_F(CameraBankTest, ExchangedCamerasAreNamed) {
  cameras_.scripts["a"].swap(cameras_.scripts["b"]);
  bank_ = std::make_unique<CameraBank>(cameras_.section, cameras_.opener());
  EXPECT_FALSE(bank_->awaitAll(500ms));
  EXPECT_EQ(faultsOf(bank_->takeSet()), "swapped;swapped;;");
  EXPECT_THAT(bank_->status()[0].fault, HasSubstr("Sb answers at here instead of Sa"));
}

/// The others' frames are there in time, though one camera's driver hangs.
TEST_F(CameraBankTest, ADriverThatHangsKeepsNobodyWaiting) {
  cameras_.section.retakes = 0;
  start();
  cameras_.set("a", [](CameraScript& script) { script.hangs = 3s; });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(faultsOf(bank_->takeSet()), "no-answer;;;");
  EXPECT_EQ(faultsOf(bank_->takeSet()), "no-answer;;;");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
}

/// Hardware trigger: a pulse between the questions to two cameras.
TEST_F(CameraBankTest, FramesOfTwoPulsesArePaired) {
  cameras_.section.hardware_trigger = true;
  cameras_.section.warm_up_sets = 0;
  cameras_.section.set_timeout = 1s;
  cameras_.section.common_clock = true;
  start();
  std::atomic<bool> ends{false};
  std::thread pulses([&] {
    std::vector<std::unique_ptr<ScriptedCamera>> sensors;
    for (const auto& [name, script] : cameras_.scripts) {
      sensors.push_back(std::make_unique<ScriptedCamera>(script));
    }
    while (!ends) {
      for (auto& sensor : sensors) (void)sensor->trigger();
      std::this_thread::sleep_for(60ms);
    }
  });
  for (int i = 0; i < 10; ++i) {
    const FrameSet set = bank_->takeSet();
    EXPECT_EQ(faultsOf(set), ";;;");
    EXPECT_EQ(set.frames[0].image.frame_id, set.frames[1].image.frame_id);
    EXPECT_EQ(set.frames[0].image.frame_id, set.frames[2].image.frame_id);
  }
  ends = true;
  pulses.join();
}

}  // namespace
}  // namespace tenter
