// SPDX-License-Identifier: GPL-3.0-or-later
// The commands as users type them, from files to files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "program.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::findData;
using test_support::noData;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;

constexpr const char* kArcsim =
    "{\"density\": 0.3, \"stretching\": [[100,0,90,20],[120,0,90,20],[100,300,90,20],[100,0,90,20],"
    "[100,0,90,20],[100,0,90,20]], \"bending\": [[1e-5,1e-5,1e-5,1e-5,1e-5],"
    "[1e-5,1e-5,1e-5,1e-5,1e-5],[1e-5,1e-5,1e-5,1e-5,0]]}";

TEST(ImportCommand, ArcsimAnswersWithWhatItFlagged) {
  TemporaryFolder folder;
  folder.write("denim.json", kArcsim);
  const Outcome outcome =
      tenter({"import", "arcsim", "denim.json", "-o", "MAT.json", "--json"}, folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto flagged = outcome.json().at("flagged");
  ASSERT_EQ(flagged.size(), 2u);
  EXPECT_EQ(flagged[0].at("table"), "stretching");
  EXPECT_EQ(flagged[0].at("row"), 2);
  EXPECT_THAT(flagged[0].at("reason").get<std::string>(), HasSubstr("c12"));
  EXPECT_EQ(flagged[1].at("table"), "bending");

  const Outcome check = tenter({"material", "check", "MAT.json", "--json"}, folder.path());
  EXPECT_EQ(check.exit_code, 3);
  EXPECT_EQ(check.json().at("ok"), false);
  EXPECT_FALSE(check.json().at("findings").empty());

  const Outcome back =
      tenter({"export", "MAT.json", "--to", "arcsim", "-o", "back.json", "--json"}, folder.path());
  ASSERT_EQ(back.exit_code, 0) << back.err;
  const auto before = nlohmann::json::parse(kArcsim);
  const auto after = nlohmann::json::parse(test_support::slurp(folder / "back.json"));
  EXPECT_EQ(after.at("stretching"), before.at("stretching"));
  EXPECT_EQ(after.at("bending"), before.at("bending"));
}

TEST(ImportCommand, ImpossibleCantileverExitsWithThreeAndTheNumbers) {
  TemporaryFolder folder;
  const Outcome outcome =
      tenter({"import", "cantilever", "--length-mm", "35", "--reach-mm", "34.925", "--drop-mm",
              "15.875", "--angle-deg", "0", "--areal-density-kg-m2", "0.0616", "-o", "c35"},
             folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("38.36"));
  EXPECT_THAT(outcome.err, HasSubstr("35 mm"));
  EXPECT_TRUE(test_support::listFolder(folder.path()).empty());
}

TEST(ImportCommand, KesWritesOneMaterialAFabricThatExports) {
  const auto csv = findData("kes/six-denims.csv");
  if (!csv) GTEST_SKIP() << noData();
  TemporaryFolder folder;
  const Outcome all =
      tenter({"import", "kes", csv->string(), "-o", "kes", "--json"}, folder.path());
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(all.json().at("flagged").size(), 2u);
  EXPECT_EQ(test_support::listFolder(folder / "kes").size(), 7u);
  const Outcome one = tenter({"import", "kes", csv->string(), "--fabric", "B",
                              "--areal-density-kg-m2", "0.3", "-o", "b.json"},
                             folder.path());
  ASSERT_EQ(one.exit_code, 0) << one.err;
  for (const char* target : {"arcsim", "blender", "newton", "csv"}) {
    const Outcome exported = tenter({"export", "b.json", "--to", target, "--edge-mm", "10", "-o",
                                     std::string("b.") + target, "--json"},
                                    folder.path());
    ASSERT_EQ(exported.exit_code, 0) << target << exported.err;
    const auto answer = exported.json();
    EXPECT_GE(answer.at("rms_rel").get<double>(), 0.0) << target;
    EXPECT_GE(answer.at("max_rel").get<double>(), answer.at("rms_rel").get<double>()) << target;
    EXPECT_NEAR(answer.at("strain_window").at("stretch_weft")[1].get<double>(), 0.05735, 1e-12);
    EXPECT_FALSE(answer.at("lost").empty()) << target;
  }
}

/// Rows of vertices along x, two triangles a quad.
std::string sheetObj(int columns, int rows, double edge_m) {
  std::ostringstream out;
  out.precision(12);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) out << "v " << i * edge_m << " " << j * edge_m << " 0\n";
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const int a = j * columns + i + 1, b = a + 1, c = a + columns, d = c + 1;
      out << "f " << a << " " << b << " " << d << "\nf " << a << " " << d << " " << c << "\n";
    }
  }
  return out.str();
}

