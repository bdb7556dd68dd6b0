// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "session_samples.h"
#include "tenter/core/files.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::Images;
using session_samples::readAll;
using session_samples::writeSession;
using test_support::listFolder;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class SessionRepairTest : public testing::Test {
 protected:
  void SetUp() override {
    writeSession(session_);
    whole_ = slurp(session_ / "journal.jsonl");
  }
  RepairReport repaired() { return SessionWriter::repair(session_).value(); }

  TemporaryFolder folder_;
  fs::path session_ = folder_ / "s";
  std::string whole_;
};

TEST_F(SessionRepairTest, AWholeSessionIsLeftAsItIs) {
  const std::string before = *sha256OfPath(session_);
  const RepairReport report = repaired();
  EXPECT_EQ(report.cut_bytes, 0u);
  EXPECT_EQ(report.report, "");
  EXPECT_EQ(*sha256OfPath(session_), before);
}

TEST_F(SessionRepairTest, TheTornTailGoesIntoTheReportAndTheSessionGoesOn) {
  const std::string torn = R"({"seq":33,"time_ns":1)";
  folder_.write("s/journal.jsonl", whole_ + torn);
  auto resumed = SessionWriter::resume(session_);
  ASSERT_TRUE(resumed.ok()) << resumed.error().message();
  const RepairReport& report = resumed->repair;
  EXPECT_EQ(report.cut_bytes, torn.size());
  EXPECT_EQ(report.cut_records, 1u);
  EXPECT_EQ(report.offset_bytes, whole_.size());
  EXPECT_EQ(slurp(session_ / report.report / "tail.bin"), torn);
  const auto written = nlohmann::json::parse(slurp(session_ / report.report / "report.json"));
  EXPECT_EQ(written.at("cut_bytes"), torn.size());
  EXPECT_EQ(written.at("offset_bytes"), whole_.size());
  ASSERT_TRUE(resumed->writer->close(resumed->writer->lastTime_ns()).ok());

  EXPECT_TRUE(slurp(session_ / "journal.jsonl").starts_with(whole_));
  const auto verified = verifySession(session_).value();
  EXPECT_THAT(verified.problems, IsEmpty());
  EXPECT_EQ(verified.cut_bytes, torn.size()) << "what was cut is not forgotten";
  EXPECT_EQ(verified.repairs, 1u);
  EXPECT_TRUE(verified.closed);
  const auto records = readAll(session_);
  EXPECT_THAT(std::get<SessionEvent>(records[33].body).data, HasSubstr(report.report));
}

TEST_F(SessionRepairTest, ALongTailGoesOverInBlocks) {
  std::string torn;
  for (int i = 0; torn.size() < 200'000; ++i) torn += "rubbish " + std::to_string(i) + "\n";
  folder_.write("s/journal.jsonl", whole_ + torn);
  const RepairReport report = repaired();
  EXPECT_EQ(report.cut_bytes, torn.size());
  EXPECT_EQ(slurp(session_ / report.report / "tail.bin"), torn);
  EXPECT_TRUE(verifySession(session_)->ok());
}

TEST_F(SessionRepairTest, ARecordThatLacksOnlyItsLineEndIsKept) {
  folder_.write("s/journal.jsonl", whole_.substr(0, whole_.size() - 1));
  const RepairReport report = repaired();
  EXPECT_TRUE(report.newline_added);
  EXPECT_EQ(report.cut_bytes, 0u);
  EXPECT_TRUE(slurp(session_ / "journal.jsonl").starts_with(whole_));
  EXPECT_TRUE(verifySession(session_)->ok());
}

TEST_F(SessionRepairTest, DamageBeforeGoodRecordsStaysWhereItIs) {
  std::string damaged = whole_;
  damaged[damaged.find("cell-1")] = 'X';
  folder_.write("s/journal.jsonl", damaged + "torn");
  const RepairReport report = repaired();
  EXPECT_EQ(report.cut_bytes, 4u);
  EXPECT_EQ(report.damaged_lines, 1u);
  EXPECT_TRUE(slurp(session_ / "journal.jsonl").starts_with(damaged));
  const auto verified = verifySession(session_).value();
  EXPECT_THAT(verified.problems, ElementsAre(HasSubstr("its CRC does not fit")));
  EXPECT_EQ(verified.records, 34u) << "33 less the damaged one, resumed and closed";
}

TEST_F(SessionRepairTest, ImagesWithoutARecordMoveAside) {
  folder_.write("s/frames/000002-left.png", "whole image");
  folder_.write("s/frames/000002-right.png.part", "half an im");
  auto resumed = SessionWriter::resume(session_);
  ASSERT_TRUE(resumed.ok()) << resumed.error().message();
  const RepairReport report = resumed->repair;
  EXPECT_THAT(report.stray_files,
              ElementsAre("frames/000002-left.png", "frames/000002-right.png.part"));
  EXPECT_EQ(slurp(session_ / report.report / "000002-left.png"), "whole image");
  EXPECT_EQ(resumed->writer->addFrame(resumed->writer->lastTime_ns(), Images(2).list)->frame, 2);
  EXPECT_TRUE(verifySession(session_)->ok());
}

TEST_F(SessionRepairTest, ARepairThatWasItselfKilledIsDoneAgainIntoTheSamePlace) {
  const std::string torn = "torn";
  folder_.write("s/journal.jsonl", whole_ + torn);
  folder_.write("s/frames/000002-left.png", "stray");
  const RepairReport first = repaired();
  // As if the power had gone after the report, before the cut and the move.
  folder_.write("s/journal.jsonl", whole_ + torn);
  fs::rename(session_ / first.report / "000002-left.png", session_ / "frames/000002-left.png");
  const RepairReport second = repaired();
  EXPECT_EQ(second.report, first.report);
  EXPECT_THAT(listFolder(session_ / "repairs"),
              ElementsAre(fs::path(first.report).filename().string()));
  EXPECT_THAT(listFolder(session_ / first.report),
              ElementsAre("000002-left.png", "report.json", "tail.bin"));
  EXPECT_EQ(verifySession(session_)->cut_bytes, torn.size()) << "counted once";
}

TEST_F(SessionRepairTest, AJournalCutToNothingBeginsAgain) {
  folder_.write("s/journal.jsonl", "");
  const RepairReport report = repaired();
  EXPECT_EQ(report.stray_files.size(), 4u);
  const auto verified = verifySession(session_).value();
  EXPECT_THAT(verified.problems, IsEmpty());
  EXPECT_EQ(verified.records, 3u) << "begin, resumed, closed";
}

TEST_F(SessionRepairTest, ADamagedReportIsAProblem) {
  folder_.write("s/journal.jsonl", whole_ + "torn");
  const std::string report = repaired().report;
  folder_.write("s/" + report + "/report.json", R"({"format":"other","cut_bytes":1})");
  EXPECT_FALSE(verifySession(session_)->ok());
  folder_.write("s/" + report + "/report.json", "{");
  EXPECT_FALSE(verifySession(session_)->ok());
}

}  // namespace
}  // namespace tenter
