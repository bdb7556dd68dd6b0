// SPDX-License-Identifier: GPL-3.0-or-later
// `tenter reconstruct SESSION` on what the virtual rig renders, against the truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "program.h"
#include "tenter/core/files.h"
#include "tenter/core/measurement.h"
#include "tenter/reconstruction/image_session.h"
#include "tenter/session/rest_pictures.h"
#include "tenter/session/session_writer.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kVertices = "40";

/// A small session of the picture frame, with its truth.
void render(const TemporaryFolder& folder) {
  const Outcome made =
      tenter({"twin",   "capture",   "--fabric",  "knit-12",       "--protocol", "shear",
              "--seed", "3",         "--session", "--frames",      "3",          "--nodes",
              "17",     "--tracked", kVertices,   "--image-width", "640",        "--cameras",
              "4",      "-o",        "S",         "--truth",       "T",          "--json"},
             folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
}

Outcome reconstruct(const TemporaryFolder& folder, const std::string& session,
                    const std::string& measurement) {
  return tenter({"reconstruct", session, "-o", measurement, "--vertices", kVertices, "--subset",
                 "21", "--json"},
                folder.path());
}

TEST(ReconstructSession, ARenderedSessionIsMeasuredAgainstTheTruth) {
  const TemporaryFolder folder;
  render(folder);
  const Outcome done = reconstruct(folder, "S", "M");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_EQ(done.json().at("frames"), 3);
  EXPECT_GT(done.json().at("valid_fraction").get<double>(), 0.85);
  EXPECT_THAT(done.json().at("warnings"), IsEmpty());
  EXPECT_FALSE(fs::exists(folder / "M.partial"));
  const auto seen = readMeasurement(folder / "M"), truth = readMeasurement(folder / "T/exact");
  ASSERT_TRUE(seen.ok() && truth.ok());
  ASSERT_EQ(seen->rest->vertexCount(), truth->rest->vertexCount());
  ASSERT_LT((seen->rest->uv - truth->rest->uv).cwiseAbs().maxCoeff(), 1e-9);
  // 0.41 mm a pixel, in a picture frame whose corners are sheared more than subsets can follow.
  constexpr double kRms_m = 0.02e-3, kWorst_m = 0.12e-3;
  constexpr double kClamped_m = 0.1e-3, kCord_rad = 0.005;  // 0.3 degrees
  for (std::size_t f = 0; f < seen->frames.size(); ++f) {
    const MeasurementFrame &a = seen->frames[f], &b = truth->frames[f];
    double squares = 0.0, worst_m = 0.0, count = 0.0;
    for (Eigen::Index v = 0; v < a.positions.cols(); ++v) {
      if (a.valid[static_cast<std::size_t>(v)] == 0) continue;
      const double error_m = (a.positions.col(v) - b.positions.col(v)).norm();
      squares += error_m * error_m;
      worst_m = std::max(worst_m, error_m);
      count += 1.0;
    }
    EXPECT_LT(std::sqrt(squares / count), kRms_m) << "frame " << f;
    EXPECT_LT(worst_m, kWorst_m) << "frame " << f;
    ASSERT_EQ(a.clips.size(), b.clips.size());
    for (const ClipReading& clip : a.clips) {
      const auto same = std::find_if(b.clips.begin(), b.clips.end(),
                                     [&](const ClipReading& c) { return c.clip == clip.clip; });
      ASSERT_NE(same, b.clips.end());
      EXPECT_EQ(clip.clamped_vertices, same->clamped_vertices);
      for (const int v : clip.clamped_vertices) {
        EXPECT_LT((a.positions.col(v) - b.positions.col(v)).norm(), kClamped_m) << clip.clip;
      }
    }
    EXPECT_EQ(a.cords.size(), b.cords.size());
    for (const CordReading& cord : a.cords) {
      const auto same = std::find_if(b.cords.begin(), b.cords.end(),
                                     [&](const CordReading& c) { return c.cord == cord.cord; });
      ASSERT_NE(same, b.cords.end());
      EXPECT_LT((cord.direction - same->direction).norm(), kCord_rad) << cord.cord;
    }
  }
}

/// The same session as a rig leaves it whose sample was photographed before it was hung.
void splitOffTheRest(const fs::path& whole, const fs::path& session) {
  auto reader = SessionReader::open(whole);
  ASSERT_TRUE(reader.ok());
  SessionHeader header = (*reader)->header();
  header.calibration_ids.erase("mounting");
  auto writer = SessionWriter::create(session, header);
  ASSERT_TRUE(writer.ok()) << writer.error().message();
  fs::create_directories(session / kRestFolder);
  while (true) {
    const auto record = (*reader)->next();
    ASSERT_TRUE(record.ok());
    if (!record->has_value()) break;
    if (const auto* sample = std::get_if<SampleRecord>(&(*record)->body)) {
      ASSERT_TRUE((*writer)->append((*record)->time_ns, *sample).ok());
    }
    const auto* frame = std::get_if<FrameRecord>(&(*record)->body);
    if (frame == nullptr) continue;
    std::vector<std::string> bytes;
    std::vector<FrameImage> images;
    bytes.reserve(frame->files.size());
    for (const FrameFile& file : frame->files) {
      const std::string camera = fs::path(file.name).stem().string().substr(7);
      bytes.push_back(*readFile(whole / file.name));
      if (frame->frame == 0) {
        fs::copy_file(whole / file.name, session / kRestFolder / (camera + ".png"));
      }
      images.push_back({camera, "png", bytes.back()});
    }
    if (frame->frame == 0) continue;
    ASSERT_TRUE((*writer)->addFrame((*record)->time_ns, images).ok());
  }
  ASSERT_TRUE((*writer)->close(1'000'000'000'000).ok());
  auto mounting = readMounting(whole / kMountingFile);
  ASSERT_TRUE(mounting.ok());
  mounting->rest_frame.reset();
  ASSERT_TRUE(writeFileAtomically(session / kMountingFile, *mountingJson(*mounting)).ok());
  fs::create_directories((session / kSessionCalibrationFile).parent_path());
  fs::copy_file(whole / kSessionCalibrationFile, session / kSessionCalibrationFile);
}

TEST(ReconstructSession, PicturesFromBeforeItWasHungAreTheReference) {
  const TemporaryFolder folder;
  render(folder);
  splitOffTheRest(folder / "S", folder / "R");
  ASSERT_EQ(reconstruct(folder, "S", "M").exit_code, 0);
  const Outcome done = reconstruct(folder, "R", "N");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_THAT(done.json().at("warnings"), IsEmpty());
  const auto one = readMeasurement(folder / "M"), other = readMeasurement(folder / "N");
  ASSERT_TRUE(one.ok() && other.ok());
  ASSERT_EQ(one->frames.size(), other->frames.size());
  for (std::size_t f = 0; f < one->frames.size(); ++f) {
    EXPECT_EQ(one->frames[f].positions, other->frames[f].positions);
  }
  // With their hashes on record one that was altered since is left out, which is said.
  ASSERT_TRUE(addRestPictures(folder / "R", folder / "R/rest").ok());
  const auto altered = fs::directory_iterator(folder / "R/rest")->path();
  ASSERT_TRUE(writeFileAtomically(altered, *readFile(altered) + "x").ok());
  const Outcome noticed = reconstruct(folder, "R", "P");
  EXPECT_EQ(noticed.exit_code, 0) << noticed.err;
  EXPECT_THAT(noticed.out, HasSubstr(altered.filename().string() + ": is not the image"));
  // Without a record and without them the first frame stands in, which is said.
  fs::remove_all(folder / "R");
  splitOffTheRest(folder / "S", folder / "R");
  fs::remove_all(folder / "R/rest");
  const Outcome without = reconstruct(folder, "R", "O");
  EXPECT_EQ(without.exit_code, 0) << without.err;
  EXPECT_THAT(without.out, HasSubstr("no frame at rest"));
}

}  // namespace
}  // namespace tenter::system_test
