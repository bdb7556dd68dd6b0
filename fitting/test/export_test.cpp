// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "arcsim_law.h"
#include "sheet_response.h"

namespace tenter {
namespace {

using ::testing::HasSubstr;

constexpr double kRounding = 1e-9;  // of sums of a few hundred doubles
constexpr double kWeft = 400.0, kWarp = 900.0, kShear = 60.0;
constexpr double kBendWeft = 3e-6, kBendWarp = 8e-6, kTwist = 2e-6;

void add(Material& material, const char* name, const StiffnessCurve& curve, double to) {
  MaterialComponent component;
  component.name = name;
  component.status = ComponentStatus::kFitted;
  component.curve = curve;
  component.observed_max = to;
  material.components.push_back(component);
}

Material linearMaterial(const char* law) {
  Material m;
  m.fabric = "test";
  m.law = law;
  m.areal_density_kg_per_m2 = 0.2;
  const bool springs = std::string(law) == "springs";
  add(m, "stretch_weft", StiffnessCurve::constant(kWeft), 0.1);
  add(m, "stretch_warp", StiffnessCurve::constant(kWarp), 0.1);
  add(m, "shear", StiffnessCurve::constant(kShear, true), 0.1);
  add(m, "bend_weft", StiffnessCurve::constant(kBendWeft, !springs), springs ? 0.01 : 50.0);
  add(m, "bend_warp", StiffnessCurve::constant(kBendWarp, !springs), springs ? 0.01 : 50.0);
  add(m, "bend_diagonal", StiffnessCurve::constant(kTwist, !springs), springs ? 0.01 : 50.0);
  return m;
}

/// Weft stiffness from 200 to 600 N/m over 10 %.
Material stiffeningMaterial() {
  Material m = linearMaterial("stvk");
  m.find("stretch_weft")->curve =
      StiffnessCurve::fromKnots({0.0, 0.1}, {200.0, 600.0}, {4000.0, 4000.0}).value();
  return m;
}

ExportedMaterial exported(const Material& material, const char* to,
                          std::optional<double> edge_m = {}) {
  const auto target = findExportTarget(to);
  const auto result = exportMaterial(material, **target, {.edge_m = edge_m});
  if (!result.ok()) throw std::runtime_error(result.error().message());
  return *result;
}

TEST(ArcsimExport, LinearStvkMaterialIsExact) {
  const ExportedMaterial e = exported(linearMaterial("stvk"), "arcsim");
  EXPECT_LT(e.max_rel, kRounding);
  EXPECT_LT(e.bending_max_rel, kRounding);
  const auto json = nlohmann::json::parse(e.content);
  EXPECT_EQ(json.at("density"), 0.2);
  ASSERT_EQ(json.at("stretching").size(), 6u);
  for (const auto& row : json.at("stretching")) {
    // c11 = k_weft / 2, c12 = 0, c22 = k_warp / 2, c33 = k_shear: the program doubles each.
    EXPECT_NEAR(row.at(0).get<double>(), kWeft / 2, kRounding * kWeft);
    EXPECT_NEAR(row.at(1).get<double>(), 0.0, kRounding * kWeft);
    EXPECT_NEAR(row.at(2).get<double>(), kWarp / 2, kRounding * kWarp);
    EXPECT_NEAR(row.at(3).get<double>(), kShear, kRounding * kShear);
  }
  // Edges along weft resist the warp's curvature; B = entry / 4.
  ASSERT_EQ(json.at("bending").size(), 3u);
  EXPECT_NEAR(json.at("bending")[0][2].get<double>(), 4 * kBendWarp, kRounding * kBendWarp);
  EXPECT_NEAR(json.at("bending")[2][0].get<double>(), 4 * kBendWeft, kRounding * kBendWeft);
  EXPECT_NEAR(json.at("bending")[1][4].get<double>(), kBendWeft + kBendWarp + 4 * kTwist,
              kRounding * kBendWarp);
}

/// The program's way from strain to stiffness, written a second time for one strain state: the
/// nearest samples of its grid along E_uu alone.
double weftStiffnessByHand(const nlohmann::json& json, double e_uu) {
  const auto sample = [&](double g_uu, double g_vv) {
    const double larger = std::max(g_uu, g_vv);
    const double part = std::clamp(6.0 * (std::sqrt(1.0 + 2.0 * larger) - 1.0), 0.0, 1.0);
    const std::size_t row = g_uu >= g_vv ? 1 : 5;
    const double k0 = json["stretching"][0][0], k1 = json["stretching"][row][0];
    return 2.0 * ((1.0 - part) * k0 + part * k1);
  };
  const double place = 30.0 * (e_uu + 0.25);
  const double below = std::floor(place), t = place - below;
  const double g0 = below / 30.0 - 0.25, g1 = g0 + 1.0 / 30.0;
  const double v0 = 7.0 / 30.0 - 0.25, v1 = 8.0 / 30.0 - 0.25;
  const double low = 0.5 * (sample(g0, v0) + sample(g0, v1));
  const double high = 0.5 * (sample(g1, v0) + sample(g1, v1));
  return (1.0 - t) * low + t * high;
}

TEST(ArcsimExport, ReportedErrorIsThatOfTheProgramsOwnFormula) {
  const Material m = stiffeningMaterial();
  const ExportedMaterial e = exported(m, "arcsim");
  const auto json = nlohmann::json::parse(e.content);
  double squares = 0.0, largest = 0.0;
  constexpr int kCount = 64;
  for (int i = 1; i <= kCount; ++i) {
    const double strain = 0.1 * i / kCount;
    const double own = m.find("stretch_weft")->curve.evaluate(strain).stiffness;
    const double relative = weftStiffnessByHand(json, strain) / own - 1.0;
    squares += relative * relative;
    largest = std::max(largest, std::abs(relative));
  }
  EXPECT_NEAR(e.errors[0].rms_rel, std::sqrt(squares / kCount), 1e-3);  // the rim of its table
  EXPECT_NEAR(e.errors[0].max_rel, largest, 1e-3);
  EXPECT_GT(e.errors[0].max_rel, 0.0);
  // Stiffness over strain is a straight line, and so is the program's over its stretch, nearly.
  EXPECT_LT(e.errors[0].rms_rel, 0.1);
  EXPECT_LT(e.errors[1].max_rel, 1e-3);
  EXPECT_GE(e.max_rel, e.errors[0].max_rel);
}

TEST(ArcsimExport, OwnTablesGoBackDigitForDigit) {
  Material m;
  m.law = "arcsim";
  m.areal_density_kg_per_m2 = 0.3;
  arcsim::Tables tables;
  tables.density_kg_per_m2 = 0.3;
  tables.stretching.setConstant(100.1);
  tables.bending.setConstant(1.1e-5);
  m.tables = arcsim::tablesToJson(tables);
  const ExportedMaterial e = exported(m, "arcsim");
  const auto json = nlohmann::json::parse(e.content);
  EXPECT_EQ(json.at("stretching"), m.tables.at("stretching"));
  EXPECT_EQ(json.at("bending"), m.tables.at("bending"));
  EXPECT_EQ(e.max_rel, 0.0);
}

TEST(ArcsimLaw, WeightsAreTwoAltogetherAndTheGridAgreesAtItsNodes) {
  for (const Vec3& green : {Vec3(0.03, -0.01, 0.02), Vec3(-0.2, 0.3, 0.5), Vec3(2.0, 2.0, 5.0)}) {
    double sum = 0.0;
    for (const double w : arcsim::stretchWeights(green)) sum += w;
    EXPECT_NEAR(sum, 2.0, kRounding);
  }
  const Vec3 node(10.0 / 30.0 - 0.25, 8.0 / 30.0 - 0.25, 2.0 * 1.0 / 30.0);
  const auto grid = arcsim::stretchWeights(node), direct = arcsim::stretchWeightsDirect(node);
  for (std::size_t r = 0; r < grid.size(); ++r) EXPECT_NEAR(grid[r], direct[r], 1e-9);
}

TEST(NewtonExport, LinearSoftMaterialIsExact) {
  const ExportedMaterial e = exported(linearMaterial("soft"), "newton");
  EXPECT_LT(e.max_rel, kRounding);
  EXPECT_LT(e.bending_max_rel, kRounding);
  const auto json = nlohmann::json::parse(e.content);
  EXPECT_NEAR(json.at("tri_aniso_ke")[1].get<double>(), kWarp, kRounding * kWarp);
  EXPECT_NEAR(json.at("edge_aniso_ke")[0].get<double>(), kBendWeft / 3, kRounding * kBendWeft);
}

TEST(NewtonExport, StiffeningCostsWhatAConstantMust) {
  const ExportedMaterial e = exported(stiffeningMaterial(), "newton");
  EXPECT_GT(e.errors[0].rms_rel, 0.15);  // 200 to 600 N/m
  EXPECT_LT(e.errors[0].rms_rel, 0.5);
  EXPECT_LT(e.errors[2].max_rel, 1e-3);
}

double setting(const std::string& preset, const std::string& name) {
  const auto at = preset.find("cloth.settings." + name + " = ");
  if (at == std::string::npos) throw std::runtime_error(name + " is not in the preset");
  return std::stod(preset.substr(preset.find('=', at) + 1));
}

TEST(BlenderExport, StiffnessAndMassFollowTheEdge) {
  Material m = linearMaterial("soft");
  m.find("stretch_warp")->curve = StiffnessCurve::constant(kWeft);
  const double bend = 3e-6;
  for (const char* direction : {"bend_weft", "bend_warp"})
    m.find(direction)->curve = StiffnessCurve::constant(bend, true);
  const double h = 0.01;
  const ExportedMaterial e = exported(m, "blender", h);
  // Measured in the program by bench/blender_factors.py.
  EXPECT_NEAR(setting(e.content, "bending_stiffness"), bend / (50 * h * h), 1e-6 * bend / (h * h));
  EXPECT_NEAR(setting(e.content, "tension_stiffness"), kWeft * h / 1000, 1e-6 * kWeft * h / 1000);
  EXPECT_NEAR(setting(e.content, "mass"), 0.2 * h * h, 1e-12);
  EXPECT_NEAR(setting(e.content, "shear_stiffness"), kShear * h / 1000, 1e-4 * kShear * h / 1000);
  // The springs across the quads add the shear modulus to the weft, and couple: known from the
  // lattice, (G, G) over K at small strain.
  EXPECT_NEAR(e.errors[0].rms_rel, std::sqrt(2.0) * kShear / kWeft, 0.03);
  EXPECT_FALSE(exportMaterial(m, **findExportTarget("blender"), {}).ok());
  EXPECT_EQ(exportMaterial(m, **findExportTarget("blender"), {}).error().kind, ErrorKind::kUsage);
}

TEST(BlenderExport, AFabricsNameCannotBecomeCode) {
  Material m = linearMaterial("stvk");
  m.fabric = "x\nimport os\r# y";
  const ExportedMaterial e = exported(m, "blender", 0.01);
  EXPECT_EQ(e.content.find("\nimport os"), std::string::npos);
  EXPECT_EQ(e.content.find('\r'), std::string::npos);
}

TEST(CsvExport, RowsReproduceTheCurve) {
  Material m = stiffeningMaterial();
  const ExportedMaterial e = exported(m, "csv");
  EXPECT_LT(e.max_rel, 1e-12);  // a stiffness that is itself straight, and constants
  std::istringstream lines(e.content);
  std::string line;
  int rows = 0;
  while (std::getline(lines, line)) {
    if (!line.starts_with("stretch_weft,")) continue;
    double strain = 0.0, stiffness = 0.0, stress = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str(), "stretch_weft,%lf,%lf,%lf", &strain, &stiffness, &stress),
              3);
    EXPECT_EQ(stress, m.find("stretch_weft")->curve.evaluate(strain).stress);
    ++rows;
  }
  EXPECT_EQ(rows, 41);
}

