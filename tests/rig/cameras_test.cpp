// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon's sessions with images, from virtual cameras that show what they are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "running_rig.h"
#include "tenter/core/json_reader.h"
#include "tenter/session/session_reader.h"
#include "tenter/twin/image_source.h"

namespace tenter::rig_system_test {
namespace {

namespace fs = std::filesystem;

constexpr int kCameras = 2;
/// Some ten captures while nothing moves.
constexpr const char* kStandStill = R"(schema_version = 1
name = "stand-still"
description = "looks at the sample"
axes = ["axis-1"]
speed_m_per_s = 0.001
capture_interval_s = 0.3
[[phase]]
name = "look"
[[phase.step]]
end = "hold"
hold_s = 3.0
)";

VirtualCamerasOptions smallCameras() {
  VirtualCamerasOptions options;
  options.count = kCameras;
  options.width_px = 320;
  options.height_px = 200;
  options.source = std::make_shared<TestPatternSource>();
  return options;
}

std::optional<TestPatternMark> markOf(const fs::path& png) {
  const cv::Mat image = cv::imread(png.string(), cv::IMREAD_UNCHANGED);
  if (image.type() != CV_8UC1 || !image.isContinuous()) return std::nullopt;
  return readTestPattern({image.data, image.total()});
}

struct Recorded {
  std::vector<FrameRecord> frames;
  std::vector<nlohmann::json> sets;
  std::map<std::string, int> faults;  ///< "cam-2 not-connected" and how often.
};

Recorded readBack(const fs::path& session) {
  Recorded out;
  auto reader = SessionReader::open(session);
  EXPECT_TRUE(reader) << reader.error().message();
  while (reader) {
    const auto record = (*reader)->next();
    EXPECT_TRUE(record);
    if (!record || !*record) break;
    const RecordBody& body = (*record)->body;
    if (const auto* frame = std::get_if<FrameRecord>(&body)) out.frames.push_back(*frame);
    if (const auto* fault = std::get_if<FaultEvent>(&body)) {
      ++out.faults[fault->source + " " + fault->fault];
    }
    const auto* generic = std::get_if<GenericRecord>(&body);
    if (generic != nullptr && generic->kind == "frame-set") {
      out.sets.push_back(*parseJson(generic->data, "frame-set"));
    }
  }
  return out;
}

/// A run of the daemon on a machine full of other work may be refused; that is tried again.
fs::path runOnce(RunningRig& running) {
  const std::string protocol = running.write("still.toml", kStandStill);
  for (int trial = 0; trial < 3; ++trial) {
    const std::string session = running.path("session-" + std::to_string(trial));
    if (running.tenterRig({"run", protocol, "-o", session, "--fabric", "knit-12"}) == 0) {
      return session;
    }
  }
  ADD_FAILURE() << "no run succeeds";
  return running.path("session-2");
}

TEST(DaemonCamerasTest, ARunRecordsWholeSetsInOrder) {
  RunningRig running(true, {}, smallCameras());
  const fs::path session = runOnce(running);
  const auto report = verifySession(session);
  ASSERT_TRUE(report);
  EXPECT_THAT(report->problems, testing::IsEmpty());
  EXPECT_TRUE(report->closed);
  const Recorded recorded = readBack(session);
  ASSERT_GE(recorded.frames.size(), 8U);
  EXPECT_EQ(recorded.sets.size(), recorded.frames.size());
  std::vector<std::uint64_t> before(kCameras, 0);
  for (std::size_t k = 0; k < recorded.frames.size(); ++k) {
    const FrameRecord& frame = recorded.frames[k];
    ASSERT_EQ(frame.files.size(), static_cast<std::size_t>(kCameras));
    EXPECT_EQ(recorded.sets[k]["frame"], frame.frame);
    EXPECT_GE(recorded.sets[k]["skew_ns"].get<std::int64_t>(), 0);
    const auto step = 1 + recorded.sets[k]["retakes"].get<std::uint64_t>();
    for (std::size_t i = 0; i < before.size(); ++i) {
      const auto mark = markOf(session / frame.files[i].name);
      ASSERT_TRUE(mark) << frame.files[i].name;
      EXPECT_EQ(mark->camera, static_cast<int>(i));
      if (k > 0) {
        EXPECT_EQ(mark->frame, before[i] + step);
      }
      before[i] = mark->frame;
    }
  }
}

TEST(DaemonCamerasTest, ClientsSeeWhatTheCamerasSee) {
  RunningRig running(true, {}, smallCameras());
  ASSERT_TRUE(waitFor(20.0, [&] {
    const auto cameras = running.status()["cameras"];
    return cameras.size() == kCameras && cameras[0]["connected"] && cameras[1]["connected"];
  }));
  ASSERT_EQ(running.tenterRig({"snap", "-o", running.path("snap")}), 0);
  for (int i = 0; i < kCameras; ++i) {
    const auto mark =
        markOf(fs::path(running.path("snap")) / ("cam-" + std::to_string(i + 1) + ".png"));
    ASSERT_TRUE(mark);
    EXPECT_EQ(mark->camera, i);
  }
}

TEST(DaemonCamerasTest, NoRunBeginsWithoutAllCamerasAndOneThatLeavesIsNamed) {
  RunningRig running(true, {}, smallCameras());
  running.rig().cameras()->unplug(1);
  const std::string protocol = running.write("still.toml", kStandStill);
  EXPECT_EQ(running.tenterRig({"run", protocol, "-o", running.path("refused")}), 6);
  EXPECT_FALSE(fs::exists(running.path("refused")));
  ASSERT_TRUE(running.rig().cameras()->replug(1));
  const std::string session = running.path("session");
  const pid_t client = running.startTenterRig({"run", protocol, "-o", session});
  ASSERT_TRUE(waitFor(40.0, [&] {
    const auto report = inspectSession(session);
    return report.ok() && report->frames >= 2;
  }));
  running.rig().cameras()->unplug(1);
  EXPECT_EQ(RunningRig::wait(client), 0);  // the run goes on without it
  const Recorded recorded = readBack(session);
  EXPECT_GT(recorded.faults.count("cam-2 not-connected") + recorded.faults.count("cam-2 no-answer"),
            0U);
  ASSERT_FALSE(recorded.frames.empty());
  EXPECT_EQ(recorded.frames.front().files.size(), 2U);
  EXPECT_EQ(recorded.frames.back().files.size(), 1U);
  EXPECT_TRUE(verifySession(session)->ok());
}

}  // namespace
}  // namespace tenter::rig_system_test
