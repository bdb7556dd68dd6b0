// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <sstream>

#include "tenter/test_support/data.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::findData;
using test_support::noData;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;

TensileImportOptions stripOptions() {
  TensileImportOptions options;
  options.info.areal_density_kg_per_m2 = 0.1;
  options.length_m = 0.1;
  options.width_m = 0.02;
  return options;
}

/// Force 1000 N/m times (displacement + offset): a straight line that starts under pretension.
std::string line(double offset_mm, int rows = 20) {
  std::ostringstream out;
  out.precision(12);
  for (int i = 0; i < rows; ++i) out << 0.1 * i << "," << 0.1 * i + offset_mm << "\n";
  return out.str();
}

TEST(TensileImport, ExtrapolatesToZeroForceExactlyOnAStraightLine) {
  TemporaryFolder folder;
  const auto m = importTensile(folder.write("a.csv", line(0.25)), stripOptions());
  ASSERT_TRUE(m.ok()) << m.error().message();
  EXPECT_EQ(m->tensile->zero_strain_rule, "extrapolate");
  EXPECT_NEAR(m->tensile->zero_offset_m, 0.25e-3, 1e-12);  // rounding of the printed decimals
  ASSERT_EQ(m->frames.size(), 20u);
  EXPECT_DOUBLE_EQ(m->frames[10].displacement_m, 1e-3);
  EXPECT_DOUBLE_EQ(m->frames[10].force_N, 1.25);
}

TEST(TensileImport, OneOutlierDoesNotMoveTheExtrapolation) {
  TemporaryFolder folder;
  std::string text = line(0.25, 60);
  text.replace(text.find("0.2,0.45"), 8, "0.2,0.95");
  const auto m = importTensile(folder.write("a.csv", text), stripOptions());
  ASSERT_TRUE(m.ok()) << m.error().message();
  // One of eight first rows is wrong by 0.5 N, twice the force at the start.
  EXPECT_NEAR(m->tensile->zero_offset_m, 0.25e-3, 1e-9);
}

TEST(TensileImport, OtherRulesForZeroStrain) {
  TemporaryFolder folder;
  const auto csv = folder.write("a.csv", line(0.25));
  TensileImportOptions options = stripOptions();
  options.zero_strain = ZeroStrainRule::kFirstRow;
  EXPECT_EQ(importTensile(csv, options)->tensile->zero_offset_m, 0.0);
  options.zero_strain = ZeroStrainRule::kGiven;
  options.zero_offset_m = 1e-4;
  const auto given = importTensile(csv, options);
  EXPECT_EQ(given->tensile->zero_offset_m, 1e-4);
  EXPECT_EQ(given->tensile->zero_strain_rule, "given");
  EXPECT_FALSE(parseZeroStrainRule("last-row").ok());
}

TEST(TensileImport, FindsUnloadingBranchesAndIgnoresJitter) {
  TemporaryFolder folder;
  std::ostringstream out;
  for (int cycle = 0; cycle < 2; ++cycle) {
    for (int i = 0; i <= 50; ++i) out << 0.1 * i + (i % 2) * 0.02 << " " << i << "\n";
    for (int i = 49; i > 0; --i) out << 0.1 * i << " " << 0.5 * i << "\n";
  }
  const auto m = importTensile(folder.write("a.txt", out.str()), stripOptions());
  ASSERT_TRUE(m.ok()) << m.error().message();
  int wrong = 0;
  for (std::size_t i = 0; i < m->frames.size(); ++i) {
    const bool unloading = i % 100 > 50 || i == 100;  // the row of the turn ends its branch
    wrong += m->frames[i].branch != (unloading ? Branch::kUnloading : Branch::kLoading) ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0);
}

struct BrokenTensile {
  const char* name;
  std::string content;
  const char* says;
};
void PrintTo(const BrokenTensile& broken, std::ostream* out) { *out << broken.name; }

class BrokenTensileTest : public ::testing::TestWithParam<BrokenTensile> {};

