// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>

#include "journal_line.h"
#include "session_samples.h"
#include "tenter/core/files.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::readAll;
using session_samples::writeSession;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// Places where the lines of a text begin, and its end.
std::vector<std::size_t> lineStarts(const std::string& text) {
  std::vector<std::size_t> starts = {0};
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') starts.push_back(i + 1);
  }
  return starts;
}

class SessionVerifyTest : public testing::Test {
 protected:
  void SetUp() override { writeSession(session_); }

  void rewriteJournal(const std::function<void(std::string&, std::vector<std::size_t>)>& edit) {
    std::string journal = slurp(session_ / "journal.jsonl");
    edit(journal, lineStarts(journal));
    folder_.write("s/journal.jsonl", journal);
  }
  std::vector<std::string> problems() const { return verifySession(session_).value().problems; }

  TemporaryFolder folder_;
  fs::path session_ = folder_ / "s";
};

TEST_F(SessionVerifyTest, SeesAFlippedBitInAnyLine) {
  const std::string before = slurp(session_ / "journal.jsonl");
  const auto starts = lineStarts(before);
  for (std::size_t line = 0; line + 1 < starts.size(); ++line) {
    std::string damaged = before;
    damaged[(starts[line] + starts[line + 1]) / 2] ^= 4;
    folder_.write("s/journal.jsonl", damaged);
    ASSERT_FALSE(problems().empty()) << line;
    EXPECT_THAT(problems()[0], HasSubstr("line " + std::to_string(line + 1) + ": its CRC")) << line;
    if (line + 2 >= starts.size()) continue;
    EXPECT_THROW(readAll(session_), std::logic_error) << "readers stop at damage";
  }
}

TEST_F(SessionVerifyTest, SeesLinesThatAreMissingDoubledOrExchanged) {
  const std::string before = slurp(session_ / "journal.jsonl");
  rewriteJournal([](std::string& j, const auto& at) { j.erase(at[5], at[6] - at[5]); });
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("line 6: has sequence number 6 instead of 5")));
  folder_.write("s/journal.jsonl", before);
  rewriteJournal(
      [](std::string& j, const auto& at) { j.insert(at[5], j.substr(at[5], at[6] - at[5])); });
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("sequence number 5 instead of 6")));
  EXPECT_THROW(readAll(session_), std::logic_error);
}

TEST_F(SessionVerifyTest, SeesValuesThatCannotBeThoughTheCrcFits) {
  rewriteJournal([](std::string& j, const auto& at) {
    std::string line;
    appendSealed(line, R"({"seq":5,"time_ns":0,"kind":"phase"})");
    j.replace(at[5], at[6] - at[5], line);
  });
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("line 6: edge")));
}

TEST_F(SessionVerifyTest, SeesWhatHappenedToImages) {
  const fs::path image = session_ / "frames/000001-right.png";
  const std::string bytes = slurp(image);
  std::string flipped = bytes;
  flipped[3] ^= 1;
  folder_.write("s/frames/000001-right.png", flipped);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("000001-right.png: has another SHA-256")));
  folder_.write("s/frames/000001-right.png", bytes + "x");
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("bytes instead of")));
  fs::remove(image);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("000001-right.png: cannot be read")));
  folder_.write("elsewhere.png", bytes);
  fs::create_symlink(folder_ / "elsewhere.png", image);
  EXPECT_THAT(problems(), SizeIs(1)) << "a link out of the session";
  fs::remove(image);
  ASSERT_EQ(mkfifo(image.c_str(), 0600), 0);
  EXPECT_THAT(problems(), SizeIs(1)) << "a pipe must not hang";
}

TEST_F(SessionVerifyTest, SeesAHeaderThatWasChanged) {
  std::string json = slurp(session_ / "session.json");
  json.replace(json.find("0.21"), 4, "0.22");
  folder_.write("s/session.json", json);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("session.json: was changed")));
}

TEST_F(SessionVerifyTest, SeesTheJournalOfAnotherSession) {
  std::string json = slurp(session_ / "session.json");
  json.replace(json.find("knit-1\""), 7, "knit-2\"");
  folder_.write("s/session.json", json);
  EXPECT_THAT(problems(), testing::Contains(HasSubstr("belongs to session '20261124-knit-1'")));
  EXPECT_THAT(SessionWriter::resume(session_).error().message(), HasSubstr("belongs to session"));
}

TEST_F(SessionVerifyTest, ATornTailIsCountedAndIsNoProblem) {
  const auto size = fs::file_size(session_ / "journal.jsonl");
  const auto records = verifySession(session_)->records;
  fs::resize_file(session_ / "journal.jsonl", size - 20);
  const auto report = verifySession(session_).value();
  EXPECT_THAT(report.problems, IsEmpty());
  EXPECT_EQ(report.records, records - 1);
  EXPECT_EQ(report.cut_records, 1u);
  EXPECT_GT(report.cut_bytes, 20u);
  EXPECT_FALSE(report.closed);
  EXPECT_EQ(readAll(session_).size(), records - 1);
}

TEST_F(SessionVerifyTest, BlocksThatNeverReachedTheDiskAreATornTail) {
  rewriteJournal([](std::string& j, const auto&) { j += std::string(5000, '\0') + "\nrest"; });
  const auto report = verifySession(session_).value();
  EXPECT_THAT(report.problems, IsEmpty());
  EXPECT_EQ(report.cut_bytes, 5005u);
}

TEST_F(SessionVerifyTest, AWholeLastLineThatIsWrongIsAProblem) {
  rewriteJournal([](std::string& j, const auto&) { j[j.size() - 20] ^= 1; });
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("its CRC does not fit")));
}

TEST_F(SessionVerifyTest, AFileWithoutARecordIsCounted) {
  folder_.write("s/frames/000002-left.png.part", "half");
  const auto report = verifySession(session_).value();
  EXPECT_THAT(report.problems, IsEmpty());
  EXPECT_EQ(report.stray_files, 1u);
}

TEST_F(SessionVerifyTest, ListsAThousandProblemsAndThenHowManyMore) {
  std::string journal = slurp(session_ / "journal.jsonl");
  for (int i = 0; i < 1500; ++i) journal += "rubbish\n";
  folder_.write("s/journal.jsonl", journal + slurp(session_ / "journal.jsonl"));
  const auto found = problems();
  ASSERT_THAT(found, SizeIs(1001));
  EXPECT_THAT(found.back(), HasSubstr("more"));
}

TEST_F(SessionVerifyTest, WhatIsNoSessionIsAnError) {
  EXPECT_FALSE(verifySession(folder_ / "absent").ok());
  fs::remove(session_ / "journal.jsonl");
  EXPECT_THAT(verifySession(session_).error().message(), HasSubstr("journal.jsonl"));
  fs::create_directory(session_ / "journal.jsonl");
  EXPECT_FALSE(verifySession(session_).ok());
  EXPECT_FALSE(SessionWriter::resume(session_).ok());
}

}  // namespace
}  // namespace tenter
