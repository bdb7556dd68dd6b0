// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/cord_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tenter/calib/cord_friction.h"
#include "tenter/core/json_reader.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using testing::HasSubstr;

constexpr double kFriction_N = 0.05, kPresliding_m = 1e-4, kNoise_N = 3e-3;
constexpr double kTick_s = 0.02;

/// A cord over a pulley between an axis and a spring or a held end.
class SimulatedCord {
 public:
  explicit SimulatedCord(std::uint64_t seed) : random_(seed) {}

  /// The axis goes on by dx, and the cord's other end lets in what does not stretch it.
  void sample(double position_m, double tension_N, double drawn_m) {
    friction_.follow(drawn_m);
    const double friction_N = kFriction_N * friction_.share();
    const double felt_N = std::max(0.0, tension_N + friction_N) + noise_(random_);
    record.positions_m.push_back(position_m);
    record.tensions_N.push_back(felt_N);
    truth_N.push_back(tension_N);
  }

  CordRecord record{"axis-3", "cell-3", {}, {}};
  std::vector<double> truth_N;

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> noise_{0.0, kNoise_N};
  PulleyFriction friction_{kPresliding_m, -1.0};
};

/// In and out and in again, at a millimetre a second.
std::vector<double> triangle(double low_m, double high_m, int cycles) {
  std::vector<double> way;
  const double step_m = 1e-3 * kTick_s;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    for (double x = low_m; x < high_m; x += step_m) way.push_back(x);
    for (double x = high_m; x > low_m; x -= step_m) way.push_back(x);
  }
  return way;
}

CordRecord onSpring(double spring_N_per_m, std::uint64_t seed) {
  SimulatedCord cord(seed);
  double before_m = 0.0;
  for (const double x : triangle(0.0, 0.02, 2)) {
    cord.sample(x, std::max(0.0, spring_N_per_m * (x - 0.004)), x - before_m);
    before_m = x;
  }
  return cord.record;
}

CordRecord heldEnd(double stiffness_N_per_m, std::uint64_t seed) {
  SimulatedCord cord(seed);
  for (const double x : triangle(0.0, 1.5 / stiffness_N_per_m, 1)) {
    cord.sample(x, stiffness_N_per_m * x, 0.0);
  }
  return cord.record;
}

TEST(CordCalibrationTest, RecoversFrictionPreslidingAndSpring) {
  const auto fit = fitCordFriction(onSpring(60.0, 1));
  ASSERT_TRUE(fit.ok()) << fit.error().message();
  // Of 2,000 readings with 3 mN; the presliding shows only where the way turns round.
  EXPECT_NEAR(fit->friction_N, kFriction_N, 5e-4);
  EXPECT_NEAR(fit->friction_N, kFriction_N, 5.0 * fit->friction_sigma_N);
  EXPECT_NEAR(fit->presliding_m, kPresliding_m, 0.2 * kPresliding_m);
  EXPECT_NEAR(fit->spring_N_per_m, 60.0, 0.1);
  EXPECT_NEAR(fit->rms_N, kNoise_N, 0.1 * kNoise_N);
}

TEST(CordCalibrationTest, RecoversTheStretchOfAHeldCord) {
  const auto fit = fitCordStretch(heldEnd(500.0, 2));
  ASSERT_TRUE(fit.ok()) << fit.error().message();
  EXPECT_NEAR(fit->stiffness_N_per_m, 500.0, 5.0);
}

TEST(CordCalibrationTest, RefusesRecordsThatCannotTell) {
  CordRecord one_way = onSpring(60.0, 3);
  const auto top = std::max_element(one_way.positions_m.begin(), one_way.positions_m.end());
  const auto size = static_cast<std::size_t>(top - one_way.positions_m.begin());
  one_way.positions_m.resize(size);
  one_way.tensions_N.resize(size);
  EXPECT_FALSE(fitCordFriction(one_way).ok());
  const auto slack = fitCordFriction(onSpring(0.0, 4));
  ASSERT_FALSE(slack.ok());
  EXPECT_THAT(slack.error().message(), HasSubstr("too few readings under tension"));
  const auto still = calibrateCords({{"axis-1", "cell-1", {0.0, 0.0}, {0.1, 0.1}}}, {}, {});
  ASSERT_FALSE(still.ok());
  EXPECT_THAT(still.error().message(), HasSubstr("no cord was moved"));
}

TEST(CordCalibrationTest, RejectsACordThatFitsNoSpring) {
  CordRecord record = onSpring(60.0, 5);
  for (std::size_t i = 0; i < record.tensions_N.size(); ++i) {
    record.tensions_N[i] += 0.1 * std::sin(1e3 * record.positions_m[i]);
  }
  const auto calibration = calibrateCords({record}, {}, {});
  ASSERT_TRUE(calibration.ok());
  EXPECT_FALSE(calibration->accepted);
  EXPECT_THAT(calibration->reasons.at(0), HasSubstr("axis-3: the friction fits to"));
}

