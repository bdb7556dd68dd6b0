// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <sstream>

#include "sample_material.h"
#include "tenter/mechanics/material.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using Json = nlohmann::json;
using test_support::sampleMaterial;
using test_support::TemporaryFolder;
using testing::HasSubstr;

/// The same polynomials summed in another order, some tens of operations each.
constexpr double kOtherOrder = 1e-12;

std::filesystem::path formats() { return test_support::sourceFolder() / "docs/formats"; }

std::string identifier(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return text;
}

class MaterialFileTest : public testing::TestWithParam<const ClothModel*> {};

void expectSameBits(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE(std::bit_cast<std::uint64_t>(a[i]) == std::bit_cast<std::uint64_t>(b[i]) ||
                (std::isnan(a[i]) && std::isnan(b[i])));
}

TEST_P(MaterialFileTest, ComesBackBitForBit) {
  const TemporaryFolder folder;
  Material material = sampleMaterial(*GetParam(), 9);
  material.components[0].curve = material.components[0].curve.scaled(1.0 + 1e-16 * 3);
  ASSERT_TRUE(writeMaterial(folder / "m.json", material).ok());
  const auto read = readMaterial(folder / "m.json");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->fabric, material.fabric);
  EXPECT_EQ(read->law, material.law);
  EXPECT_EQ(read->variant, material.variant);
  EXPECT_EQ(read->mesh_pattern, material.mesh_pattern);
  EXPECT_EQ(read->bending_operator, material.bending_operator);
  EXPECT_EQ(read->fit, material.fit);
  EXPECT_EQ(read->provenance, material.provenance);
  EXPECT_TRUE(read->tables.is_null());
  expectSameBits({read->areal_density_kg_per_m2, read->thickness_m},
                 {material.areal_density_kg_per_m2, material.thickness_m});
  EXPECT_EQ(read->covariance->labels, material.covariance->labels);
  EXPECT_EQ(read->covariance->covariance, material.covariance->covariance);
  ASSERT_EQ(read->components.size(), material.components.size());
  for (std::size_t i = 0; i < material.components.size(); ++i) {
    const MaterialComponent &a = read->components[i], &b = material.components[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.curve.even(), b.curve.even());
    EXPECT_EQ(a.knot_observed, b.knot_observed);
    expectSameBits(a.curve.strains(), b.curve.strains());
    expectSameBits(a.curve.stiffnesses(), b.curve.stiffnesses());
    expectSameBits(a.curve.tangents(), b.curve.tangents());
    expectSameBits(a.coefficients, b.coefficients);
    expectSameBits(a.knot_std, b.knot_std);
    expectSameBits({a.observed_min, a.observed_max}, {b.observed_min, b.observed_max});
  }
}

TEST_P(MaterialFileTest, FollowsItsSchema) {
  const auto errors = test_support::schemaErrors(materialToJson(sampleMaterial(*GetParam())),
                                                 formats() / "material.schema.json");
  EXPECT_THAT(errors, testing::IsEmpty());
}