TEST(DrapeCommand, RefusesAnArcsimTableAndSaysWhy) {
  TemporaryFolder folder;
  folder.write("denim.json", kArcsim);
  folder.write("sheet.obj", sheetObj(3, 3, 0.02));
  ASSERT_EQ(tenter({"import", "arcsim", "denim.json", "-o", "MAT.json"}, folder.path()).exit_code,
            0);
  const Outcome outcome =
      tenter({"drape", "sheet.obj", "--material", "MAT.json", "--fix", "0,1", "-o", "out.vtp"},
             folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("MAT.json: law"));
  EXPECT_THAT(outcome.err, HasSubstr("no energy"));
}

TEST(DrapeCommand, HangsASheetAndCertifiesIt) {
  TemporaryFolder folder;
  folder.write("sheet.obj", sheetObj(10, 10, 0.02));
  const Outcome outcome = tenter({"drape", "sheet.obj", "--rho", "0.1", "--k-stretch", "3",
                                  "--k-bend", "5e-3", "--fix", "0,99", "-o", "out.vtp", "--json"},
                                 folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto answer = outcome.json();
  for (const char* key : {"converged", "iterations", "factorizations", "residual_N",
                          "lambda_min_per_s2", "seconds", "energy_J"}) {
    EXPECT_TRUE(answer.contains(key)) << key;
  }
  EXPECT_TRUE(answer.at("converged").get<bool>());
  EXPECT_GT(answer.at("lambda_min_per_s2").get<double>(), 0.0);
  EXPECT_THAT(test_support::slurp(folder / "out.vtp").substr(0, 4000), HasSubstr("displacement_m"));
}

TEST(DrapeCommand, MovesPinsAndHangsFromOne) {
  TemporaryFolder folder;
  folder.write("sheet.obj", sheetObj(25, 25, 0.04));
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"drape",       "sheet.obj", "--rho",    "0.1",
                                          "--k-stretch", "3",         "--k-bend", "5e-3",
                                          "-o",          "o",         "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return tenter(arguments, folder.path());
  };
  const Outcome moved = with({"--fix", "0,24", "--move", "0:0.12,0,0", "--move", "24:-0.12,0,0"});
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_LE(moved.json().at("residual_N").get<double>(), 1e-9);
  EXPECT_FALSE(moved.json().at("swivels").get<bool>());
  const Outcome one_pin = with({"--fix", "0"});
  ASSERT_EQ(one_pin.exit_code, 0) << one_pin.err;
  EXPECT_TRUE(one_pin.json().at("swivels").get<bool>());
  EXPECT_GT(one_pin.json().at("lambda_min_per_s2").get<double>(), 0.0);
  for (const char* move : {"1:0,0,0", "0", "0:1,2", ":0,0,0", "x:0,0,0", "0:0,0,nan", ""})
    EXPECT_EQ(with({"--fix", "0", "--move", move}).exit_code, 2) << move;
}

TEST(DrapeCommand, StopsAtItsLimitsWithFiveAndTheBestSoFar) {
  TemporaryFolder folder;
  folder.write("sheet.obj", sheetObj(10, 10, 0.02));
  const Outcome outcome =
      tenter({"drape", "sheet.obj", "--rho", "0.1", "--k-stretch", "3", "--k-bend", "5e-3", "--fix",
              "0,99", "--max-iterations", "1", "-o", "out.vtp", "--json"},
             folder.path());
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_FALSE(outcome.json().at("converged").get<bool>());
  EXPECT_THAT(outcome.err, HasSubstr("best so far"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out.vtp"));
}

TEST(DrapeCommand, SaysWhyAFreeSheetCannotHang) {
  TemporaryFolder folder;
  folder.write("sheet.obj", sheetObj(3, 3, 0.02));
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"drape", "sheet.obj", "--rho", "0.1", "--k-stretch",
                                          "3",     "--k-bend",  "5e-3",  "-o",  "out.vtp"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return tenter(arguments, folder.path());
  };
  const Outcome free = with({});
  EXPECT_EQ(free.exit_code, 2);
  EXPECT_THAT(free.err, HasSubstr("no equilibrium"));
  for (const char* fix : {"9", "0,x", "5-2", "-1", "box:0,0,0", "box:9,9,9,10,10,10"}) {
    const Outcome wrong = with({"--fix", fix});
    EXPECT_EQ(wrong.exit_code, 2) << fix << wrong.err;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "out.vtp"));
  EXPECT_EQ(with({"--fix", "0-2", "--fix", "box:-1,0.03,-1,1,1,1"}).exit_code, 0);
}

