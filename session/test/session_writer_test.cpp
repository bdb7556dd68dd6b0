// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/session_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "session_samples.h"
#include "tenter/core/files.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::header;
using session_samples::Images;
using session_samples::readAll;
using session_samples::sample;
using session_samples::timeOf;
using session_samples::writeSession;
using test_support::listFolder;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string what(const JournalRecord& record) {
  const auto* event = std::get_if<SessionEvent>(&record.body);
  return event == nullptr ? "" : event->what;
}

TEST(SessionWriterTest, AClosedSessionVerifies) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  EXPECT_THAT(listFolder(folder / "s"), ElementsAre("frames", "journal.jsonl", "session.json"));
  EXPECT_THAT(listFolder(folder / "s/frames"), ElementsAre("000000-left.png", "000000-right.png",
                                                           "000001-left.png", "000001-right.png"));
  const auto report = verifySession(folder / "s");
  ASSERT_TRUE(report.ok()) << report.error().message();
  EXPECT_THAT(report->problems, IsEmpty());
  EXPECT_EQ(report->samples, 22u);  // 20, and two of everyBody.
  EXPECT_EQ(report->frames, 2u);
  EXPECT_EQ(report->records, 33u);
  EXPECT_EQ(report->cut_bytes, 0u);
  EXPECT_EQ(report->stray_files, 0u);
  EXPECT_TRUE(report->closed);
  EXPECT_EQ(report->duration_ns, timeOf(20));
}

TEST(SessionWriterTest, RecordsComeBackInOrder) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  const auto records = readAll(folder / "s");
  EXPECT_EQ(what(records.front()), "begin");
  EXPECT_EQ(what(records.back()), "closed");
  for (std::size_t i = 0; i < records.size(); ++i) EXPECT_EQ(records[i].sequence, i);
  const auto& third = std::get<SampleRecord>(records[3].body);
  EXPECT_EQ(third.positions_m[1], 1e-5 * 2 + 0.001);
  EXPECT_EQ(records[3].time_ns, timeOf(2));
}

TEST(SessionWriterTest, LeavesFoldersOfOthersAlone) {
  const TemporaryFolder folder;
  folder.write("s/thesis.doc", "dear");
  EXPECT_FALSE(SessionWriter::create(folder / "s", header()).ok());
  EXPECT_THAT(listFolder(folder / "s"), ElementsAre("thesis.doc"));
  writeSession(folder / "old");
  const std::string before = *sha256OfPath(folder / "old");
  EXPECT_FALSE(SessionWriter::create(folder / "old", header()).ok());
  EXPECT_EQ(*sha256OfPath(folder / "old"), before);
}

TEST(SessionWriterTest, AnInvalidHeaderLeavesNothing) {
  const TemporaryFolder folder;
  SessionHeader h = header();
  h.relative_humidity = 65;
  EXPECT_THAT(SessionWriter::create(folder / "s", h).error().message(),
              HasSubstr("relative_humidity"));
  EXPECT_THAT(listFolder(folder.path()), IsEmpty());
}

TEST(SessionWriterTest, GoesOnWhereItStopped) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  // An hour after the header's start.
  const std::chrono::system_clock::time_point now{
      std::chrono::nanoseconds(*parseUtcStamp(header().start_utc)) + std::chrono::hours(1)};
  {
    auto resumed = SessionWriter::resume(folder / "s", now);
    ASSERT_TRUE(resumed.ok()) << resumed.error().message();
    EXPECT_EQ(resumed->repair.cut_bytes, 0u);
    EXPECT_EQ(resumed->repair.report, "");
    EXPECT_EQ(resumed->writer->lastTime_ns(), 3'600'000'000'000);
    const auto frame = resumed->writer->addFrame(3'600'000'000'001, Images(2).list);
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    EXPECT_EQ(frame->frame, 2);
  }
  const auto records = readAll(folder / "s");
  ASSERT_EQ(records.size(), 35u);
  EXPECT_EQ(what(records[33]), "resumed");
  EXPECT_EQ(records[33].time_ns, 3'600'000'000'000);
  const auto report = verifySession(folder / "s");
  EXPECT_THAT(report->problems, IsEmpty());
  EXPECT_FALSE(report->closed);
}

TEST(SessionWriterTest, ResumesNoEarlierThanItsLastRecordWhateverTheClockSays) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  const auto resumed = SessionWriter::resume(folder / "s", std::chrono::system_clock::time_point{});
  ASSERT_TRUE(resumed.ok()) << resumed.error().message();
  EXPECT_EQ(resumed->writer->lastTime_ns(), timeOf(20));
}