TEST(Export, RefusesWhatHasNoContinuousLaw) {
  Material constants;
  constants.law = "edge-hinge";
  constants.areal_density_kg_per_m2 = 0.1;
  add(constants, "edge_stretch", StiffnessCurve::constant(3.0), 0.0);
  add(constants, "hinge_bend", StiffnessCurve::constant(1e-3), 0.0);
  const auto refused = exportMaterial(constants, **findExportTarget("newton"), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("one mesh"));
  EXPECT_THAT(findExportTarget("maya").error().message(), HasSubstr("arcsim blender newton csv"));
}

class StressTest : public ::testing::TestWithParam<const char*> {};

TEST_P(StressTest, OfALawInUniaxialStretchIsItsNominalForceOverStretch) {
  const auto response = SheetResponse::create(linearMaterial(GetParam()), 0.01);
  ASSERT_TRUE(response.ok());
  const double strain = 0.05;
  const Vec3 green = response->greenOf(0, strain);
  const double stretch = std::sqrt(1.0 + 2.0 * green[0]);
  const std::string law = GetParam();
  const double own = law == "stvk" ? kWeft * strain : kWeft * strain / stretch;
  const double stress = response->membraneStress(green)[0];
  if (law == "springs") {
    EXPECT_GT(stress, own);  // the diagonals and the second ring pull along
  } else {
    EXPECT_NEAR(stress, own, kRounding * own);
  }
}

TEST_P(StressTest, IsSymmetricUnderExchangeOfShearDirection) {
  const auto response = SheetResponse::create(linearMaterial(GetParam()), 0.01);
  const Vec3 a = response->membraneStress({0.02, 0.01, 0.05});
  const Vec3 b = response->membraneStress({0.02, 0.01, -0.05});
  EXPECT_NEAR(a[0], b[0], kRounding * a[0]);
  EXPECT_NEAR(a[2], -b[2], kRounding * a[2]);
  EXPECT_NE(a[2], 0.0);
}

INSTANTIATE_TEST_SUITE_P(Laws, StressTest, ::testing::Values("stvk", "soft", "springs"),
                         [](const auto& of) { return std::string(of.param); });

}  // namespace
}  // namespace tenter
