// SPDX-License-Identifier: GPL-3.0-or-later
// tenter invert as its page gives it, on a fabric with the stiffness of satin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "program.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::TemporaryFolder;
using ::testing::HasSubstr;

std::string component(const std::string& name, const std::string& unit, double stiffness) {
  const bool bending = unit == "N m", even = bending || name == "shear";
  std::ostringstream out;
  out << R"({"name": ")" << name
      << R"(", "status": "fitted", "strain_measure": "", "strain_unit": ")"
      << (bending ? "1/m" : "1") << R"(", "stiffness_unit": ")" << unit << R"(", "even": )"
      << (even ? "true" : "false")
      << R"(, "tangent_rule": "hermite", "knots": [{"strain": 0, "stiffness": )" << stiffness
      << R"(, "tangent": 0}, {"strain": )" << (bending ? 100.0 : 0.05) << R"(, "stiffness": )"
      << 1.4 * stiffness << R"(, "tangent": 0}]})";
  return out.str();
}

std::string satin() {
  return R"({"schema_version": 1, "fabric": "satin", "law": "stvk", "areal_density_kg_per_m2": 0.12, "components": [)" +
         component("stretch_weft", "N/m", 9e3) + "," + component("stretch_warp", "N/m", 9e3) + "," +
         component("shear", "N/m", 40.0) + "," + component("bend_weft", "N m", 5e-6) + "," +
         component("bend_warp", "N m", 5e-6) + "," + component("bend_diagonal", "N m", 4e-6) + "]}";
}

/// A round cloth over the upper half of a sphere of 0.1 m, hanging `hang_m` from its equator.
std::string drapedCap(double hang_m) {
  constexpr int kColumns = 18, kRings = 9;
  constexpr double kRadius = 0.1;
  const double quarter = 0.5 * M_PI * kRadius;
  std::ostringstream out;
  out.precision(17);
  out << "v 0 0 " << kRadius << "\nvt 0 0\n";
  for (int ring = 1; ring <= kRings; ++ring) {
    const double s = (quarter + hang_m) * ring / kRings, over = std::min(s, quarter);
    for (int i = 0; i < kColumns; ++i) {
      const double a = 2.0 * M_PI * i / kColumns, r = kRadius * std::sin(over / kRadius);
      out << "v " << r * std::cos(a) << ' ' << r * std::sin(a) << ' '
          << kRadius * std::cos(over / kRadius) - (s - over) << "\nvt " << s * std::cos(a) << ' '
          << s * std::sin(a) << '\n';
    }
  }
  const auto corner = [&](int ring, int i) {
    const int id = ring == 0 ? 1 : 2 + (ring - 1) * kColumns + i % kColumns;
    return std::to_string(id) + "/" + std::to_string(id);
  };
  for (int ring = 0; ring < kRings; ++ring) {
    for (int i = 0; i < kColumns; ++i) {
      const auto a = corner(ring, i), b = corner(ring, i + 1), c = corner(ring + 1, i),
                 d = corner(ring + 1, i + 1);
      if (ring == 0)
        out << "f " << a << ' ' << c << ' ' << d << '\n';
      else
        out << "f " << a << ' ' << c << ' ' << d << "\nf " << a << ' ' << d << ' ' << b << '\n';
    }
  }
  return out.str();
}

TEST(InvertCommand, AFittedFabricOnASphereIsCertified) {
  TemporaryFolder folder;
  folder.write("fitted.json", satin());
  folder.write("TARGET.obj", drapedCap(0.03));
  const Outcome outcome = tenter({"invert", "TARGET.obj", "--material", "fitted.json", "--obstacle",
                                  "sphere:0,0,0,0.1", "--friction", "0.3", "-o", "DIR", "--json"},
                                 folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("status"), "certified");
  EXPECT_LE(answer.at("force_residual_rel").get<double>(), 1e-10);
  EXPECT_EQ(answer.at("cone_violations"), 0);
  EXPECT_GT(answer.at("lambda_min_per_s2").get<double>(), 0.0);
  EXPECT_LE(answer.at("redrape_max_rel").get<double>(), 1e-6);
  EXPECT_THAT(test_support::listFolder(folder / "DIR"),
              ::testing::ElementsAre("certificate.json", "contacts.vtp", "pose.vtp", "problem.json",
                                     "rest.obj", "strains.vtp"));
}

TEST(InvertCommand, AMeasuredClothHangsFromWhatHeldIt) {
  TemporaryFolder folder;
  folder.write("fitted.json", satin());
  const Outcome captured =
      tenter({"twin", "capture", "--fabric", "satin-4", "--protocol", "bend-weft", "--seed", "3",
              "--measurement", "--frames", "3", "--nodes", "25", "-o", "M"},
             folder.path());
  ASSERT_EQ(captured.exit_code, 0) << captured.err;
  const Outcome outcome = tenter({"invert", "M", "--frame", "2", "--nodes", "15", "--material",
                                  "fitted.json", "-o", "DIR", "--json"},
                                 folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("status"), "certified");
  EXPECT_EQ(answer.at("contacts"), 0);
  // As stiff and light as this cloth is, the last bit of its coordinates is 1e-10 of its weight.
  const double rounding = answer.at("force_rounding_rel");
  EXPECT_GT(rounding, 2e-11);
  EXPECT_LT(rounding, 5e-10);
  EXPECT_LE(answer.at("force_residual_rel").get<double>(), 2.0 * rounding);
  const Outcome missing = tenter(
      {"invert", "M", "--frame", "3", "--material", "fitted.json", "-o", "E"}, folder.path());
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("frame 3"));
  const Outcome no_frames =
      tenter({"invert", "fitted.json", "--frame", "1", "--material", "fitted.json", "-o", "E"},
             folder.path());
  EXPECT_EQ(no_frames.exit_code, 2);
}

