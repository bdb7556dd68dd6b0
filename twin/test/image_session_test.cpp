// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/image_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture_support.h"
#include "tenter/calib/byte_image.h"
#include "tenter/core/files.h"
#include "tenter/session/mounting.h"
#include "tenter/session/session_reader.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::listFolder;
using test_support::slurp;
using test_support::TemporaryFolder;

ImageSessionOptions smallSession(const TemporaryFolder& folder, const std::string& protocol) {
  ImageSessionOptions options;
  options.capture = smallCapture("knit-12", protocol);
  options.capture.frames = 2;
  options.cameras.count = 2;
  options.cameras.width_px = 320;
  options.render.samples = 1;
  options.render.facets = 40;
  options.protocol_text = "name = \"" + protocol + "\"\n";
  options.start_utc = "2026-11-25T08:00:00Z";
  options.session = folder / "S";
  options.truth = folder / "T";
  return options;
}

std::vector<JournalRecord> recordsOf(const std::filesystem::path& session) {
  auto reader = SessionReader::open(session);
  std::vector<JournalRecord> records;
  while (auto record = (*reader)->next().value()) records.push_back(*record);
  return records;
}

TEST(ImageSessionTest, IsASessionWithImagesMountingAndCalibration) {
  const TemporaryFolder folder;
  const ImageSessionOptions options = smallSession(folder, "stretch-weft");
  const auto summary = captureImageSession(options);
  ASSERT_TRUE(summary.ok()) << summary.error().message();
  EXPECT_EQ(summary->frames, 3);
  const SessionReport report = verifySession(folder / "S").value();
  EXPECT_TRUE(report.ok());
  EXPECT_TRUE(report.closed);
  EXPECT_EQ(report.frames, 3U);
  EXPECT_EQ(report.samples, 3U);
  const SessionHeader header = readSessionHeader(folder / "S").value();
  EXPECT_EQ(header.calibration_ids.at("mounting"), sha256(slurp(folder / "S/mounting.json")));
  EXPECT_EQ(header.calibration_ids.at("cameras"),
            sha256(slurp(folder / "S/calibration/cameras.json")));
  EXPECT_EQ(readMounting(folder / "S/mounting.json").value().rest_frame, 0);
  const CameraCalibration known = readCalibration(folder / "S/calibration/cameras.json").value();
  ASSERT_TRUE(known.rig.has_value());
  const ByteImage image = readByteImage(folder / "S/frames/000002-cam-2.png").value();
  EXPECT_EQ(image.width, known.find("cam-2")->model.widthPx());
  EXPECT_EQ(image.height, known.find("cam-2")->model.heightPx());
}

TEST(ImageSessionTest, ItsTensionsAreThoseOfTheMeasurement) {
  const TemporaryFolder folder;
  const ImageSessionOptions options = smallSession(folder, "corner-pull");
  ASSERT_TRUE(captureImageSession(options).ok());
  const CaptureResult same = captured(options.capture);
  const Mounting mounting = readMounting(folder / "S/mounting.json").value();
  std::vector<SampleRecord> samples;
  for (const JournalRecord& record : recordsOf(folder / "S")) {
    if (const auto* sample = std::get_if<SampleRecord>(&record.body)) samples.push_back(*sample);
  }
  ASSERT_EQ(samples.size(), 3U);
  for (std::size_t i = 0; i < 2; ++i) {
    for (const CordReading& cord : same.measurement.frames[i].cords) {
      for (const MountedCord& known : mounting.cords) {
        if (known.cord != cord.cord) continue;
        EXPECT_EQ(samples[i + 1].tensions[static_cast<std::size_t>(known.cell)].tension_N,
                  cord.tension_N);
      }
    }
  }
  EXPECT_GT(*samples[1].positions_m[0], *samples[0].positions_m[0]);  // drawn in from rest
}

TEST(ImageSessionTest, TheTruthLiesBesideAndKnowsTheTrueCameras) {
  const TemporaryFolder folder;
  ASSERT_TRUE(captureImageSession(smallSession(folder, "bend-bias")).ok());
  EXPECT_THAT(listFolder(folder / "T"),
              testing::IsSupersetOf({"cameras.json", "truth.json", "exact"}));
  const CameraCalibration truth = readCalibration(folder / "T/cameras.json").value();
  const CameraCalibration known = readCalibration(folder / "S/calibration/cameras.json").value();
  EXPECT_NE(truth.cameras[1].model.lens().cx_px, known.cameras[1].model.lens().cx_px);
  const Measurement exact = readMeasurement(folder / "T/exact").value();
  EXPECT_EQ(exact.frames.size(), 2U);
  const Mounting mounting = readMounting(folder / "S/mounting.json").value();
  ASSERT_TRUE(mounting.table.has_value());
  // The table's pose is the push, and so is the actuator's travel.
  const Vec3 pushed = exact.frames[1].clips[0].rig_from_clip.translation();
  double travelled = 0.0;
  for (const JournalRecord& record : recordsOf(folder / "S")) {
    if (const auto* sample = std::get_if<SampleRecord>(&record.body))
      travelled = *sample->positions_m.at(static_cast<std::size_t>(*mounting.table->push_actuator));
  }
  EXPECT_NEAR(pushed.dot(mounting.table->push), travelled, 1e-12);
}

TEST(ImageSessionTest, WhatIsCancelledKeepsItsWholeFrames) {
  const TemporaryFolder folder;
  ImageSessionOptions options = smallSession(folder, "stretch-weft");
  bool stop = false;
  options.progress = [&](double /*share*/, const std::string& what) {
    if (what.starts_with("frame 2")) stop = true;
  };
  options.capture.cancelled = [&] { return stop; };
  const auto summary = captureImageSession(options);
  ASSERT_FALSE(summary.ok());
  EXPECT_EQ(summary.error().kind, ErrorKind::kNotConverged);
  const SessionReport report = verifySession(folder / "S").value();
  EXPECT_TRUE(report.ok());
  EXPECT_TRUE(report.closed);
  EXPECT_EQ(report.frames, 2U);
}

TEST(ImageSessionTest, RefusesCalibrationsOfOtherCamerasBeforeAnythingIsWritten) {
  const TemporaryFolder folder;
  ImageSessionOptions options = smallSession(folder, "stretch-weft");
  const auto others = rigCameras({"stretch-weft", 2, 640, 1}).value();
  options.calibration = calibrationOf(others, rigFocus("stretch-weft"), 0.0, 1);
  const auto refused = captureImageSession(options);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().reason, testing::HasSubstr("another image size"));
  options.calibration->rig.reset();
  EXPECT_FALSE(captureImageSession(options).ok());
  EXPECT_FALSE(std::filesystem::exists(folder / "S"));
}

}  // namespace
}  // namespace tenter
