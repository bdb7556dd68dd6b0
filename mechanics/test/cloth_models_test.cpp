// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/cloth_models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "sample_material.h"

namespace tenter {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> componentNames(const char* id) {
  const ClothModel& model = **findClothModel(id);
  std::vector<std::string> names;
  for (int i = 0; i < model.componentCount(); ++i) names.emplace_back(model.component(i).name);
  return names;
}

TEST(ClothModels, AreTheDocumentedOnes) {
  std::vector<std::string> ids;
  for (const ClothModel& model : clothModels()) ids.emplace_back(model.id);
  EXPECT_THAT(ids, ElementsAre("springs", "soft", "stvk", "stvk-coupled", "edge-hinge"));
  for (const char* id : {"springs", "soft", "stvk"})
    EXPECT_THAT(componentNames(id), ElementsAre("stretch_weft", "stretch_warp", "shear",
                                                "bend_weft", "bend_warp", "bend_diagonal"));
  EXPECT_THAT(componentNames("stvk-coupled"),
              ElementsAre("stretch_weft", "stretch_warp", "shear", "poisson", "cross_stiffening",
                          "bend_weft", "bend_warp", "bend_diagonal"));
  EXPECT_THAT(componentNames("edge-hinge"), ElementsAre("edge_stretch", "hinge_bend"));
}

TEST(ClothModels, UnknownNameIsAnsweredWithTheKnownOnes) {
  const auto found = findClothModel("stkv");
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error().message(), HasSubstr("stkv"));
  for (const ClothModel& model : clothModels())
    EXPECT_THAT(found.error().message(), HasSubstr(std::string(model.id)));
}

class ClothModelTest : public testing::TestWithParam<const ClothModel*> {
 protected:
  const ClothModel& model() const { return *GetParam(); }
};

TEST_P(ClothModelTest, RowIsComplete) {
  EXPECT_EQ(*findClothModel(model().id), &model());
  EXPECT_FALSE(model().description.empty());
  EXPECT_FALSE(model().source.empty());
  EXPECT_LE(model().bending_components.size(), 3u);
  std::set<std::string_view> names;
  for (int i = 0; i < model().componentCount(); ++i) {
    const ComponentInfo& info = model().component(i);
    EXPECT_TRUE(names.insert(info.name).second);
    EXPECT_EQ(model().componentIndex(info.name), i);
    EXPECT_FALSE(info.strain_measure.empty());
    EXPECT_THAT(info.strain_unit, testing::AnyOf("1", "1/m"));
    EXPECT_THAT(info.stiffness_unit, testing::AnyOf("N/m", "N m"));
    EXPECT_FALSE(info.even && info.constant_only);
  }
  EXPECT_EQ(model().componentIndex("none"), -1);
  EXPECT_THROW((void)model().component(-1), std::invalid_argument);
  EXPECT_THROW((void)model().component(model().componentCount()), std::invalid_argument);
}

TEST_P(ClothModelTest, LawsFromAMaterialAreThoseFromItsCurves) {
  const Material material = test_support::sampleMaterial(model(), 3);
  const ClothLaws direct = makeLaws(model(), test_support::sampleComponents(model(), 3));
  const auto read = makeLaws(model(), material);
  ASSERT_TRUE(read.ok()) << read.error().message();
  const Vec3 strain(0.05, 0.1, -0.02), curvature(20.0, -3.0, 8.0);
  EXPECT_EQ(read->membrane->evaluate(strain, 0).energy,
            direct.membrane->evaluate(strain, 0).energy);
  EXPECT_EQ(read->bending->evaluate(curvature, 0).energy,
            direct.bending->evaluate(curvature, 0).energy);
  EXPECT_GT(direct.membrane->evaluate(strain, 0).energy, 0.0);
  EXPECT_GT(direct.bending->evaluate(curvature, 0).energy, 0.0);
}

TEST_P(ClothModelTest, EveryComponentMovesExactlyOneLaw) {
  const std::vector<ComponentCurve> base = test_support::sampleComponents(model(), 3);
  const ClothLaws before = makeLaws(model(), base);
  const Vec3 strain(0.05, 0.1, -0.02), curvature(20.0, -3.0, 8.0);
  for (int i = 0; i < model().componentCount(); ++i) {
    std::vector<ComponentCurve> changed = base;
    changed[i].curve = base[i].curve.scaled(2.0);
    const ClothLaws after = makeLaws(model(), changed);
    const bool membrane =
        after.membrane->evaluate(strain, 0).energy != before.membrane->evaluate(strain, 0).energy;
    const bool bending = after.bending->evaluate(curvature, 0).energy !=
                         before.bending->evaluate(curvature, 0).energy;
    EXPECT_EQ(membrane, i < static_cast<int>(model().membrane_components.size()));
    EXPECT_NE(membrane, bending) << model().component(i).name;
  }
}

TEST_P(ClothModelTest, RefusesMissingUnknownAndDoubleComponents) {
  const Material good = test_support::sampleMaterial(model());
  const auto reason = [&](const Material& material) {
    const auto laws = makeLaws(model(), material);
    return laws.ok() ? std::string() : laws.error().message();
  };
  Material missing = good;
  missing.components.pop_back();
  EXPECT_THAT(reason(missing), HasSubstr("missing"));
  Material unknown = good;
  unknown.components.front().name = "sheer";
  EXPECT_THAT(reason(unknown), HasSubstr("sheer"));
  Material twice = good;
  twice.components.push_back(twice.components.front());
  EXPECT_THAT(reason(twice), HasSubstr("twice"));
  Material other = good;
  other.law = "other";
  EXPECT_THAT(reason(other), HasSubstr("other"));
}

TEST_P(ClothModelTest, RefusesCurvesOfTheWrongKind) {
  for (int i = 0; i < model().componentCount(); ++i) {
    const ComponentInfo& info = model().component(i);
    Material material = test_support::sampleMaterial(model());
    material.components[i].curve =
        StiffnessCurve::fromKnots({0, 1}, {1, 1}, {0, 0}, !info.even).value();
    EXPECT_FALSE(makeLaws(model(), material).ok()) << info.name;
    material.components[i].curve = StiffnessCurve::constant(1.0, !info.even);
    EXPECT_TRUE(makeLaws(model(), material).ok()) << "a constant is both";
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, ClothModelTest, testing::ValuesIn([] {
                           std::vector<const ClothModel*> models;
                           for (const ClothModel& model : clothModels()) models.push_back(&model);
                           return models;
                         }()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace tenter
