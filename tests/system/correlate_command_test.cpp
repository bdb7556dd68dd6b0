// SPDX-License-Identifier: GPL-3.0-or-later
// `tenter correlate …` as users type it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "program.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::slurp;
using test_support::TemporaryFolder;
using testing::HasSubstr;

constexpr int kSide = 120;

/// A texture of many waves, moved along x, as a binary PGM.
std::string image(double moved_px, int width = kSide, int shades = 255) {
  std::string bytes = "P5\n" + std::to_string(width) + " " + std::to_string(kSide) + "\n" +
                      std::to_string(shades) + "\n";
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < width; ++x) {
      double value = 0.0;
      for (int k = 1; k <= 40; ++k) {
        // Directions and wavelengths spread by the golden ratio: nothing repeats.
        const double turn = 2.399963 * k, rate = 0.25 + 0.018 * k;
        value += std::sin(rate * ((x - moved_px) * std::cos(turn) + y * std::sin(turn)) + k * k);
      }
      const double level = std::round(128.0 + 22.0 * value);
      const int shade = static_cast<int>(std::clamp(level, 0.0, 255.0)) * (shades / 255);
      if (shades > 255) bytes += static_cast<char>(shade / 256);
      bytes += static_cast<char>(shade % 256);
    }
  }
  return bytes;
}

class CorrelateCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("ref.pgm", image(0.0));
    folder_.write("def.pgm", image(1.3));
  }
  Outcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "correlate");
    return tenter(arguments, folder_.path());
  }
  std::string reasonOf(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"-o", "no.csv", "--json"});
    const Outcome outcome = run(all);
    EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "no.csv"));
    const auto error = outcome.json().at("error");
    return error.at("file").get<std::string>() + ": " + error.at("place").get<std::string>() +
           ": " + error.at("reason").get<std::string>();
  }

  TemporaryFolder folder_;
};

TEST_F(CorrelateCommand, WritesAFieldAndASummary) {
  const Outcome outcome = run({"ref.pgm", "def.pgm", "--subset", "31", "--order", "2", "--step",
                               "5", "-o", "field.csv", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("points"), 18 * 18);
  EXPECT_GT(answer.at("valid").get<int>(), 17 * 17);
  EXPECT_NEAR(answer.at("mean_u_px").get<double>(), 1.3, 0.01);
  EXPECT_NEAR(answer.at("mean_v_px").get<double>(), 0.0, 0.01);
  EXPECT_GT(answer.at("points_per_second_per_core").get<double>(), 0.0);
  EXPECT_GT(answer.at("seconds").get<double>(), 0.0);

  std::istringstream field(slurp(folder_ / "field.csv"));
  std::string line;
  std::getline(field, line);
  EXPECT_EQ(line, "x,y,u,v,sigma,zncc,valid");
  int rows = 0, valid = 0;
  while (std::getline(field, line)) {
    ++rows;
    valid += line.ends_with(",1") ? 1 : 0;
  }
  EXPECT_EQ(rows, answer.at("points"));
  EXPECT_EQ(valid, answer.at("valid"));
}

TEST_F(CorrelateCommand, PointsKeepTheirOrderAndTheirPlace) {
  folder_.write("p.csv", "x,y\n70.5,60.25\n2,2\n50,40\n");
  const Outcome outcome = run({"ref.pgm", "def.pgm", "--points", "p.csv", "-o", "f.csv", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json().at("invalid").at("outside"), 1);
  const std::string field = slurp(folder_ / "f.csv");
  const std::string first = "x,y,u,v,sigma,zncc,valid\n70.5,60.25,";
  ASSERT_TRUE(field.starts_with(first)) << field;
  EXPECT_NEAR(std::stod(field.substr(first.size())), 1.3, 0.01);
  EXPECT_THAT(field, HasSubstr("\n2,2,nan,nan,nan,"));
  EXPECT_LT(field.find("\n2,2,"), field.find("\n50,40,"));
}

TEST_F(CorrelateCommand, BadImagesAreRefusedWithTheirReason) {
  folder_.write("wide.pgm", image(0.0, kSide + 1));
  folder_.write("deep.pgm", image(0.0, kSide, 65535));
  folder_.write("junk.tif", "II*");
  EXPECT_THAT(reasonOf({"ref.pgm", "absent.tif"}), HasSubstr("absent.tif"));
  EXPECT_THAT(reasonOf({"ref.pgm", "junk.tif"}), HasSubstr("junk.tif: : is no image"));
  EXPECT_THAT(reasonOf({"ref.pgm", "wide.pgm"}), HasSubstr("differ in size"));
  EXPECT_THAT(reasonOf({"ref.pgm", "deep.pgm"}), HasSubstr("8 bits and the other 16"));
  EXPECT_EQ(run({"deep.pgm", "deep.pgm", "-o", "deep.csv"}).exit_code, 0) << "16 bits are welcome";
}

TEST_F(CorrelateCommand, BadPointsAreRefusedWithTheirPlace) {
  folder_.write("words.csv", "1,2\n3,four\n");
  folder_.write("far.csv", "10,20\n10,2000\n");
  folder_.write("none.csv", "x,y\n");
  EXPECT_THAT(reasonOf({"ref.pgm", "def.pgm", "--points", "words.csv"}),
              HasSubstr("words.csv: line 2, column 2"));
  EXPECT_THAT(reasonOf({"ref.pgm", "def.pgm", "--points", "far.csv"}),
              HasSubstr("far.csv: point 2: lies outside"));
  EXPECT_THAT(reasonOf({"ref.pgm", "def.pgm", "--points", "none.csv"}), HasSubstr("none.csv"));
}

TEST_F(CorrelateCommand, NoMatchAtAllExitsWithFiveAndStillWrites) {
  std::string blank = image(0.0);
  std::fill(blank.end() - kSide * kSide, blank.end(), 'd');
  folder_.write("blank.pgm", blank);
  const Outcome outcome = run({"ref.pgm", "blank.pgm", "-o", "f.csv", "--json"});
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_EQ(outcome.json().at("valid"), 0);
  EXPECT_THAT(slurp(folder_ / "f.csv"), HasSubstr(",nan,nan,nan,"));
}

TEST_F(CorrelateCommand, WrongUseExitsWithTwo) {
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--subset", "30"},
                                                  {"--subset", "3"},
                                                  {"--order", "3"},
                                                  {"--step", "0"},
                                                  {"--step", "5", "--points", "p.csv"},
                                                  {"--min-zncc", "2"}}) {
    std::vector<std::string> arguments = {"ref.pgm", "def.pgm", "-o", "f.csv"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    EXPECT_EQ(run(arguments).exit_code, 2) << options[0] << ' ' << options[1];
  }
  EXPECT_EQ(run({"ref.pgm"}).exit_code, 2);
  folder_.write("thesis.doc", "dear");
  EXPECT_EQ(run({"ref.pgm", "def.pgm", "-o", "thesis.doc"}).exit_code, 3);
  EXPECT_EQ(slurp(folder_ / "thesis.doc"), "dear");
}

}  // namespace
}  // namespace tenter::system_test
