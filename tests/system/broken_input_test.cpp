// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

constexpr const char* kMaterial = R"({"schema_version": 1, "fabric": "f", "law": "stvk",
 "areal_density_kg_per_m2": DENSITY, "components": [{"name": "stretch_weft", "status": "assumed",
 "strain_measure": "(|w_u|^2 - 1) / 2", "strain_unit": "1", "stiffness_unit": "UNIT", "even": false,
 "tangent_rule": "hermite", "knots": [{"strain": 0, "stiffness": 100, "tangent": 0}],
 "observed_strain": [0, 0]}]})";

std::string material(const std::string& density, const std::string& unit) {
  std::string text = kMaterial;
  text.replace(text.find("DENSITY"), 7, density);
  text.replace(text.find("UNIT"), 4, unit);
  return text;
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
      {"kes_unit", "k.csv", "property,unit,A\nEMT,mm,5\n", importKes("k.csv"), "line 2", "mm"},
      {"kes_incomplete", "k.csv", "property,unit,A\nEMT,%,5\n", importKes("k.csv"), "k.csv",
       "missing"},
      {"material_truncated", "m.json", "{\"schema_version\": 1,", exportFrom("m.json"), "line 1",
       "too early"},
      {"material_field", "m.json", "{\"schema_version\": 1}", exportFrom("m.json"), "fabric",
       "missing"},
      {"material_negative_mass", "m.json", material("-0.1", "N/m"), exportFrom("m.json"),
       "areal_density_kg_per_m2", "at least 0"},
      {"material_unit", "m.json", material("0.1", "gf/cm"), exportFrom("m.json"), "stiffness_unit",
       "N/m"},
      {"material_components", "m.json", material("0.1", "N/m"), exportFrom("m.json"), "m.json",
       "stretch_warp"},
      {"mesh_index", "s.obj", kSquare + "f 1 2 9\n", drape("s.obj"), "line 5", "9"},
      {"mesh_nan", "s.obj", "v 0 0 nan\n" + kSquare + "f 1 2 3\n", drape("s.obj"), "line 1", ""},
      {"mesh_pieces", "s.obj",
       kSquare + "v 1 0 0\nv 1.1 0 0\nv 1.1 0.1 0\nf 1 2 3\nf 1 3 4\nf 5 6 7\n", drape("s.obj"),
       "s.obj", "piece"},
      {"mesh_duplicate", "s.obj", kSquare + "v 0.1 0 0\nf 1 2 3\nf 1 3 4\nf 5 3 2\n",
       drape("s.obj"), "s.obj", ""},
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