TEST(CordCalibrationTest, SurvivesTheFileAndRefusesAnEditedOne) {
  const test_support::TemporaryFolder folder;
  const auto calibration = calibrateCords({onSpring(60.0, 6)}, {heldEnd(500.0, 7)}, {"bench 2"});
  ASSERT_TRUE(calibration.ok());
  EXPECT_TRUE(calibration->accepted) << calibration->reasons.at(0);
  ASSERT_TRUE(writeCordCalibration(folder / "cords.json", *calibration).ok());
  const auto read = readCordCalibration(folder / "cords.json");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->id, calibration->id);
  EXPECT_EQ(read->find("axis-3")->friction->friction_N,
            calibration->find("axis-3")->friction->friction_N);
  EXPECT_EQ(read->find("axis-4"), nullptr);
  EXPECT_THAT(test_support::schemaErrors(
                  *readJsonFile(folder / "cords.json"),
                  test_support::sourceFolder() / "docs/formats/cord-calibration.schema.json"),
              testing::IsEmpty());
  std::string text = test_support::slurp(folder / "cords.json");
  text.replace(text.find("bench 2"), 7, "bench 3");
  folder.write("cords.json", text);
  const auto edited = readCordCalibration(folder / "cords.json");
  ASSERT_FALSE(edited.ok());
  EXPECT_THAT(edited.error().message(), HasSubstr("is not that of the content"));
}

/// A cord whose axis stands while its end is moved to and fro by others: the axis' travel sees
/// nothing of the friction, the cord's stretch does.
SimulatedCord movedByOthers(double stiffness_N_per_m, std::uint64_t seed) {
  SimulatedCord cord(seed);
  const double way_m = std::min(2e-3, 0.4 / stiffness_N_per_m);
  double end_before_m = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double end_m = way_m * std::sin(2.0 * M_PI * std::max(0, i - 250) / 2000.0);
    cord.sample(0.01, 0.6 + stiffness_N_per_m * end_m, end_before_m - end_m);
    end_before_m = end_m;
  }
  return cord;
}

double rms_N(const SimulatedCord& cord, const std::vector<double>& friction_N) {
  double squares = 0.0;
  for (std::size_t i = 0; i < friction_N.size(); ++i) {
    const double error_N = cord.record.tensions_N[i] - friction_N[i] - cord.truth_N[i];
    squares += error_N * error_N;
  }
  return std::sqrt(squares / static_cast<double>(friction_N.size()));
}

class FrictionAlongTest : public testing::TestWithParam<double> {};

TEST_P(FrictionAlongTest, FindsWhatTheAxisTravelCannotSee) {
  const SimulatedCord cord = movedByOthers(GetParam(), 8);
  CordEntry entry{"axis-3", "cell-3", CordFrictionFit{}, std::nullopt};
  entry.friction->friction_N = kFriction_N;
  entry.friction->presliding_m = kPresliding_m;
  const double by_travel_N =
      rms_N(cord, frictionAlong(entry, cord.record.positions_m, cord.record.tensions_N));
  entry.stretch = CordStretchFit{};
  entry.stretch->stiffness_N_per_m = GetParam();
  const double by_stretch_N =
      rms_N(cord, frictionAlong(entry, cord.record.positions_m, cord.record.tensions_N));
  EXPECT_GT(by_travel_N, 0.04) << "as much as there is friction";
  EXPECT_LT(by_stretch_N, 12e-3) << "four times the noise of the cell";
}

/// As soft as a rubber cord, and as stiff as those of the virtual rig. (A cord of 3000 N/m and a
/// way of a tenth of a millimetre leaves 8 mN.)
INSTANTIATE_TEST_SUITE_P(Cords, FrictionAlongTest, testing::Values(21.0, 200.0, 500.0));

TEST(FrictionAlongTest, AgreesWithTheTravelWhereTheAxisMoves) {
  const CordRecord record = onSpring(60.0, 9);
  CordEntry entry{"axis-3", "cell-3", *fitCordFriction(record), std::nullopt};
  const auto by_travel = frictionAlong(entry, record.positions_m, record.tensions_N);
  entry.stretch = CordStretchFit{};
  entry.stretch->stiffness_N_per_m = 1e5;
  const auto by_stretch = frictionAlong(entry, record.positions_m, record.tensions_N);
  double squares = 0.0;
  for (std::size_t i = 0; i < by_travel.size(); ++i) {
    squares += (by_travel[i] - by_stretch[i]) * (by_travel[i] - by_stretch[i]);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(by_travel.size())), 4e-3);
}

}  // namespace
}  // namespace tenter