TEST(InvertCommand, WithoutMaterialCoordinatesTheWarpIsSaid) {
  TemporaryFolder folder;
  folder.write("fitted.json", satin());
  std::string bare;
  std::istringstream lines(drapedCap(0.0));
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("vt", 0) == 0) continue;
    std::istringstream words(line);
    for (std::string word; words >> word;) bare += word.substr(0, word.find('/')) + ' ';
    bare += '\n';
  }
  folder.write("TARGET.obj", bare);
  std::vector<std::string> arguments{
      "invert",     "TARGET.obj", "--material", "fitted.json", "--obstacle", "sphere:0,0,0,0.1",
      "--friction", "0.5",        "-o",         "DIR",         "--json"};
  const Outcome guessed = tenter(arguments, folder.path());
  EXPECT_EQ(guessed.exit_code, 0) << guessed.err << guessed.out;
  EXPECT_THAT(guessed.err, HasSubstr("--warp"));
  arguments.insert(arguments.end(), {"--warp", "0,1,0"});
  const Outcome told = tenter(arguments, folder.path());
  EXPECT_EQ(told.exit_code, 3) << "a triangle of the rim faces y";
  EXPECT_THAT(told.err, HasSubstr("triangle"));
}

TEST(InvertCommand, RangeIsInTheAnswerAndTheFile) {
  TemporaryFolder folder;
  folder.write("TARGET.obj", drapedCap(0.02));
  const Outcome outcome = tenter(
      {"invert", "TARGET.obj", "--rho", "0.1", "--k-stretch", "30", "--k-bend", "1e-3",
       "--obstacle", "sphere:0,0,0,0.1", "--friction", "0.4", "--range", "-o", "DIR", "--json"},
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  const auto range = outcome.json().at("range");
  EXPECT_LE(range.at("stiffness_factor_min").get<double>(), 1.0);
  EXPECT_LE(range.at("friction_factor_min").get<double>(), 1.0);
  EXPECT_EQ(nlohmann::json::parse(test_support::slurp(folder / "DIR/certificate.json")).at("range"),
            range);
}

TEST(InvertCommand, AMetricRestStateIsWrittenAndMovesAsIfAtRest) {
  TemporaryFolder folder;
  folder.write("TARGET.obj", drapedCap(0.02));
  const auto inverted = [&](const char* stretch, const char* bend, const char* out) {
    return tenter({"invert", "TARGET.obj", "--rho", "0.1", "--k-stretch", stretch, "--k-bend", bend,
                   "--obstacle", "sphere:0,0,0,0.1", "--friction", "0.4", "--rest", "metric", "-o",
                   out, "--json"},
                  folder.path());
  };
  const Outcome outcome = inverted("30", "1e-3", "DIR");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  EXPECT_TRUE(std::filesystem::exists(folder / "DIR/metric.json"));
  const Outcome moved =
      tenter({"resimulate", "DIR", "--seconds", "0.2", "-o", "OUT.pvd", "--json"}, folder.path());
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_LE(moved.json().at("max_displacement_rel").get<double>(), 1e-8);
  const Outcome soft = inverted("1e-4", "1e-8", "SOFT");
  EXPECT_EQ(soft.exit_code, 5) << soft.err;
  EXPECT_EQ(soft.json().at("status"), "infeasible");
  EXPECT_EQ(soft.json().at("proof").at("kind"), "softness");
  EXPECT_TRUE(std::filesystem::exists(folder / "SOFT/proof.vtp"));
}

TEST(InvertCommand, AMetricRestStateOfAFabricIsRefused) {
  TemporaryFolder folder;
  folder.write("TARGET.obj", drapedCap(0.02));
  folder.write("fitted.json", satin());
  const Outcome outcome = tenter({"invert", "TARGET.obj", "--material", "fitted.json", "--obstacle",
                                  "sphere:0,0,0,0.1", "--rest", "metric", "-o", "DIR"},
                                 folder.path());
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("--k-stretch"));
  EXPECT_FALSE(std::filesystem::exists(folder / "DIR"));
}

TEST(InvertCommand, TheTimeBudgetHolds) {
  TemporaryFolder folder;
  folder.write("TARGET.obj", drapedCap(0.05));
  const auto start = std::chrono::steady_clock::now();
  const Outcome outcome =
      tenter({"invert", "TARGET.obj", "--rho", "0.1", "--k-stretch", "3", "--k-bend", "1e-7",
              "--obstacle", "sphere:0,0,0,0.1", "--friction", "0.4", "--range", "--time-budget",
              "2", "-o", "DIR", "--json"},
             folder.path());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  // A tenth, and what starting the program and writing files takes on a busy machine.
  EXPECT_LE(took.count(), 2.2 + 1.0);
  EXPECT_THAT(outcome.exit_code, ::testing::AnyOf(0, 5)) << outcome.err;
}

}  // namespace
}  // namespace tenter::system_test
