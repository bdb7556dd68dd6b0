// SPDX-License-Identifier: GPL-3.0-or-later
#include "journal_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "session_format.h"

namespace tenter {
namespace {

using testing::HasSubstr;

/// A source that hands out at most `step` bytes at a time.
JournalScanner::Source sourceOf(std::string bytes, std::size_t step) {
  return [bytes = std::move(bytes), step, at = std::size_t{0}](
             char* buffer, std::size_t size) mutable -> Result<std::size_t> {
    const std::size_t count = std::min({step, size, bytes.size() - at});
    std::copy_n(bytes.data() + at, count, buffer);
    at += count;
    return count;
  };
}

std::vector<JournalLine> linesOf(const std::string& bytes, std::size_t step = 1 << 16) {
  JournalScanner scanner(sourceOf(bytes, step));
  std::vector<JournalLine> lines;
  while (auto line = scanner.next().value()) lines.push_back(*line);
  return lines;
}

std::string sealed(std::string_view json) {
  std::string line;
  appendSealed(line, json);
  return line;
}

TEST(JournalLineTest, TheCrcIsZlibs) {
  // The check value of CRC-32/ISO-HDLC.
  EXPECT_EQ(crc32Of("123456789"), 0xcbf43926u);
  EXPECT_EQ(sealed("123456789"), "123456789\tcbf43926\n");
}

TEST(JournalLineTest, EveryFlippedBitIsSeen) {
  const std::string line = sealed(R"({"seq":0})");
  ASSERT_TRUE(linesOf(line)[0].good);
  // The line end is left out: without it the line is still whole.
  for (std::size_t bit = 0; bit < 8 * (line.size() - 1); ++bit) {
    std::string damaged = line;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    for (const JournalLine& found : linesOf(damaged)) EXPECT_FALSE(found.good) << bit;
  }
}

TEST(JournalLineTest, UpperCaseAndOtherSpellingsOfTheCrcAreDamage) {
  EXPECT_FALSE(unsealed("123456789\tCBF43926").has_value());
  EXPECT_FALSE(unsealed("123456789\t0xbf4392").has_value());
  EXPECT_FALSE(unsealed("123456789 cbf43926").has_value());
  EXPECT_FALSE(unsealed("\t00000000").has_value());
  EXPECT_FALSE(unsealed("").has_value());
}

TEST(JournalScannerTest, CutsAtLineEndsWhateverTheSteps) {
  const std::string first = sealed(R"({"a":1})"), second = sealed(R"({"b":2})");
  const std::string bytes = first + "rubbish\n" + second + "torn";
  for (const std::size_t step : {std::size_t{1}, std::size_t{3}, bytes.size()}) {
    const auto lines = linesOf(bytes, step);
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_EQ(lines[0].json, R"({"a":1})");
    EXPECT_FALSE(lines[1].good);
    EXPECT_TRUE(lines[2].good);
    EXPECT_EQ(lines[2].number, 3u);
    EXPECT_EQ(lines[2].offset_bytes, first.size() + 8);
    EXPECT_EQ(lines[2].size_bytes, second.size());
    EXPECT_FALSE(lines[3].good);
    EXPECT_FALSE(lines[3].has_line_end);
  }
}

TEST(JournalScannerTest, ALineThatLacksNothingButItsEndIsGood) {
  std::string line = sealed("{}");
  line.pop_back();
  const auto lines = linesOf(line);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(lines[0].good);
  EXPECT_FALSE(lines[0].has_line_end);
}

TEST(JournalScannerTest, EndlessLinesAreSkippedInLittleMemory) {
  std::string endless(3 * session_format::kMaxLine_bytes, 'x');
  endless[endless.size() / 2] = '\0';
  const auto lines = linesOf(endless + "\n" + sealed("{}"));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_FALSE(lines[0].good);
  EXPECT_TRUE(lines[0].has_nul);
  EXPECT_EQ(lines[0].size_bytes, endless.size() + 1);
  EXPECT_EQ(lines[1].offset_bytes, endless.size() + 1);
  EXPECT_TRUE(lines[1].good);
}

TEST(JournalScannerTest, AValidLineAboveTheLimitIsRefused) {
  const std::string json(session_format::kMaxLine_bytes, 'x');
  EXPECT_FALSE(linesOf(sealed(json))[0].good);
}

TEST(JournalScannerTest, NothingHasNoLines) { EXPECT_TRUE(linesOf("").empty()); }

TEST(JournalScannerTest, ErrorsOfTheDiskComeThrough) {
  JournalScanner scanner([](char*, std::size_t) -> Result<std::size_t> {
    return badInput("journal.jsonl", "", "input/output error");
  });
  EXPECT_THAT(scanner.next().error().message(), HasSubstr("input/output error"));
}

}  // namespace
}  // namespace tenter