TEST_P(BrokenTensileTest, IsRefusedWithPlaceAndReason) {
  TemporaryFolder folder;
  const auto csv = folder.write("broken.csv", GetParam().content);
  const auto m = importTensile(csv, stripOptions());
  ASSERT_FALSE(m.ok());
  EXPECT_EQ(m.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(m.error().message(), HasSubstr(GetParam().says));
  EXPECT_THAT(m.error().message(), HasSubstr("broken.csv"));
}

std::string zigzag() {
  std::ostringstream out;
  for (int i = 0; i < 200; ++i) out << (i % 2 == 0 ? 0.0 : 5.0) << "," << i << "\n";
  return out.str();
}

INSTANTIATE_TEST_SUITE_P(
    Files, BrokenTensileTest,
    ::testing::Values(BrokenTensile{"empty", "", "no rows"},
                      BrokenTensile{"header_only", "mm,N\n", "no rows"},
                      BrokenTensile{"three_columns", "0,1,2\n1,2,3\n", "line 1"},
                      BrokenTensile{"one_column", "mm,N\n0,1\n1\n", "line 3"},
                      BrokenTensile{"nan", "0,1\n1,nan\n2,3\n3,4\n4,5\n", "line 2"},
                      BrokenTensile{"words", "0,1\n1,two\n", "line 2"},
                      BrokenTensile{"too_few", "0,1\n1,2\n", "2 rows"},
                      BrokenTensile{"longer_than_strip", "0,1\n1,2\n2,3\n3,4\n400,5\n", "line 5"},
                      BrokenTensile{"metres", "# in m\n0,1\n1e-6,2\n2e-6,3\n3e-6,4\n4e-6,5\n",
                                    "metres"},
                      BrokenTensile{"compression", "0,-1\n1,-2\n2,-3\n3,-4\n4,-5\n", "positive"},
                      BrokenTensile{"zigzag", zigzag(), "turns back"},
                      BrokenTensile{"falls_at_first", "0,5\n1,4\n2,3\n3,4\n4,5\n5,6\n", "given"},
                      BrokenTensile{"still", "1,5\n1,4\n1,3\n1,4\n1,5\n1,6\n", "rise"}),
    [](const auto& of) { return std::string(of.param.name); });

TEST(TensileImport, RefusesOptionsThatCannotBe) {
  TemporaryFolder folder;
  const auto csv = folder.write("a.csv", line(0.25));
  const auto says = [&](auto change) {
    TensileImportOptions options = stripOptions();
    change(options);
    const auto m = importTensile(csv, options);
    return m.ok() ? std::string("accepted") : m.error().message();
  };
  EXPECT_THAT(says([](auto& o) { o.length_m = -0.1; }), HasSubstr("--length-mm"));
  EXPECT_THAT(says([](auto& o) { o.length_m = 97.0; }), HasSubstr("--length-mm"));
  EXPECT_THAT(says([](auto& o) { o.width_m = 0.0; }), HasSubstr("--width-mm"));
  EXPECT_THAT(says([](auto& o) { o.strips = 0; }), HasSubstr("--strips"));
  EXPECT_THAT(says([](auto& o) { o.angle_rad = 45.0; }), HasSubstr("--angle-deg"));
  EXPECT_THAT(says([](auto& o) { o.info.areal_density_kg_per_m2 = 61.6; }),
              HasSubstr("--areal-density-kg-m2"));
  EXPECT_THAT(says([](auto& o) { o.info.areal_density_kg_per_m2 = NAN; }),
              HasSubstr("--areal-density-kg-m2"));
}

TEST(TensileImport, ReadsTheNylonFiles) {
  const auto csv = findData("nylon-offaxis/angle-45.csv");
  if (!csv) GTEST_SKIP() << noData();
  TensileImportOptions options = stripOptions();
  options.length_m = 0.097;
  options.width_m = 0.00225;
  options.strips = 12;
  options.angle_rad = std::numbers::pi / 4.0;
  const auto m = importTensile(*csv, options);
  ASSERT_TRUE(m.ok()) << m.error().message();
  EXPECT_EQ(m->frames.size(), 82u);
  // The file starts at 0.1525 N and rises by 0.085 N in the first row of 0.0505 mm, by more later.
  EXPECT_GT(m->tensile->zero_offset_m, 0.06e-3);
  EXPECT_LT(m->tensile->zero_offset_m, 0.12e-3);
}

TEST(TensileImport, ReadsAHundredThousandRowsInSeconds) {
  TemporaryFolder folder;
  std::ostringstream out;
  for (int i = 0; i < 99'000; ++i) out << 1e-4 * i << "," << 1e-3 * i + 0.1 << "\n";
  const auto csv = folder.write("long.csv", out.str());
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(importTensile(csv, stripOptions()).ok());
  // Takes 0.1 s; the bound only catches work that grows with the square of the rows.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

CantileverImportOptions cantileverOptions(double length_m) {
  CantileverImportOptions options;
  options.info.areal_density_kg_per_m2 = 0.0616;
  options.length_m = length_m;
  return options;
}

TEST(CantileverImport, TakesTheTipAndRefusesAChordLongerThanTheStrip) {
  const auto m = importCantilever(38.1e-3, 63.5e-3, cantileverOptions(0.075));
  ASSERT_TRUE(m.ok()) << m.error().message();
  ASSERT_EQ(m->frames.size(), 1u);
  EXPECT_EQ(m->frames[0].reach_m, 38.1e-3);
  EXPECT_EQ(m->protocol, "cantilever");

  const auto impossible = importCantilever(34.925e-3, 15.875e-3, cantileverOptions(0.035));
  ASSERT_FALSE(impossible.ok());
  EXPECT_EQ(impossible.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(impossible.error().message(), HasSubstr("38.36"));  // hypot(34.925, 15.875)
  EXPECT_THAT(impossible.error().message(), HasSubstr("35 mm"));
}

TEST(CantileverImport, ReadsRepeatsAndNamesTheLineOfAnImpossibleOne) {
  TemporaryFolder folder;
  const auto good = folder.write("good.csv", "reach,drop\n38.1,63.5\n38.4,63.2\n");
  EXPECT_EQ(importCantilever(good, cantileverOptions(0.075))->frames.size(), 2u);
  const auto bad = folder.write("bad.csv", "reach,drop\n38.1,63.5\n70,63.2\n");
  const auto refused = importCantilever(bad, cantileverOptions(0.075));
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("bad.csv: line 3"));
  EXPECT_FALSE(importCantilever(0.03, -0.01, cantileverOptions(0.075)).ok());
}

// Rows in the form of the program's own files; row 3 and the second bending row are broken.
constexpr const char* kArcsim = R"({
  "density": 0.324,
  "stretching": [[205.352005, 10.234077, 1013.88629, 53.387184],
                 [232.027634, 40.646339, 1052.84289, 64.980499],
                 [224.592209, 40.384563, 1054.43444, 67.184807],
                 [225.951050, 500.0, 1059.59741, 83.992020],
                 [226.039566, 40.502792, 1058.27771, -1.0],
                 [225.767487, -40.917892, 1051.55712, 71.810631]],
  "bending": [[64e-6, 60e-6, 60e-6, 62e-6, 19e-6],
              [73e-6, 59e-6, 0.0, 68e-6, 36e-6],
              [96.951576e-6, 107e-6, 113e-6, 120e-6, 79e-6]],
  "note": "kept"
})";

TEST(ArcsimImport, KeepsEveryDigitAndFlagsRowsThatAreNotPositiveDefinite) {
  TemporaryFolder folder;
  const auto imported = importArcsim(folder.write("denim.json", kArcsim), "");
  ASSERT_TRUE(imported.ok()) << imported.error().message();
  const Material& material = imported->material;
  EXPECT_EQ(material.law, "arcsim");
  EXPECT_EQ(material.fabric, "denim");
  EXPECT_EQ(material.areal_density_kg_per_m2, 0.324);
  EXPECT_EQ(material.tables, nlohmann::json::parse(kArcsim));

  ASSERT_EQ(imported->flagged.size(), 3u);
  EXPECT_EQ(imported->flagged[0].table, "stretching");
  EXPECT_EQ(imported->flagged[0].row, 3);
  EXPECT_THAT(imported->flagged[0].reason, HasSubstr("c12^2 = 250000"));
  EXPECT_EQ(imported->flagged[1].row, 4);
  EXPECT_EQ(imported->flagged[2].table, "bending");
  EXPECT_EQ(imported->flagged[2].row, 1);
  EXPECT_THAT(imported->flagged[2].reason, HasSubstr("entry 2"));
  EXPECT_EQ(flagArcsimRows(material)->size(), 3u);

  const auto file = folder / "material.json";
  ASSERT_TRUE(writeMaterial(file, material).ok());
  EXPECT_EQ(readMaterial(file)->tables, material.tables);
}

TEST(ArcsimImport, RefusesTablesOfAnotherShape) {
  TemporaryFolder folder;
  const auto says = [&](const std::string& text) {
    const auto imported = importArcsim(folder.write("m.json", text), "");
    return imported.ok() ? std::string("accepted") : imported.error().message();
  };
  EXPECT_THAT(says("{\"density\": 0.3}"), HasSubstr("stretching"));
  EXPECT_THAT(says("{\"density\": 0.3"), HasSubstr("line 1"));
  EXPECT_THAT(says("{\"density\": -0.3, \"stretching\": [], \"bending\": []}"),
              HasSubstr("density"));
  EXPECT_THAT(says("[1, 2]"), HasSubstr("object"));
  std::string short_row = kArcsim;
  short_row.erase(short_row.find(", 53.387184"), 11);
  EXPECT_THAT(says(short_row), HasSubstr("stretching"));
}

constexpr const char* kKesHead = "property,unit,A,B\n";
constexpr const char* kKesBody =
    "EMT,%,5.0,4.0\nLT,-,0.7,0.8\nB,gf.cm2/cm,0.172,0.144\nG,gf/cm/deg,2.18,1.538\n";

TEST(KesImport, ReproducesForceWorkShearAndBending) {
  TemporaryFolder folder;
  const auto csv =
      folder.write("kes.csv", std::string(kKesHead) + kKesBody + "WT,gf.cm/cm2,8.75,8\n");
  const auto materials = importKes(csv, {});
  ASSERT_TRUE(materials.ok()) << materials.error().message();
  ASSERT_EQ(materials->size(), 2u);
  EXPECT_TRUE((*materials)[0].flagged.empty());
  const Material& a = (*materials)[0].material;
  EXPECT_EQ(a.law, "soft");
  const StiffnessCurve& stretch = a.find("stretch_weft")->curve;
  const double force = 500e-3 * 9.80665 / 1e-2;  // 500 gf/cm
  EXPECT_NEAR(stretch.evaluate(0.05).stress, force, 1e-9 * force);
  // WT = 8.75 gf cm/cm^2 = LT / 2 x 500 gf/cm x 5 %.
  const double work = 8.75e-3 * 9.80665 * 1e-2 / 1e-4;
  EXPECT_NEAR(stretch.evaluate(0.05).energy, work, 1e-9 * work);
  EXPECT_NEAR(a.find("shear")->curve.evaluate(0.0).stiffness, 2.18 * 56.19, 0.01);
  EXPECT_NEAR(a.find("bend_weft")->curve.evaluate(0.0).stiffness, 0.172 * 98.07e-6, 1e-9);
  // The reader of material files accepts what was made.
  EXPECT_TRUE(writeMaterial(folder / "a.json", a).ok());
}

TEST(KesImport, ReadsWhatSpreadsheetsMakeOfATable) {
  TemporaryFolder folder;
  const auto plain = importKes(folder.write("p.csv", std::string(kKesHead) + kKesBody), {});
  ASSERT_TRUE(plain.ok()) << plain.error().message();
  const std::string semicolons =
      "\xEF\xBB\xBF# a comment\r\nProperty;Unit;A;B\r\nEMT;%;5,0;4,0\r\nLT;;0,7;0,8\r\n"
      "B;gf\xC2\xB7"
      "cm\xC2\xB2/cm;0,172;0,144\r\nG;\"gf/cm/\xC2\xB0\";2,18;1,538\r\n;;;\r\n";
  const std::string tabs =
      "property\tunit\tA\tB\nEMT\t%\t5,0\t4,0\nLT\t-\t0,7\t0,8\nB\tgf cm2/cm\t0,172\t0,144\n"
      "G\tgf/cm/deg\t2,18\t1,538\n";
  const std::string units_row =
      "fabric,EMT,LT,thickness,B,G\n,%,-,mm,gf.cm^2/cm,gf/cm/deg\nA,5.0,0.7,0.6,0.172,2.18\n"
      "B,4.0,0.8,,0.144,1.538\n";
  for (const std::string& text : {semicolons, tabs, units_row}) {
    const auto materials = importKes(folder.write("k.csv", text), {});
    ASSERT_TRUE(materials.ok()) << text << materials.error().message();
    ASSERT_EQ(materials->size(), plain->size());
    for (std::size_t i = 0; i < plain->size(); ++i) {
      EXPECT_EQ((*materials)[i].material.fabric, (*plain)[i].material.fabric);
      for (const MaterialComponent& c : (*plain)[i].material.components)
        EXPECT_EQ((*materials)[i].material.find(c.name)->curve.stiffnesses(), c.curve.stiffnesses())
            << c.name;
    }
  }
}

TEST(KesImport, FlagsTheTwoMisprintsOfTheDenimTable) {
  const auto csv = findData("kes/six-denims.csv");
  if (!csv) GTEST_SKIP() << noData();
  const auto materials = importKes(*csv, {});
  ASSERT_TRUE(materials.ok()) << materials.error().message();
  std::string flagged;
  for (const ImportedMaterial& m : *materials) {
    if (!m.flagged.empty()) flagged += m.material.fabric;
  }
  EXPECT_EQ(flagged, "AE");
  EXPECT_THAT((*materials)[0].flagged[0].reason, HasSubstr("9.81"));
}

TEST(KesImport, RefusesBrokenTables) {
  TemporaryFolder folder;
  const auto says = [&](const std::string& text, KesImportOptions options = {}) {
    const auto materials = importKes(folder.write("k.csv", text), options);
    return materials.ok() ? std::string("accepted") : materials.error().message();
  };
  const std::string head = kKesHead, body = kKesBody;
  EXPECT_EQ(says(head + body), "accepted");
  EXPECT_THAT(says(""), HasSubstr("no KES table"));
  EXPECT_THAT(says(body), HasSubstr("header"));
  EXPECT_THAT(says(head + "EMT,%,5.0,4.0\n"), HasSubstr("LT is missing"));
  EXPECT_THAT(says(head + "EMT,%,5.0\n"), HasSubstr("line 2"));
  EXPECT_THAT(says(head + "EMT,mm,5.0,4.0\n"), HasSubstr("must be in"));
  EXPECT_THAT(says(head + "EMT,%,5.0,nan\n"), HasSubstr("fabric B"));
  EXPECT_THAT(says(head + "EMT,%,5.0,-4\n"), HasSubstr("outside"));
  EXPECT_THAT(says("property,unit,A,A\n" + body), HasSubstr("twice"));
  EXPECT_THAT(says("property,unit,A,../B\n" + body), HasSubstr("cannot name"));
  EXPECT_THAT(says(head + body + "EMT,%,5.0,4.0\n"), HasSubstr("twice"));
  EXPECT_THAT(says(head + body, {.fabric = "Z"}), HasSubstr("A B"));
  EXPECT_THAT(says("property;unit;A\nEMT;%;5,0\nLT;-;0.7\n"), HasSubstr("line 3"));
  EXPECT_THAT(says("property;unit;A\nEMT;%;1,234,5\n"), HasSubstr("not a finite number"));
  EXPECT_THAT(says("fabric,EMT,LT,B,G\nA,5,0.7,0.17,2.2\n"), HasSubstr("must be in \"%\""));
  EXPECT_THAT(says("fabric,EMT,LT,B,G\n"), HasSubstr("no fabric"));
  EXPECT_THAT(says("fabric,EMT,LT,B,G\n,%,-,gf.cm2/cm,gf/cm/deg\nA,5,0.7,0.17\n"),
              HasSubstr("line 3: has 4 columns"));
}

}  // namespace
}  // namespace tenter
