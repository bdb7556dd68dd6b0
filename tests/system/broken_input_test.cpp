// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "program.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::TemporaryFolder;
using ::testing::HasSubstr;

using Arguments = std::vector<std::string>;

/// A file that must not be taken, the command that meets it, and what the refusal must name.
struct Broken {
  std::string name, file, content;
  Arguments arguments;
  std::string place, reason;
};
void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.name; }

Arguments importTensile(const std::string& file) {
  return {"import", "tensile",     file, "--length-mm", "97",     "--width-mm",
          "2.25",   "--angle-deg", "0",  "-o",          "output", "--areal-density-kg-m2",
          "0.06"};
}

Arguments importCantilever(const std::string& file) {
  return {"import", "cantilever",  file,    "--length-mm",
          "75",     "--angle-deg", "0",     "--areal-density-kg-m2",
          "0.06",   "-o",          "output"};
}

Arguments importArcsim(const std::string& file) {
  return {"import", "arcsim", file, "-o", "output"};
}

Arguments importKes(const std::string& file) { return {"import", "kes", file, "-o", "output"}; }

Arguments exportFrom(const std::string& file) {
  return {"export", file, "--to", "newton", "-o", "output"};
}

Arguments drape(const std::string& file) {
  return {"drape",    file,   "--rho", "0.1", "--k-stretch", "30",
          "--k-bend", "1e-4", "--fix", "0",   "-o",          "output"};
}

Arguments checkMaterial(const std::string& file) { return {"material", "check", file}; }

/// A sound material of one constant a component, with one thing said otherwise.
std::string material(const std::string& from = "", const std::string& to = "") {
  std::string components;
  for (const char* name :
       {"stretch_weft", "stretch_warp", "shear", "bend_weft", "bend_warp", "bend_diagonal"}) {
    const bool bends = std::string(name).starts_with("bend");
    const bool stretches = std::string(name).starts_with("stretch");
    components += components.empty() ? "" : ",\n ";
    components += std::string("{\"name\": \"") + name +
                  R"(", "status": "assumed", "strain_measure": "e",
  "strain_unit": ")" +
                  (bends ? "1/m" : "1") + R"(", "stiffness_unit": ")" + (bends ? "N m" : "N/m") +
                  R"(", "even": )" + (stretches ? "false" : "true") +
                  R"(, "tangent_rule": "hermite", "observed_strain": [0, 0],
  "knots": [{"strain": 0, "stiffness": 100, "tangent": 0}, {"strain": 0.5, "stiffness": 90, "tangent": 0}]})";
  }
  std::string text =
      R"({"schema_version": 1, "fabric": "f", "law": "stvk", "variant": "orthotropic",
 "areal_density_kg_per_m2": 0.1, "components": [)" +
      components + "]}";
  return from.empty() ? text : text.replace(text.find(from), from.size(), to);
}

const std::string kSquare = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\n";

