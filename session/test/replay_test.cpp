// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "session_samples.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::header;
using session_samples::sample;
using session_samples::timeOf;
using session_samples::writeSession;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::HasSubstr;

/// Remembers what it was told.
class Listener : public RecordConsumer {
 public:
  Result<void> begin(const SessionHeader& header) override {
    calls.push_back("begin " + header.id);
    return {};
  }
  Result<void> consume(const JournalRecord& record) override {
    sequences.push_back(record.sequence);
    if (record.sequence == refuse) return notConverged("has seen enough");
    return {};
  }
  Result<void> end() override {
    calls.emplace_back("end");
    return {};
  }
  std::vector<std::string> calls;
  std::vector<std::uint64_t> sequences;
  std::uint64_t refuse = UINT64_MAX;
};

TEST(ReplayTest, FeedsEveryRecordInOrderBetweenBeginAndEnd) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  Listener listener;
  const auto summary = replaySession(folder / "s", {}, listener);
  ASSERT_TRUE(summary.ok()) << summary.error().message();
  EXPECT_EQ(summary->records, 33u);
  EXPECT_EQ(summary->recorded_ns, timeOf(20));
  EXPECT_THAT(listener.calls, testing::ElementsAre("begin " + header().id, "end"));
  ASSERT_EQ(listener.sequences.size(), 33u);
  for (std::size_t i = 0; i < 33; ++i) EXPECT_EQ(listener.sequences[i], i);
}

TEST(ReplayTest, TheConsumersErrorEndsIt) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  Listener listener;
  listener.refuse = 4;
  const auto summary = replaySession(folder / "s", {}, listener);
  ASSERT_FALSE(summary.ok());
  EXPECT_THAT(summary.error().message(), HasSubstr("has seen enough"));
  EXPECT_EQ(listener.sequences.size(), 5u);
  EXPECT_EQ(listener.calls.size(), 1u);
}

TEST(ReplayTest, KeepsThePaceItIsAskedFor) {
  const TemporaryFolder folder;
  writeSession(folder / "s", 100);  // Half a second.
  Listener listener;
  ReplayOptions options;
  options.speed = 5.0;
  const auto summary = replaySession(folder / "s", options, listener);
  ASSERT_TRUE(summary.ok());
  EXPECT_GE(summary->wall_s, 0.1);
  options.speed = 1e6;
  const auto quick = replaySession(folder / "s", options, listener);
  EXPECT_LT(quick->wall_s, 0.4) << "half a microsecond was asked for";
}

TEST(ReplayTest, AnInterruptIsAnsweredHoweverSlowTheReplay) {
  const TemporaryFolder folder;
  writeSession(folder / "s", 100);
  Listener listener;
  ReplayOptions options;
  options.speed = 1e-6;
  int asked = 0;
  options.interrupted = [&] { return ++asked > 3; };
  const auto summary = replaySession(folder / "s", options, listener);
  ASSERT_TRUE(summary.ok());
  EXPECT_TRUE(summary->interrupted);
  EXPECT_EQ(listener.calls.size(), 1u) << "end() is not called";
}

TEST(ReplayTest, LeavesATornTailOutAndRefusesDamage) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  const std::string whole = slurp(folder / "s/journal.jsonl");
  folder.write("s/journal.jsonl", whole + "torn");
  Listener listener;
  EXPECT_EQ(replaySession(folder / "s", {}, listener)->cut_bytes, 4u);
  std::string damaged = whole;
  damaged[whole.size() / 2] ^= 1;
  folder.write("s/journal.jsonl", damaged);
  const auto summary = replaySession(folder / "s", {}, listener);
  ASSERT_FALSE(summary.ok());
  EXPECT_THAT(summary.error().message(), HasSubstr("is damaged"));
}

TEST(EventLogTest, HoldsEventsByteForByteAndNothingElse) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  EventLog log;
  ASSERT_TRUE(replaySession(folder / "s", {}, log).ok());
  std::vector<std::string> lines;
  std::istringstream in(log.text());
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 7u);
  EXPECT_EQ(log.lines(), 7u);
  EXPECT_THAT(lines[0], HasSubstr(R"("what":"begin")"));
  EXPECT_EQ(lines[2], R"({"time_ns":100000000,"kind":"event","event":"state","from":"Ready",)"
                      R"("to":"Running","reason":"operator"})");
  EXPECT_THAT(lines[4],
              HasSubstr(R"("data":{ "axis" : 3,"v_m_per_s":1.50e-3, "why":"a } \" \u00e9"}})"));
  EXPECT_THAT(lines[6], HasSubstr(R"("what":"closed")"));
}

/// The log of a session with `samples` samples between its two decisions.
std::string logWith(int samples) {
  const TemporaryFolder folder;
  const SessionHeader h = header();
  const auto writer = std::move(SessionWriter::create(folder / "s", h)).value();
  writer->append(0, Decision{"first", "{}"}).value();
  for (int i = 0; i < samples; ++i) writer->append(timeOf(i), sample(h, i)).value();
  writer->append(timeOf(50), Decision{"second", R"({"v":1e-3})"}).value();
  EventLog log;
  EXPECT_TRUE(replaySession(folder / "s", {}, log).ok());
  return log.text();
}

TEST(EventLogTest, DoesNotDependOnHowManySamplesLieBetween) { EXPECT_EQ(logWith(3), logWith(40)); }

}  // namespace
}  // namespace tenter
