// SPDX-License-Identifier: GPL-3.0-or-later
// Kills and torn tails, at moments and places drawn at random. TENTER_SESSION_TRIALS sets how many
// of each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "journal_line.h"
#include "record_codec.h"
#include "session_samples.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::header;
using session_samples::Images;
using session_samples::readAll;
using session_samples::sample;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::IsEmpty;

using Random = std::mt19937_64;

int trials(int fallback) {
  const char* text = std::getenv("TENTER_SESSION_TRIALS");
  int count = 0;
  if (text == nullptr) return fallback;
  std::from_chars(text, text + std::char_traits<char>::length(text), count);
  return count > 0 ? count : fallback;
}

std::size_t below(Random& random, std::size_t limit) {
  return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
}

/// What the killed writer puts under a sequence number, as far as that is a sample or decision.
RecordBody bodyFor(const SessionHeader& h, std::uint64_t sequence) {
  if (sequence % 16 == 0) return Decision{"d", R"({"n":)" + std::to_string(sequence) + "}"};
  return sample(h, static_cast<int>(sequence));
}

/// Shared with the child: how many records were acknowledged before it was killed.
class Acknowledged {
 public:
  Acknowledged()
      : page_(mmap(nullptr, sizeof(Counter), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1,
                   0)) {
    if (page_ == MAP_FAILED) throw std::runtime_error("cannot map a page");
    new (page_) Counter(0);
  }
  ~Acknowledged() { munmap(page_, sizeof(Counter)); }
  Acknowledged(const Acknowledged&) = delete;
  Acknowledged& operator=(const Acknowledged&) = delete;
  std::atomic<std::uint64_t>& count() { return *static_cast<Counter*>(page_); }

 private:
  using Counter = std::atomic<std::uint64_t>;
  void* page_;
};