std::vector<Broken> brokenFiles() {
  const std::string rows = "0,1\n0.1,2\n0.2,3\n0.3,4\n0.4,5\n";
  const std::string arcsim_end = ", \"bending\": [[1,1,1,1,1],[1,1,1,1,1],[1,1,1,1,1]]}";
  return {
      {"csv_missing", "", "", importTensile("a.csv"), "a.csv", "read"},
      {"csv_empty", "a.csv", "", importTensile("a.csv"), "a.csv", "no rows"},
      {"csv_columns", "a.csv", rows + "1,2,3\n", importTensile("a.csv"), "line 6", "3 columns"},
      {"csv_nan", "a.csv", rows + "0.5,nan\n", importTensile("a.csv"), "line 6", "not"},
      {"csv_infinite", "a.csv", rows + "0.5,1e999\n", importTensile("a.csv"), "line 6", "number"},
      {"csv_text", "a.csv", rows + "0.5,six\n", importTensile("a.csv"), "line 6", "six"},
      {"csv_metres", "a.csv", "0,1\n1e-4,2\n2e-4,3\n3e-4,4\n4e-3,5\n", importTensile("a.csv"),
       "line 5", "metres"},
      {"csv_swapped_units", "a.csv", rows + "500,6\n", importTensile("a.csv"), "line 6", "longer"},
      {"csv_few", "a.csv", "0,1\n1,2\n", importTensile("a.csv"), "a.csv", "2 rows"},
      {"csv_mixed_decimals", "a.csv", "0;1\n0,1;2\n0.2;3\n0.3;4\n0.4;5\n", importTensile("a.csv"),
       "line 3", "mixed"},
      {"csv_no_rise", "a.csv", "0,5\n0.1,4\n0.2,3\n0.3,2\n0.4,1\n", importTensile("a.csv"),
       "line 1", "rise"},
      {"csv_pushed", "a.csv", "0,-1\n0.1,-2\n0.2,-3\n0.3,-4\n0.4,-5\n", importTensile("a.csv"),
       "a.csv", "positive"},
      {"csv_kilonewtons_as_newtons", "a.csv", rows + "0.5,5e6\n", importTensile("a.csv"), "line 6",
       "beyond"},
      {"csv_colons", "a.csv", "0:1\n0.1:2\n", importTensile("a.csv"), "line 2", "1 columns"},
      {"csv_control_characters", "a.csv", rows + std::string("0.5,6\0\x1b[2J7\n", 11),
       importTensile("a.csv"), "line 6, column 2", "6??[2J7"},
      {"csv_binary", "a.csv", std::string("\0\1\2\3\n\4\5", 7), importTensile("a.csv"), "a.csv",
       "line"},
      {"csv_is_folder", "a.csv/x", "", importTensile("a.csv"), "a.csv", "folder"},
      {"tip_beyond_strip", "a.csv", "38.1,63.5\n60,60\n", importCantilever("a.csv"), "line 2",
       "farther"},
      {"tip_upward", "a.csv", "38.1,-3\n", importCantilever("a.csv"), "line 1", "negative"},
      {"arcsim_truncated", "a.json", "{\"density\": 0.3, \"stret", importArcsim("a.json"), "line 1",
       "too early"},
      {"arcsim_rows", "a.json", "{\"density\": 0.3, \"stretching\": [[1,2,3,4]]" + arcsim_end,
       importArcsim("a.json"), "stretching", "6"},
      {"arcsim_density", "a.json", "{\"density\": -1, \"stretching\": []" + arcsim_end,
       importArcsim("a.json"), "density", "above 0"},
      {"arcsim_nan", "a.json", "{\"density\": nan" + arcsim_end, importArcsim("a.json"), "line 1",
       "JSON"},
      {"arcsim_grams", "a.json", "{\"density\": 324, \"stretching\": []" + arcsim_end,
       importArcsim("a.json"), "density", "unit"},
      {"kes_number", "k.csv", "property,unit,A\nEMT,%,five\n", importKes("k.csv"), "line 2",
       "five"},
      {"kes_columns", "k.csv", "property,unit,A\nEMT,%,5,6\n", importKes("k.csv"), "line 2",
       "4 columns"},
      {"kes_name", "k.csv", "property,unit,../A\nEMT,%,5\n", importKes("k.csv"), "line 1", "../A"},
      {"kes_unit", "k.csv", "property,unit,A\nEMT,mm,5\n", importKes("k.csv"), "line 2", "mm"},
      {"kes_decimals", "k.csv", "property;unit;A\nEMT;%;5,1\nLT;-;0.7\n", importKes("k.csv"),
       "line 3, fabric A", "mixed"},
      {"kes_units_row", "k.csv", "fabric,EMT\nA,5\n", importKes("k.csv"), "line 2", "unit"},
      {"kes_incomplete", "k.csv", "property,unit,A\nEMT,%,5\n", importKes("k.csv"), "k.csv",
       "missing"},
      {"material_truncated", "m.json", "{\"schema_version\": 1,", exportFrom("m.json"), "line 1",
       "too early"},
      {"material_field", "m.json", "{\"schema_version\": 1}", exportFrom("m.json"), "fabric",
       "missing"},
      {"material_negative_mass", "m.json", material("0.1,", "-0.1,"), exportFrom("m.json"),
       "areal_density_kg_per_m2", "at least 0"},
      {"material_grams", "m.json", material("0.1,", "61.6,"), exportFrom("m.json"),
       "areal_density_kg_per_m2", "unit"},
      {"material_nan", "m.json", material("0.1,", "NaN,"), exportFrom("m.json"), "line 2", "JSON"},
      {"material_beyond_double", "m.json", material("0.1,", "1e400,"), exportFrom("m.json"),
       "areal_density_kg_per_m2", "double"},
      {"material_unit", "m.json", material("\"N/m\"", "\"gf/cm\""), exportFrom("m.json"),
       "components[0].stiffness_unit", "N/m"},
      {"material_components", "m.json", material("stretch_warp", "stretch_bias"),
       exportFrom("m.json"), "components[1].name", "stretch_bias"},
      {"material_component_twice", "m.json", material("stretch_warp", "stretch_weft"),
       exportFrom("m.json"), "components[1].name", "before"},
      {"material_law", "m.json", material("\"stvk\"", "\"kevlar\""), exportFrom("m.json"), "law",
       "unknown"},
      {"material_knots", "m.json", material("\"strain\": 0.5", "\"strain\": -0.5"),
       exportFrom("m.json"), "components[0].knots", "increase"},
      {"material_covariance", "m.json",
       material("\"components\"",
                "\"covariance\": {\"labels\": [\"shear[0]\"], \"matrix\": [[1, 0], [0, 1]]}, "
                "\"components\""),
       exportFrom("m.json"), "covariance.matrix", "2 rows"},
      {"material_variance", "m.json",
       material("\"components\"",
                "\"covariance\": {\"labels\": [\"shear[0]\"], \"matrix\": [[-1]]}, \"components\""),
       exportFrom("m.json"), "covariance.matrix[0][0]", "negative"},
      {"material_negative_stiffness", "m.json", material("90", "-90"), checkMaterial("m.json"),
       "stretch_weft", "-90"},
      {"material_deep", "m.json", std::string(100'000, '{'), exportFrom("m.json"), "line 1", ""},
      {"material_folder", "m.json/x", "", exportFrom("m.json"), "m.json", "folder"},
      {"mesh_index", "s.obj", kSquare + "f 1 2 9\n", drape("s.obj"), "line 5", "9"},
      {"mesh_nan", "s.obj", "v 0 0 nan\n" + kSquare + "f 1 2 3\n", drape("s.obj"), "line 1", ""},
      {"mesh_pieces", "s.obj",
       kSquare + "v 1 0 0\nv 1.1 0 0\nv 1.1 0.1 0\nf 1 2 3\nf 1 3 4\nf 5 6 7\n", drape("s.obj"),
       "s.obj", "piece"},
      {"mesh_duplicate", "s.obj", kSquare + "v 0.1 0 0\nf 1 2 3\nf 1 3 4\nf 5 3 2\n",
       drape("s.obj"), "s.obj", ""},
      {"mesh_third_at_edge", "s.obj", kSquare + "v 0 0 1\nf 1 2 3\nf 1 3 4\nf 3 1 5\n",
       drape("s.obj"), "triangle 2", "third"},
      {"mesh_loose", "s.obj", kSquare + "v 0 0 1\nf 1 2 3\nf 1 3 4\n", drape("s.obj"), "vertex 4",
       "no triangle"},
      {"mesh_ply_cut", "s.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", drape("s.ply"),
       "header", "end"},
      {"mesh_vtp_cut", "s.vtp", "<VTKFile type=\"PolyData\"><Poly", drape("s.vtp"), "VTP", "XML"},
      {"mesh_empty", "s.obj", "", drape("s.obj"), "s.obj", ""},
      {"mesh_kind", "s.stl", "solid", drape("s.stl"), "s.stl", ""},
      {"measurement_missing", "", "", {"fit", "nowhere", "-o", "output"}, "nowhere", ""},
      {"measurement_empty",
       "m/measurement.json",
       "{}",
       {"fit", "m", "-o", "output"},
       "measurement.json",
       "missing"},
  };
}

class BrokenInputTest : public ::testing::TestWithParam<Broken> {};

TEST_P(BrokenInputTest, ExitsWithThreeNamesPlaceAndReasonAndLeavesNothing) {
  const Broken& broken = GetParam();
  TemporaryFolder folder;
  if (!broken.file.empty()) folder.write(broken.file, broken.content);
  const auto before = test_support::listFolder(folder.path());
  const Outcome outcome = tenter(broken.arguments, folder.path());
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(broken.place));
  EXPECT_THAT(outcome.err, HasSubstr(broken.reason));
  const std::string name = broken.file.substr(0, broken.file.find('/'));
  EXPECT_THAT(outcome.err, HasSubstr(name));
  EXPECT_EQ(test_support::listFolder(folder.path()), before) << "something half-written is left";
}

INSTANTIATE_TEST_SUITE_P(Files, BrokenInputTest, ::testing::ValuesIn(brokenFiles()),
                         [](const auto& of) { return of.param.name; });

TEST(BrokenFile, LinksInACircleAndPipesAreRefusedAtOnce) {
  TemporaryFolder folder;
  std::filesystem::create_symlink("b.json", folder / "a.json");
  std::filesystem::create_symlink("a.json", folder / "b.json");
  ASSERT_EQ(mkfifo((folder / "pipe.json").c_str(), 0600), 0);
  const Outcome circle = tenter(exportFrom("a.json"), folder.path());
  EXPECT_EQ(circle.exit_code, 3);
  EXPECT_THAT(circle.err, HasSubstr("a.json: cannot be read"));
  const Outcome pipe = tenter(exportFrom("pipe.json"), folder.path());
  EXPECT_EQ(pipe.exit_code, 3);
  EXPECT_THAT(pipe.err, HasSubstr("not a regular file"));
}

TEST(BrokenFile, TheTablesStartFromAMaterialThatIsSound) {
  TemporaryFolder folder;
  folder.write("m.json", material());
  EXPECT_EQ(tenter(checkMaterial("m.json"), folder.path()).exit_code, 0);
  EXPECT_EQ(tenter(exportFrom("m.json"), folder.path()).exit_code, 0);
}

TEST(BrokenFile, OneMeasurementGivenTwiceIsRefused) {
  TemporaryFolder folder;
  folder.write("a.csv", "0,1\n0.1,2\n0.2,3\n0.3,4\n0.4,5\n");
  ASSERT_EQ(tenter(importTensile("a.csv"), folder.path()).exit_code, 0);
  std::filesystem::rename(folder / "output", folder / "a");
  std::filesystem::copy(folder / "a", folder / "b");
  const Outcome outcome = tenter({"fit", "a", "b", "-o", "m.json"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("same numbers as a"));
}

TEST(Overwriting, RefusesWhatIsNotOurs) {
  TemporaryFolder folder;
  const std::string rows = "0,1\n0.1,2\n0.2,3\n0.3,4\n0.4,5\n";
  folder.write("a.csv", rows);
  folder.write("output/thesis.txt", "years of work");
  const Outcome refused = tenter(importTensile("a.csv"), folder.path());
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("output"));
  EXPECT_EQ(test_support::slurp(folder / "output/thesis.txt"), "years of work");

  folder.write("mine.json", "{\"precious\": true}");
  const std::string table =
      "{\"density\": 0.3, \"stretching\": [[1,0,1,1],[1,0,1,1],[1,0,1,1],[1,0,1,1],[1,0,1,1],"
      "[1,0,1,1]], \"bending\": [[1,1,1,1,1],[1,1,1,1,1],[1,1,1,1,1]]}";
  folder.write("a.json", table);
  EXPECT_EQ(tenter({"import", "arcsim", "a.json", "-o", "mine.json"}, folder.path()).exit_code, 3);
  EXPECT_EQ(test_support::slurp(folder / "mine.json"), "{\"precious\": true}");
  // What it wrote itself it replaces.
  const Arguments again = {"import", "arcsim", "a.json", "-o", "m.json"};
  EXPECT_EQ(tenter(again, folder.path()).exit_code, 0);
  EXPECT_EQ(tenter(again, folder.path()).exit_code, 0);
}

}  // namespace
}  // namespace tenter::system_test
