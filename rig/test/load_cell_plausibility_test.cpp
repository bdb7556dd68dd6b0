// SPDX-License-Identifier: GPL-3.0-or-later
#include "load_cell_plausibility.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

namespace tenter {
namespace {

using Fault = LoadCellFault;

constexpr std::int64_t kScan_ns = 5'000'000;
constexpr int kProbation = 10;  // samples

class PlausibilityTest : public testing::Test {
 protected:
  PlausibilityTest() : plausibility_(config()) {}

  static LoadCellConfig config() {
    LoadCellConfig config;
    config.capacity_N = 50.0;
    config.lowest_N = -0.5;
    config.stuck_after = std::chrono::milliseconds(100);
    return config;
  }

  /// As a float amplifier sends it, every time with other bits.
  Fault see(double gross_N) {
    DecodedWeights weights;
    weights.gross_N = gross_N;
    weights.raw_gross = ++raw_;
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(gross_N));
    weights.swapped_gross_N = std::bit_cast<float>(bits << 16 | bits >> 16);
    return judge(weights);
  }
  Fault judge(const DecodedWeights& weights) {
    time_ns_ += kScan_ns;
    return plausibility_.judge(weights, time_ns_);
  }
  void believe(double gross_N) {
    for (int i = 1; i < kProbation; ++i) ASSERT_EQ(see(gross_N), Fault::kProbation);
    ASSERT_EQ(see(gross_N), Fault::kNone);
  }

  LoadCellPlausibility plausibility_;
  std::int64_t time_ns_ = 0;
  std::uint64_t raw_ = 0;
};

TEST_F(PlausibilityTest, TheFirstReadingsAreNotTrusted) {
  believe(1.0);
  EXPECT_EQ(see(1.0), Fault::kNone);
}

TEST_F(PlausibilityTest, ProbationBeginsAgainWhereReadingsDiffer) {
  for (int i = 0; i < 5; ++i) EXPECT_EQ(see(1.0), Fault::kProbation);
  believe(4.0);
}

TEST_F(PlausibilityTest, AFlippedSignIsNamedAndProbationFollows) {
  believe(3.0);
  EXPECT_EQ(see(-3.01), Fault::kSignFlip);
  EXPECT_EQ(see(3.0), Fault::kProbation);
  EXPECT_EQ(see(-0.51), Fault::kSignFlip);  // no cord pushes so hard
  believe(3.0);
}

TEST_F(PlausibilityTest, AFlippedSignStaysOneWhileTheCordIsLetOut) {
  believe(1.5);
  for (double tension_N = 1.5; tension_N > 0.06; tension_N -= 0.01)
    ASSERT_EQ(see(-tension_N), Fault::kSignFlip) << tension_N;
  for (int i = 0; i < 30; ++i) ASSERT_EQ(see(-0.3), Fault::kSignFlip);
  believe(0.3);
}

TEST_F(PlausibilityTest, AFlippedSignIsSeenThoughTheLoadMovesBetweenReadings) {
  for (const double now_N : {0.4, 0.7, 1.5, 2.5}) {
    plausibility_ = LoadCellPlausibility(config());
    believe(1.0);
    EXPECT_EQ(see(-now_N), Fault::kSignFlip) << now_N;
  }
}

TEST_F(PlausibilityTest, AZeroThatHasDriftedIsReachedStepByStep) {
  believe(0.4);
  for (double tension_N = 0.36; tension_N > -0.4; tension_N -= 0.05)
    ASSERT_EQ(see(tension_N), Fault::kNone) << tension_N;
}

TEST_F(PlausibilityTest, ACordThatGrowsTautFromAReadingBelowZeroIsBelieved) {
  for (const double slack_N : {-0.005, -0.012, -0.024}) {
    for (const double taut_N : {0.045, 0.05, 0.055, 0.06, 0.07}) {
      plausibility_ = LoadCellPlausibility(config());
      believe(slack_N);
      EXPECT_EQ(see(taut_N), Fault::kNone) << slack_N << " to " << taut_N;
    }
  }
  // What a zero that has drifted reads when it is slack is still told from its mirror image.
  plausibility_ = LoadCellPlausibility(config());
  believe(-0.1);
  EXPECT_EQ(see(0.1), Fault::kSignFlip);
}

TEST_F(PlausibilityTest, ALoadThatJumpsIsBelieved) {
  believe(1.0);
  EXPECT_EQ(see(30.0), Fault::kNone);
  EXPECT_EQ(see(0.0), Fault::kNone);
  EXPECT_EQ(see(-0.1), Fault::kNone);
  EXPECT_EQ(see(50.1), Fault::kOverRange);
}

TEST_F(PlausibilityTest, SwappedWordsAreNamedWhateverTheyMakeOfTheNumber) {
  believe(3.2);
  int refused = 0;
  for (int i = 0; i < 1000; ++i) {
    const double truth_N = 3.2 + 1e-5 * i;
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(truth_N));
    DecodedWeights weights;
    weights.raw_gross = ++raw_;
    weights.gross_N = std::bit_cast<float>(bits << 16 | bits >> 16);
    weights.swapped_gross_N = truth_N;
    if (!std::isfinite(weights.gross_N)) continue;  // decoding names it
    const Fault fault = judge(weights);
    EXPECT_NE(fault, Fault::kNone) << weights.gross_N << " N for " << truth_N;
    ++refused;
  }
  EXPECT_GT(refused, 900);
}

TEST_F(PlausibilityTest, WordsThatAreExchangedFromTheBeginningNeverPassProbation) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise_N(0.0, 0.003);
  int in_range = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double truth_N = 3.2 + noise_N(random);
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(truth_N));
    const double wrong_N = std::bit_cast<float>(bits << 16 | bits >> 16);
    if (!std::isfinite(wrong_N)) continue;
    const Fault fault = see(wrong_N);
    EXPECT_NE(fault, Fault::kNone) << wrong_N;
    in_range += fault == Fault::kProbation;
  }
  EXPECT_GT(in_range, 500);  // which is why one good reading is not enough
}

TEST_F(PlausibilityTest, TooSmallToBeAWeightIsTheSameTrouble) {
  EXPECT_EQ(see(1e-20), Fault::kWordOrder);
  EXPECT_EQ(see(0.0), Fault::kProbation);
}

TEST_F(PlausibilityTest, BitsThatNeverMoveAreStuck) {
  believe(2.0);
  DecodedWeights still;
  still.gross_N = 2.0;
  still.swapped_gross_N = std::nan("");
  still.raw_gross = 1'000'000;
  int good = 0;
  while (judge(still) == Fault::kNone) ++good;
  EXPECT_EQ(good, 20);  // 100 ms of 5 ms each
  EXPECT_EQ(judge(still), Fault::kStuck);
  still.raw_gross += 1;
  EXPECT_EQ(judge(still), Fault::kNone);
}

TEST(ReversedPlausibilityTest, JudgesTensionNotTheAmplifiersSign) {
  LoadCellConfig config;
  config.capacity_N = 50.0;
  config.lowest_N = -0.5;
  config.reversed = true;
  LoadCellPlausibility plausibility(config);
  DecodedWeights weights;
  weights.swapped_gross_N = std::nan("");
  weights.gross_N = -3.0;
  EXPECT_EQ(plausibility.judge(weights, 1), Fault::kProbation);
  weights.gross_N = 3.0;
  EXPECT_EQ(plausibility.judge(weights, 2), Fault::kSignFlip);
}

}  // namespace
}  // namespace tenter
