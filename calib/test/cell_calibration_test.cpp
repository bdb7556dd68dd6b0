// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/cell_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>

#include "tenter/core/json_reader.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using testing::HasSubstr;

constexpr double kGain = 1.013, kOffset_N = -0.021;

CellLoads weighed(double noise_N, double sigma_N, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  CellLoads cell{"cell-1", {}};
  for (const double force_N : {0.0, 0.5, 1.0, 2.0, 5.0, 2.0, 1.0, 0.5, 0.0}) {
    cell.loads.push_back(
        {force_N, kOffset_N + force_N / kGain + noise_N * noise(random), sigma_N, 21.0});
  }
  return cell;
}

TEST(CellCalibrationTest, RecoversGainAndZero) {
  const auto calibration = calibrateCells({weighed(0.0, 0.0, 1)}, {});
  ASSERT_TRUE(calibration.ok());
  EXPECT_TRUE(calibration->accepted);
  const CellLine& line = calibration->cells.at(0);
  EXPECT_NEAR(line.gain, kGain, 1e-12);
  EXPECT_NEAR(line.offset_N, kOffset_N, 1e-12);
  EXPECT_NEAR(line.force_N(kOffset_N + 3.0 / kGain), 3.0, 1e-12);
}

TEST(CellCalibrationTest, StatesItsUncertaintyTruly) {
  constexpr int kTrials = 400;
  constexpr double kNoise_N = 2e-3;
  double gain = 0.0, offset = 0.0, force = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto calibration =
        calibrateCells({weighed(kNoise_N, kNoise_N, 100 + static_cast<std::uint64_t>(trial))}, {});
    ASSERT_TRUE(calibration.ok());
    const CellLine& line = calibration->cells.at(0);
    const double reading_N = kOffset_N + 3.0 / kGain;
    gain += std::pow((line.gain - kGain) / line.gain_sigma, 2.0);
    offset += std::pow((line.offset_N - kOffset_N) / line.offset_sigma_N, 2.0);
    force += std::pow((line.force_N(reading_N) - 3.0) / line.sigma_N(reading_N), 2.0);
  }
  // Sigma grows with the scatter where that is larger than stated, hence a little below 1; 400
  // trials know a variance to 7 %.
  for (const double ratio : {gain / kTrials, offset / kTrials, force / kTrials}) {
    EXPECT_GT(ratio, 0.6);
    EXPECT_LT(ratio, 1.2);
  }
}

TEST(CellCalibrationTest, RejectsWhatIsNoLine) {
  CellLoads bent = weighed(0.0, 0.0, 1);
  bent.loads[3].reading_N += 0.05;
  const auto calibration = calibrateCells({bent}, {});
  ASSERT_TRUE(calibration.ok());
  EXPECT_FALSE(calibration->accepted);
  EXPECT_THAT(calibration->reasons.at(0), HasSubstr("cell-1: readings lie"));
  CellLoads pounds = weighed(0.0, 0.0, 1);
  for (DeadLoad& load : pounds.loads) load.reading_N *= 0.2248;
  const auto wrong_unit = calibrateCells({pounds}, {});
  EXPECT_THAT(wrong_unit->reasons.at(0), HasSubstr("another cell or unit"));
}

TEST(CellCalibrationTest, RefusesTooFewWeightsAndDeadCells) {
  CellLoads few = weighed(0.0, 0.0, 1);
  few.loads.resize(2);
  EXPECT_THAT(calibrateCells({few}, {}).error().message(), HasSubstr("three different weights"));
  CellLoads dead = weighed(0.0, 0.0, 1);
  for (DeadLoad& load : dead.loads) load.reading_N = 0.3;
  EXPECT_THAT(calibrateCells({dead}, {}).error().message(), HasSubstr("do not move"));
}

TEST(CellCalibrationTest, SaysWhatIsKnownOfTheTemperature) {
  CellLoads cell = weighed(0.0, 0.0, 1);
  cell.loads[0].temperature_degC = 27.0;
  EXPECT_THAT(calibrateCells({cell}, {})->warnings.at(0), HasSubstr("moved by more than 5"));
  for (DeadLoad& load : cell.loads) load.temperature_degC.reset();
  EXPECT_THAT(calibrateCells({cell}, {})->warnings.at(0), HasSubstr("was not noted"));
}