TEST(SessionWriterTest, HasOneWriterAtATime) {
  const TemporaryFolder folder;
  const auto first = SessionWriter::create(folder / "s", header());
  ASSERT_TRUE(first.ok());
  const auto second = SessionWriter::resume(folder / "s");
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message(), HasSubstr("being written by another program"));
  // Readers do not mind.
  EXPECT_TRUE(verifySession(folder / "s")->ok());
}

TEST(SessionWriterTest, EventsAreOnTheDiskAtOnceAndSamplesSoon) {
  const TemporaryFolder folder;
  SessionHeader h = header();
  h.commit_interval_ns = 20'000'000;
  const auto writer = std::move(SessionWriter::create(folder / "s", h)).value();
  EXPECT_EQ(writer->committedRecords(), 1u);
  ASSERT_TRUE(writer->append(0, sample(h, 0)).ok());
  ASSERT_TRUE(writer->append(0, StateChange{"Ready", "Running", ""}).ok());
  EXPECT_EQ(writer->committedRecords(), 3u);
  ASSERT_TRUE(writer->append(0, sample(h, 1)).ok());
  ASSERT_TRUE(writer->append(0, FaultEvent{"cell-0", "stale", ""}, Commit::kGroup).ok());
  EXPECT_EQ(writer->records(), 5u);
  // Far above the interval and any disk's sync; only a thread that never syncs takes longer.
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (writer->committedRecords() < 5 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(writer->committedRecords(), 5u);
  ASSERT_TRUE(writer->append(0, sample(h, 2), Commit::kNow).ok());
  EXPECT_EQ(writer->committedRecords(), 6u);
}

TEST(SessionWriterTest, AppendsReachTheFileBeforeTheyReturn) {
  const TemporaryFolder folder;
  SessionHeader h = header();
  h.commit_interval_ns = 10'000'000'000;
  const auto writer = std::move(SessionWriter::create(folder / "s", h)).value();
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(writer->append(timeOf(i), sample(h, i)).ok());
  EXPECT_EQ(readAll(folder / "s").size(), 11u);
}

TEST(SessionWriterTest, RefusedRecordsLeaveNoGap) {
  const TemporaryFolder folder;
  const SessionHeader h = header();
  const auto writer = std::move(SessionWriter::create(folder / "s", h)).value();
  EXPECT_FALSE(writer->append(0, Decision{"d", "rubbish"}).ok());
  EXPECT_FALSE(writer->append(-5, sample(h, 0)).ok());
  EXPECT_EQ(writer->append(0, sample(h, 0)).value(), 1u);
  ASSERT_TRUE(writer->close(1).ok());
  EXPECT_TRUE(verifySession(folder / "s")->ok());
}

TEST(SessionWriterTest, RefusedImagesLeaveNoFile) {
  const TemporaryFolder folder;
  const auto writer = std::move(SessionWriter::create(folder / "s", header())).value();
  const std::vector<std::vector<FrameImage>> refused = {
      {},
      {{"../up", "png", "x"}},
      {{"left", "PNG", "x"}},
      {{"left", "part", "x"}},
      {{"left", "png", "x"}, {"left", "png", "y"}},
  };
  for (const auto& images : refused) EXPECT_FALSE(writer->addFrame(0, images).ok());
  // The second image cannot be written: the first goes too.
  fs::create_directories(folder / "s/frames/000000-right.png.part");
  EXPECT_FALSE(writer->addFrame(0, Images(0).list).ok());
  EXPECT_THAT(listFolder(folder / "s/frames"), ElementsAre("000000-right.png.part"));
  fs::remove(folder / "s/frames/000000-right.png.part");
  EXPECT_EQ(writer->addFrame(0, Images(0).list)->frame, 0);
  EXPECT_TRUE(verifySession(folder / "s")->ok());
}

TEST(SessionWriterTest, ThreadsShareIt) {
  const TemporaryFolder folder;
  const SessionHeader h = header();
  const auto writer = std::move(SessionWriter::create(folder / "s", h)).value();
  constexpr int kEach = 40;
  {
    std::vector<std::jthread> threads;
    threads.emplace_back([&] {
      for (int i = 0; i < 10 * kEach; ++i) EXPECT_TRUE(writer->append(timeOf(i), sample(h, i)));
    });
    threads.emplace_back([&] {
      for (int i = 0; i < kEach; ++i) EXPECT_TRUE(writer->append(timeOf(i), Decision{"d", "{}"}));
    });
    threads.emplace_back([&] {
      for (int i = 0; i < 5; ++i) EXPECT_TRUE(writer->addFrame(timeOf(i), Images(i).list).ok());
    });
  }
  ASSERT_TRUE(writer->close(timeOf(10 * kEach)).ok());
  const auto report = verifySession(folder / "s");
  EXPECT_THAT(report->problems, IsEmpty());
  EXPECT_EQ(report->records, 2u + 11u * kEach + 5u);
}

}  // namespace
}  // namespace tenter
