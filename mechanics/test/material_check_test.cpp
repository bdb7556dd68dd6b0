// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sample_material.h"
#include "tenter/mechanics/material.h"

namespace tenter {
namespace {

using Severity = MaterialFinding::Severity;
using test_support::sampleMaterial;
using testing::HasSubstr;

const ClothModel& model(const char* id) { return **findClothModel(id); }

/// A material with nothing to complain of: constants of ordinary cloth, all measured.
Material plain(const char* id) {
  Material material = sampleMaterial(model(id));
  material.covariance.reset();
  for (MaterialComponent& component : material.components) {
    const ComponentInfo& info = model(id).component(model(id).componentIndex(component.name));
    component.curve =
        StiffnessCurve::constant(info.stiffness_unit == "N m" ? 1e-5 : 300.0, info.even);
    if (info.may_be_negative) component.curve = StiffnessCurve::constant(20.0);
    component.coefficients.clear();
    component.knot_std = {0.01 * component.curve.stiffnesses().front()};
    component.knot_observed = {true};
    component.observed_min = 0.0;
    component.observed_max = info.strain_unit == "1/m" ? 50.0 : 0.05;
  }
  return material;
}

MaterialComponent& part(Material& material, const char* name) { return *material.find(name); }

testing::Matcher<MaterialFinding> finding(Severity severity, const std::string& component,
                                          const std::string& text) {
  return testing::AllOf(testing::Field(&MaterialFinding::severity, severity),
                        testing::Field(&MaterialFinding::component, component),
                        testing::Field(&MaterialFinding::text, HasSubstr(text)));
}

int countOf(const std::vector<MaterialFinding>& findings, Severity severity) {
  return static_cast<int>(
      std::count_if(findings.begin(), findings.end(),
                    [&](const MaterialFinding& f) { return f.severity == severity; }));
}

TEST(MaterialCheck, FindsNothingWrongWithPlainMaterialsOfEveryLaw) {
  for (const ClothModel& each : clothModels()) {
    const auto findings = checkMaterial(plain(std::string(each.id).c_str()));
    EXPECT_EQ(countOf(findings, Severity::kError), 0) << each.id;
    EXPECT_EQ(countOf(findings, Severity::kWarning), 0)
        << each.id << ": " << testing::PrintToString(findings.size());
  }
}

TEST(MaterialCheck, FindsNegativeStiffnessBetweenKnots) {
  Material material = plain("stvk");
  part(material, "stretch_warp").curve =
      StiffnessCurve::fromKnots({0, 1}, {100, 100}, {-800, 800}).value();
  EXPECT_THAT(checkMaterial(material), testing::Contains(finding(Severity::kError, "stretch_warp",
                                                                 "-100 N/m at strain 0.5")));
}

TEST(MaterialCheck, FindsFallingStressWithItsInterval) {
  Material material = plain("stvk");
  part(material, "stretch_weft").curve =
      StiffnessCurve::fromKnots({0, 1}, {300, 0}, {-300, -300}).value();
  EXPECT_THAT(checkMaterial(material),
              testing::Contains(finding(Severity::kWarning, "stretch_weft", "from 0.5 to 1;")));
}

TEST(MaterialCheck, TellsWhatNoMeasurementSaw) {
  Material material = plain("stvk");
  part(material, "bend_diagonal").status = ComponentStatus::kUnobserved;
  part(material, "shear").curve = StiffnessCurve::fromKnots({0, 0.1}, {9, 9}, {0, 0}, true).value();
  part(material, "shear").knot_std = {1.0, 20.0};
  part(material, "shear").knot_observed = {true, false};
  part(material, "stretch_weft").status = ComponentStatus::kAssumed;
  const auto findings = checkMaterial(material);
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kWarning, "bend_diagonal", "a guess")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kWarning, "shear", "strain 0.1")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kWarning, "shear", "less certain")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kNote, "shear", "reach beyond")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kNote, "stretch_weft", "assumed")));
  EXPECT_THAT(findings,
              testing::Contains(finding(Severity::kNote, "stretch_warp", "extrapolated")));
}

TEST(MaterialCheck, FindsCouplingsThatAreUnstableAtRest) {
  Material material = plain("stvk-coupled");
  part(material, "poisson").curve = StiffnessCurve::constant(-301.0);  // |c_p| > sqrt(k_u k_v).
  EXPECT_THAT(checkMaterial(material),
              testing::Contains(finding(Severity::kError, "", "unstable at rest")));
  part(material, "poisson").curve = StiffnessCurve::constant(-299.0);
  EXPECT_EQ(countOf(checkMaterial(material), Severity::kError), 0);
}

TEST(MaterialCheck, FindsTangentsThatTurnIndefiniteWithinTheMeasuredStrains) {
  Material material = plain("stvk-coupled");
  part(material, "cross_stiffening").curve = StiffnessCurve::constant(1e5);
  const auto indefinite = finding(Severity::kWarning, "", "indefinite");
  EXPECT_THAT(checkMaterial(material), testing::Contains(indefinite));
  part(material, "shear").observed_max =
      1e-4;  // Its entry c_x e_uv q' is then below the diagonal's.
  EXPECT_THAT(checkMaterial(material), testing::Not(testing::Contains(indefinite)));
}

TEST(MaterialCheck, FindsWhatTheWholeLacks) {
  Material material = plain("stvk");
  material.areal_density_kg_per_m2 = 0.0;
  material.bending_operator.clear();
  auto findings = checkMaterial(material);
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kWarning, "", "areal density")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kNote, "", "bending operator")));
  Material springs = plain("springs");
  springs.mesh_pattern.clear();
  EXPECT_THAT(checkMaterial(springs), testing::Contains(finding(Severity::kWarning, "", "mesh")));
  material.components.pop_back();
  EXPECT_THAT(checkMaterial(material), testing::Contains(finding(Severity::kError, "", "missing")));
  material.law = "none";
  EXPECT_THAT(checkMaterial(material), testing::Contains(finding(Severity::kError, "", "none")));
}

TEST(MaterialCheck, NotesMagnitudesThatSmellOfAnotherUnit) {
  Material material = plain("stvk");
  part(material, "bend_weft").curve = StiffnessCurve::constant(5.0, true);  // mN mm, perhaps.
  part(material, "stretch_warp").curve = StiffnessCurve::constant(0.0);
  material.areal_density_kg_per_m2 = 20.0;
  const auto findings = checkMaterial(material);
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kNote, "bend_weft", "check the unit")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kNote, "", "m thick")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kNote, "", "areal density 20")));
  EXPECT_THAT(findings, testing::Contains(finding(Severity::kWarning, "stretch_warp", "no stiff")));
}

}  // namespace
}  // namespace tenter