TEST(CellCalibrationTest, SurvivesTheFileAndRefusesAnEditedOne) {
  const test_support::TemporaryFolder folder;
  const auto calibration = calibrateCells({weighed(1e-3, 1e-3, 5)}, {"class M1 weights"});
  ASSERT_TRUE(writeCellCalibration(folder / "cells.json", *calibration).ok());
  const auto read = readCellCalibration(folder / "cells.json");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->id, calibration->id);
  EXPECT_EQ(read->find("cell-1")->gain, calibration->find("cell-1")->gain);
  EXPECT_THAT(test_support::schemaErrors(
                  *readJsonFile(folder / "cells.json"),
                  test_support::sourceFolder() / "docs/formats/cell-calibration.schema.json"),
              testing::IsEmpty());
  std::string text = test_support::slurp(folder / "cells.json");
  text.replace(text.find("\"offset_N\": -"), 13, "\"offset_N\": ");
  folder.write("cells.json", text);
  EXPECT_THAT(readCellCalibration(folder / "cells.json").error().message(),
              HasSubstr("is not that of the content"));
}

TEST(CellCalibrationTest, IsReadByPlainPython) {
  const std::string python = "/usr/bin/python3";
  if (!std::filesystem::exists(python)) GTEST_SKIP() << python << " is not installed";
  const test_support::TemporaryFolder folder;
  const auto calibration = calibrateCells({weighed(0.0, 0.0, 1)}, {});
  ASSERT_TRUE(writeCellCalibration(folder / "cells.json", *calibration).ok());
  const std::string script =
      (test_support::sourceFolder() / "docs/formats/python/read_force_calibration.py").string();
  const std::string command = "PYTHONDONTWRITEBYTECODE=1 " + python + " '" + script + "' '" +
                              (folder / "cells.json").string() + "' cell-1 2.5 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  char output[256] = "";
  EXPECT_NE(std::fgets(output, sizeof output, pipe), nullptr);
  ASSERT_EQ(pclose(pipe), 0) << output;
  EXPECT_NEAR(std::stod(output), calibration->cells[0].force_N(2.5), 1e-9) << output;
}

TEST(DeadLoadsTest, ReadsATableAndNamesWhatIsWrong) {
  const test_support::TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return readDeadLoads(folder.write("w.csv", text), 9.81);
  };
  const auto good = read(
      "# bench\ncell; mass_g; reading_N; temperature_degC\n"
      "cell-2;100;0.98;21\n\ncell-1;50;0.49;\r\ncell-2;0;0.001;21.5\n");
  ASSERT_TRUE(good.ok()) << good.error().message();
  ASSERT_EQ(good->size(), 2U);
  EXPECT_EQ(good->at(0).cell, "cell-2");
  EXPECT_EQ(good->at(0).loads.size(), 2U);
  EXPECT_NEAR(good->at(0).loads[0].force_N, 0.981, 1e-12);
  EXPECT_FALSE(good->at(1).loads[0].temperature_degC.has_value());
  const std::string names = "cell,mass_g,reading_N\n";
  EXPECT_THAT(read(names + "cell-1,ten,1\n").error().message(), HasSubstr("line 2, mass_g"));
  EXPECT_THAT(read(names + "cell-1,1\n").error().message(), HasSubstr("has 2 fields, not 3"));
  EXPECT_THAT(read(names + "cell-1,1,nan\n").error().message(), HasSubstr("line 2, reading_N"));
  EXPECT_THAT(read("cell,weight,reading_N\n").error().message(), HasSubstr("no column \"weight\""));
  EXPECT_THAT(read("cell,mass_g,mass_kg,reading_N\n").error().message(), HasSubstr("needs"));
  EXPECT_THAT(read(names).error().message(), HasSubstr("no weights"));
}

}  // namespace
}  // namespace tenter