TEST(FitCommand, NylonFromFilesToPredictions) {
  const auto data = findData("nylon-offaxis");
  if (!data) GTEST_SKIP() << noData();
  TemporaryFolder folder;
  for (const char* angle : {"00", "45", "90"}) {
    const std::string csv = (*data / (std::string("angle-") + angle + ".csv")).string();
    const Outcome outcome = tenter(
        {"import", "tensile", csv, "--length-mm", "97", "--width-mm", "2.25", "--strips", "12",
         "--angle-deg", angle, "--areal-density-kg-m2", "0.0616", "-o", std::string("m") + angle},
        folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  const Outcome fit = tenter({"fit", "m00", "m90", "--model", "stvk", "--variant", "linear",
                              "--max-frames", "6", "--nodes", "9", "-o", "nylon.json", "--json"},
                             folder.path());
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  const auto answer = fit.json();
  for (const char* key : {"converged", "seconds", "factorizations", "outer_iterations", "tests",
                          "curves", "warnings", "unobserved"}) {
    EXPECT_TRUE(answer.contains(key)) << key;
  }
  ASSERT_EQ(answer.at("tests").size(), 2u);
  EXPECT_TRUE(answer.at("tests")[0].at("position_rms_m").is_null());
  const auto knot = answer.at("curves")[0].at("knots")[0];
  EXPECT_TRUE(knot.contains("strain") && knot.contains("stiffness") && knot.contains("std"));

  const Outcome evaluation = tenter({"evaluate", "nylon.json", "m45", "--max-frames", "6",
                                     "--nodes", "9", "--json", "--predictions"},
                                    folder.path());
  ASSERT_EQ(evaluation.exit_code, 0) << evaluation.err;
  const auto test = evaluation.json().at("tests").at(0);
  EXPECT_EQ(test.at("measurement"), "m45");
  EXPECT_EQ(test.at("frames"), 6);
  EXPECT_GT(test.at("force_nrmse").get<double>(), 0.0);
  EXPECT_TRUE(test.contains("band_coverage"));
  EXPECT_EQ(test.at("predictions").size(), 6u);
}

TEST(FitCommand, ControlCKeepsTheBestSoFar) {
  const auto data = findData("nylon-offaxis/angle-45.csv");
  if (!data) GTEST_SKIP() << noData();
  TemporaryFolder folder;
  ASSERT_EQ(tenter({"import", "tensile", data->string(), "--length-mm", "97", "--width-mm", "2.25",
                    "--strips", "12", "--angle-deg", "45", "--areal-density-kg-m2", "0.0616", "-o",
                    "m45"},
                   folder.path())
                .exit_code,
            0);
  // Far longer than the second after which it is interrupted.
  const Outcome fit =
      tenter({"fit", "m45", "--nodes", "60", "-o", "nylon.json", "--json"}, folder.path(), 1.0);
  ASSERT_EQ(fit.exit_code, 5) << fit.err;
  EXPECT_FALSE(fit.json().at("converged").get<bool>());
  EXPECT_TRUE(fit.json().at("cancelled").get<bool>());
  EXPECT_EQ(tenter({"material", "check", "nylon.json"}, folder.path()).err, "");
}

TEST(TwinCommand, CapturesAMeasurementWithTruthBesideIt) {
  TemporaryFolder folder;
  const std::vector<std::string> capture = {
      "twin", "capture",       "--fabric", "knit-12", "--protocol", "stretch-weft", "--seed",
      "7",    "--measurement", "-o",       "m",       "--nodes",    "15",           "--frames",
      "3",    "--noise",       "off",      "--truth", "t",          "--json"};
  const Outcome outcome = tenter(capture, folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json().at("frames"), 3);
  EXPECT_TRUE(std::filesystem::exists(folder / "m/measurement.json"));
  EXPECT_TRUE(std::filesystem::exists(folder / "t/truth.json"));
  EXPECT_EQ(tenter({"twin", "capture", "--fabric", "silk-99", "--protocol", "shear",
                    "--measurement", "-o", "x"},
                   folder.path())
                .exit_code,
            2);
}

}  // namespace
}  // namespace tenter::system_test