TEST_P(MaterialFileTest, PythonReaderFindsTheSameCurve) {
  const TemporaryFolder folder;
  const Material material = sampleMaterial(*GetParam());
  ASSERT_TRUE(writeMaterial(folder / "m.json", material).ok());
  for (const MaterialComponent& component : material.components) {
    const double last = std::max(component.curve.strains().back(), 0.1);
    const std::vector<double> strains = {-0.4 * last, 0.3 * last, 0.77 * last, 1.5 * last};
    std::ostringstream command;
    command.precision(17);
    command << "/usr/bin/python3 " << formats() / "python/read_material.py"
            << " " << folder / "m.json"
            << " " << component.name;
    for (const double strain : strains) command << " " << strain;
    FILE* pipe = popen(command.str().c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    std::vector<std::array<double, 4>> rows(strains.size());
    int fields = 0;
    for (auto& row : rows)
      fields += std::fscanf(pipe, "%lf %lf %lf %lf", &row[0], &row[1], &row[2], &row[3]);
    ASSERT_EQ(WEXITSTATUS(pclose(pipe)), 0);
    ASSERT_EQ(fields, 16);
    for (const auto& [strain, k, stress, energy] : rows) {
      const CurveValue value = component.curve.evaluate(strain);
      EXPECT_NEAR(k, value.stiffness, kOtherOrder * std::abs(value.stiffness));
      EXPECT_NEAR(stress, value.stress, kOtherOrder * std::abs(value.stress));
      EXPECT_NEAR(energy, value.energy, kOtherOrder * std::abs(value.energy));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, MaterialFileTest, testing::ValuesIn([] {
                           std::vector<const ClothModel*> models;
                           for (const ClothModel& model : clothModels()) models.push_back(&model);
                           return models;
                         }()),
                         [](const auto& one) { return identifier(std::string(one.param->id)); });

const ClothModel& stvk() { return **findClothModel("stvk"); }

/// A good file with one thing broken, and what the error must name.
struct Broken {
  std::string name;
  std::function<void(Json&)> breakIt;
  std::string place, reason;
};

void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.name; }

std::vector<Broken> brokenFiles() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto c0 = [](Json& j) -> Json& { return j["components"][0]; };
  const auto knot = [](Json& j) -> Json& { return j["components"][0]["knots"][1]; };
  return {
      {"no version", [](Json& j) { j.erase("schema_version"); }, "schema_version", "missing"},
      {"newer version", [](Json& j) { j["schema_version"] = 2; }, "schema_version", "newer"},
      {"version a text", [](Json& j) { j["schema_version"] = "1"; }, "schema_version", "whole"},
      {"not an object", [](Json& j) { j = Json::array(); }, "", "object"},
      {"unknown law", [](Json& j) { j["law"] = "stkv"; }, "law", "stvk-coupled"},
      {"unknown variant", [](Json& j) { j["variant"] = "cubic"; }, "variant", "cubic"},
      {"no density", [](Json& j) { j.erase("areal_density_kg_per_m2"); }, "areal_density_kg_per_m2",
       "missing"},
      {"negative density", [](Json& j) { j["areal_density_kg_per_m2"] = -0.1; },
       "areal_density_kg_per_m2", "at least"},
      {"density in g per m2", [](Json& j) { j["areal_density_kg_per_m2"] = 150.0; },
       "areal_density_kg_per_m2", "unit"},
      {"thickness in mm", [](Json& j) { j["thickness_m"] = 0.31; }, "thickness_m", "unit"},
      {"components no list", [](Json& j) { j["components"] = 3; }, "components", "list"},
      {"component no object", [](Json& j) { j["components"][2] = 3; }, "components[2]", "object"},
      {"component missing", [](Json& j) { j["components"].erase(4); }, "components", "bend_warp"},
      {"component unknown", [=](Json& j) { c0(j)["name"] = "stretch_wefft"; }, "components[0].name",
       "stretch_wefft"},
      {"component twice", [](Json& j) { j["components"].push_back(j["components"][0]); },
       "components[6].name", "stretch_weft"},
      {"status unknown", [=](Json& j) { c0(j)["status"] = "maybe"; }, "components[0].status",
       "maybe"},
      {"strain in percent", [=](Json& j) { c0(j)["strain_unit"] = "%"; },
       "components[0].strain_unit", "%"},
      {"stiffness in N per mm", [=](Json& j) { c0(j)["stiffness_unit"] = "N/mm"; },
       "components[0].stiffness_unit", "N/mm"},
      {"strains of 1000 percent", [=](Json& j) { knot(j)["strain"] = 30.0; },
       "components[0].knots[1].strain", "unit"},
      {"other tangent rule", [=](Json& j) { c0(j)["tangent_rule"] = "catmull-rom"; },
       "components[0].tangent_rule", "hermite"},
      {"no knots", [=](Json& j) { c0(j)["knots"] = Json::array(); }, "components[0].knots", "1 to"},
      {"knots missing", [=](Json& j) { c0(j).erase("knots"); }, "components[0].knots", "missing"},
      {"NaN stiffness", [=](Json& j) { knot(j)["stiffness"] = nan; },
       "components[0].knots[1].stiffness", "finite"},
      {"null tangent", [=](Json& j) { knot(j)["tangent"] = nullptr; },
       "components[0].knots[1].tangent", "null"},
      {"strains fall", [=](Json& j) { knot(j)["strain"] = -1.0; }, "components[0].knots",
       "do not increase"},
      {"negative std", [=](Json& j) { knot(j)["std"] = -1.0; }, "components[0].knots[1].std",
       "at least"},
      {"std at some knots", [=](Json& j) { knot(j).erase("std"); }, "components[0].knots[1].std",
       "some knots"},
      {"observed at some knots", [=](Json& j) { knot(j).erase("observed"); },
       "components[0].knots[1].observed", "some knots"},
      {"even with a slope", [](Json& j) { j["components"][2]["knots"][0]["tangent"] = 1.0; },
       "components[2].knots", "even"},
      {"shear not even", [](Json& j) { j["components"][2]["even"] = false; }, "components[2]",
       "need 5"},
      {"shear not even, no coefficients",
       [](Json& j) {
         j["components"][2]["even"] = false;
         j["components"][2].erase("coefficients");
       },
       "shear", "must be an even curve"},
      {"coefficient missing", [=](Json& j) { c0(j)["coefficients"].erase(0); },
       "components[0].coefficients", "need 6"},
      {"coefficients contradict", [=](Json& j) { c0(j)["coefficients"][0] = 1.0; },
       "components[0].coefficients", "contradict"},
      {"observed range turned",
       [=](Json& j) {
         c0(j)["observed_strain"] = {0.2, 0.1};
       },
       "components[0].observed_strain", "before"},
      {"covariance label", [](Json& j) { j["covariance"]["labels"][0] = "stretch_weft[99]"; },
       "covariance.labels[0]", "no coefficient"},
      {"covariance label without index", [](Json& j) { j["covariance"]["labels"][0] = "shear"; },
       "covariance.labels[0]", "no coefficient"},
      {"covariance not square", [](Json& j) { j["covariance"]["matrix"].erase(0); },
       "covariance.matrix", "rows"},
      {"covariance not symmetric", [](Json& j) { j["covariance"]["matrix"][1][0] = 0.2; },
       "covariance.matrix[1][0]", "mirror"},
      {"negative variance", [](Json& j) { j["covariance"]["matrix"][1][1] = -1.0; },
       "covariance.matrix[1][1]", "negative"},
      {"correlation beyond one",
       [](Json& j) { j["covariance"]["matrix"][1][0] = j["covariance"]["matrix"][0][1] = 9.0; },
       "covariance.matrix[1][0]", "correlation"},
      {"tables of another law", [](Json& j) { j["tables"] = Json::object(); }, "tables", "stvk"},
      {"tabulated without tables", [](Json& j) { j["law"] = "arcsim"; }, "tables", "object"},
  };
}

class BrokenMaterialTest : public testing::TestWithParam<Broken> {};

TEST_P(BrokenMaterialTest, IsRefusedWithPlaceAndReason) {
  const Json good = materialToJson(sampleMaterial(stvk()));
  ASSERT_TRUE(materialFromJson(good, "m.json").ok());
  Json broken = good;
  GetParam().breakIt(broken);
  const auto read = materialFromJson(broken, "m.json");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
  EXPECT_EQ(read.error().file, "m.json");
  EXPECT_THAT(read.error().place, HasSubstr(GetParam().place));
  EXPECT_THAT(read.error().message(), HasSubstr(GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(All, BrokenMaterialTest, testing::ValuesIn(brokenFiles()),
                         [](const auto& one) { return identifier(one.param.name); });

TEST(MaterialFile, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  const std::string text = materialToJson(sampleMaterial(stvk())).dump(2);
  for (std::size_t length = 0; length < text.size(); length += 97) {
    const auto read = readMaterial(folder.write("cut.json", text.substr(0, length)));
    ASSERT_FALSE(read.ok()) << length;
    EXPECT_EQ(read.error().file, (folder / "cut.json").string());
  }
}

TEST(MaterialFile, EveryFieldOfEveryKindIsReadOrRefusedWithoutHarm) {
  // Each value of the file in turn becomes each of these; the reader must answer, whatever it
  // answers.
  const Json good = materialToJson(sampleMaterial(**findClothModel("stvk-coupled"))).flatten();
  const std::array<Json, 7> poisons = {Json(nullptr),
                                       Json(true),
                                       Json("text"),
                                       Json(-1e308),
                                       Json(1e-320),
                                       Json(-7),
                                       Json(18446744073709551615U)};
  int refused = 0;
  for (const auto& [path, value] : good.items())
    for (const Json& poison : poisons) {
      Json broken = good;
      broken[path] = poison;
      const auto read = materialFromJson(broken.unflatten(), "m.json");
      refused += read.ok() ? 0 : 1;
      if (read.ok()) (void)checkMaterial(*read);
    }
  EXPECT_GT(refused, static_cast<int>(good.size()));
}

TEST(MaterialFile, UnknownKeysAndAbsentOptionsAreFine) {
  Json json = materialToJson(sampleMaterial(stvk()));
  json["remark"] = "from the third roll";
  for (const char* key : {"thickness_m", "mesh_pattern", "bending_operator", "covariance", "fit",
                          "provenance", "variant"})
    json.erase(key);
  for (Json& component : json["components"]) {
    component.erase("coefficients");
    component.erase("observed_strain");
    for (Json& knot : component["knots"]) {
      knot.erase("std");
      knot.erase("observed");
    }
  }
  const auto read = materialFromJson(json, "m.json");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_FALSE(read->covariance.has_value());
  EXPECT_TRUE(read->components[0].knot_std.empty());
  EXPECT_TRUE(read->components[0].knot_observed.empty());
}

TEST(MaterialFile, TabulatedLawsCarryTheirTables) {
  const TemporaryFolder folder;
  Material material;
  material.fabric = "denim";
  material.law = "arcsim";
  material.areal_density_kg_per_m2 = 0.4;
  material.tables = {{"stretching", {{1.0, 2.0}, {3.0, 4.0}}}};
  ASSERT_TRUE(writeMaterial(folder / "m.json", material).ok());
  const auto read = readMaterial(folder / "m.json");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->tables, material.tables);
  EXPECT_TRUE(read->components.empty());
  EXPECT_THAT(
      test_support::schemaErrors(materialToJson(material), formats() / "material.schema.json"),
      testing::IsEmpty());
}

TEST(MaterialFile, WhatCannotBeReadIsNotWritten) {
  const TemporaryFolder folder;
  Material material = sampleMaterial(stvk());
  material.areal_density_kg_per_m2 = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(writeMaterial(folder / "m.json", material).ok());
  material = sampleMaterial(stvk());
  material.components.pop_back();
  EXPECT_FALSE(writeMaterial(folder / "m.json", material).ok());
  material = sampleMaterial(stvk());
  material.fabric = "\xff\xfe";
  EXPECT_FALSE(writeMaterial(folder / "m.json", material).ok());
  EXPECT_THAT(test_support::listFolder(folder.path()), testing::IsEmpty());
}

TEST(MaterialFile, FailureLeavesTheOldFile) {
  const TemporaryFolder folder;
  const Material good = sampleMaterial(stvk());
  ASSERT_TRUE(writeMaterial(folder / "m.json", good).ok());
  Material bad = good;
  bad.areal_density_kg_per_m2 = -1.0;
  EXPECT_FALSE(writeMaterial(folder / "m.json", bad).ok());
  EXPECT_TRUE(readMaterial(folder / "m.json").ok());
  EXPECT_EQ(test_support::listFolder(folder.path()), std::vector<std::string>{"m.json"});
}

}  // namespace
}  // namespace tenter