/// Writes until it is killed.
[[noreturn]] void writeForEver(const fs::path& session, std::atomic<std::uint64_t>& acknowledged) {
  std::unique_ptr<SessionWriter> writer;
  if (fs::exists(session)) {
    writer = std::move(std::move(SessionWriter::resume(session)).value().writer);
  } else {
    writer = std::move(SessionWriter::create(session, header())).value();
  }
  acknowledged = writer->records();
  for (int i = 0;; ++i) {
    const std::uint64_t sequence = writer->records();
    const auto time_ns = static_cast<std::int64_t>(sequence);
    if (i % 40 == 20) {
      writer->addFrame(time_ns, Images(i).list).value();
    } else {
      writer->append(time_ns, bodyFor(writer->header(), sequence)).value();
    }
    acknowledged = sequence + 1;
    if (i % 10 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

void killWhileWriting(const fs::path& session, std::chrono::microseconds after,
                      std::atomic<std::uint64_t>& acknowledged) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    try {
      writeForEver(session, acknowledged);
    } catch (...) {
      _exit(1);
    }
  }
  std::this_thread::sleep_for(after);
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself with " << WEXITSTATUS(status);
}

/// Every record up to `acknowledged` is there as it was written.
void expectAllThere(const fs::path& session, std::uint64_t acknowledged) {
  const auto records = readAll(session);
  ASSERT_GE(records.size(), acknowledged);
  const SessionHeader h = header();
  for (const JournalRecord& record : records) {
    const bool ours = std::holds_alternative<SampleRecord>(record.body) ||
                      std::holds_alternative<Decision>(record.body);
    if (!ours) continue;
    const auto expected =
        encodeRecord(static_cast<std::int64_t>(record.sequence), bodyFor(h, record.sequence), h);
    ASSERT_EQ(record.text, withSequence(record.sequence, *expected));
  }
}

TEST(SessionTrialsTest, KilledWritersLoseNothingThatWasAcknowledged) {
  constexpr int kKillsOfOneSession = 8;
  constexpr std::size_t kLatestKill_us = 60'000;
  Random random(20261124);
  Acknowledged acknowledged;
  std::unique_ptr<TemporaryFolder> folder;
  for (int trial = 0; trial < trials(20); ++trial) {
    SCOPED_TRACE(trial);
    if (trial % kKillsOfOneSession == 0) {
      folder = std::make_unique<TemporaryFolder>();
      acknowledged.count() = 0;
    }
    const fs::path session = *folder / "s";
    killWhileWriting(session, std::chrono::microseconds(below(random, kLatestKill_us)),
                     acknowledged.count());
    if (HasFatalFailure()) return;
    if (!fs::exists(session)) {
      EXPECT_EQ(acknowledged.count(), 0u);
      continue;
    }
    const auto torn = verifySession(session);
    ASSERT_TRUE(torn.ok()) << torn.error().message();
    EXPECT_THAT(torn->problems, IsEmpty());
    expectAllThere(session, acknowledged.count());
    // Every other time the next writer itself finds the session as the kill left it.
    if (trial % 2 == 0) continue;
    const auto repair = SessionWriter::repair(session);
    ASSERT_TRUE(repair.ok()) << repair.error().message();
    const auto whole = verifySession(session);
    EXPECT_THAT(whole->problems, IsEmpty());
    EXPECT_EQ(whole->stray_files, 0u);
    expectAllThere(session, acknowledged.count());
  }
}

/// The journal of a closed session, and where its lines begin and end.
class TornTailTrialsTest : public testing::Test {
 protected:
  void SetUp() override {
    session_samples::writeSession(session_, 40);
    journal_ = slurp(session_ / "journal.jsonl");
    for (std::size_t i = 0; i < journal_.size(); ++i) {
      if (journal_[i] == '\n') ends_.push_back(i + 1);
    }
  }

  void putJournal(const std::string& bytes) {
    fs::remove_all(session_ / "repairs");
    folder_.write("s/journal.jsonl", bytes);
    // Records of frames may be torn away; their images must not disturb the next trial.
    fs::remove_all(session_ / "frames");
    fs::create_directory(session_ / "frames");
  }

  /// Opens, goes on with one record, closes.
  void resumeAndClose() {
    auto resumed = SessionWriter::resume(session_);
    ASSERT_TRUE(resumed.ok()) << resumed.error().message();
    SessionWriter& writer = *resumed->writer;
    ASSERT_TRUE(writer.append(writer.lastTime_ns(), sample(writer.header(), 1)).ok());
    ASSERT_TRUE(writer.close(writer.lastTime_ns()).ok());
    EXPECT_EQ(SessionWriter::repair(session_)->cut_bytes, 0u) << "was not whole afterwards";
  }

  /// Problems other than the images that putJournal took away.
  std::vector<std::string> journalProblems() {
    std::vector<std::string> problems = verifySession(session_).value().problems;
    std::erase_if(problems, [](const std::string& p) { return p.starts_with("frames/"); });
    return problems;
  }

  std::set<std::string> goodLines() {
    std::set<std::string> good;
    std::istringstream in(slurp(session_ / "journal.jsonl"));
    for (std::string line; std::getline(in, line);) {
      if (unsealed(line)) good.insert(line);
    }
    return good;
  }

  TemporaryFolder folder_;
  fs::path session_ = folder_ / "s";
  std::string journal_;
  std::vector<std::size_t> ends_;
};

TEST_F(TornTailTrialsTest, ATailCutAnywhereLosesOnlyTheRecordBeingWritten) {
  Random random(1);
  for (int trial = 0; trial < trials(15); ++trial) {
    SCOPED_TRACE(trial);
    const std::size_t size = below(random, journal_.size() + 1);
    putJournal(journal_.substr(0, size));
    resumeAndClose();
    EXPECT_THAT(journalProblems(), IsEmpty());
    const auto next_end = std::upper_bound(ends_.begin(), ends_.end(), size);
    const std::size_t whole = next_end == ends_.begin() ? 0 : *(next_end - 1);
    EXPECT_EQ(slurp(session_ / "journal.jsonl").substr(0, whole), journal_.substr(0, whole));
  }
}

/// What a power cut makes of bytes that were not synced: some blocks old, some empty, some missing.
std::string spoilBehind(const std::string& journal, std::size_t committed, Random& random) {
  std::string spoilt = journal.substr(0, committed + below(random, journal.size() - committed + 1));
  const std::size_t uncommitted = spoilt.size() - committed;
  if (uncommitted == 0) return spoilt + std::string(below(random, 5000), '\0');
  const std::size_t begin = committed + below(random, uncommitted);
  const std::size_t count = 1 + below(random, spoilt.size() - begin);
  const bool empty = below(random, 2) == 0;
  for (std::size_t i = begin; i < begin + count; ++i) {
    spoilt[i] = empty ? '\0' : static_cast<char>(below(random, 256));
  }
  return spoilt;
}

TEST_F(TornTailTrialsTest, WhateverHappensBehindACommitTheCommittedStays) {
  Random random(2);
  for (int trial = 0; trial < trials(15); ++trial) {
    SCOPED_TRACE(trial);
    const std::size_t committed = ends_[below(random, ends_.size())];
    putJournal(spoilBehind(journal_, committed, random));
    resumeAndClose();
    EXPECT_EQ(slurp(session_ / "journal.jsonl").substr(0, committed),
              journal_.substr(0, committed));
  }
}

TEST_F(TornTailTrialsTest, BytesThatChangeInTheTailCostOnlyTheLinesTheyAreIn) {
  constexpr std::size_t kTail_bytes = 1200;
  Random random(3);
  for (int trial = 0; trial < trials(15); ++trial) {
    SCOPED_TRACE(trial);
    std::string spoilt = journal_;
    for (std::size_t flips = 1 + below(random, 4); flips > 0; --flips) {
      const std::size_t at = journal_.size() - 1 - below(random, kTail_bytes);
      spoilt[at] = static_cast<char>(spoilt[at] ^ (1 << below(random, 8)));
    }
    std::set<std::string> untouched;
    for (std::size_t i = 0, begin = 0; i < ends_.size(); begin = ends_[i++]) {
      // With the line end before it gone, a line is part of the one before.
      const std::size_t from = begin == 0 ? 0 : begin - 1;
      const std::string line = journal_.substr(from, ends_[i] - from);
      if (spoilt.compare(from, line.size(), line) == 0) {
        untouched.insert(journal_.substr(begin, ends_[i] - begin - 1));
      }
    }
    putJournal(spoilt);
    resumeAndClose();
    const std::set<std::string> good = goodLines();
    EXPECT_TRUE(std::includes(good.begin(), good.end(), untouched.begin(), untouched.end()));
  }
}

}  // namespace
}  // namespace tenter
