// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "material_format.h"

namespace tenter {
namespace {

using Severity = MaterialFinding::Severity;
using Findings = std::vector<MaterialFinding>;

/// A stiffness or eigenvalue below zero by less than this fraction of the largest is rounding.
constexpr double kRoundingFraction = 1e-12;
/// Points along each strain at which the tangent of a coupled law is looked at.
constexpr int kTangentSamples = 9;

/// Values of woven and knitted cloth lie well inside; what lies outside is more often a slip of the
/// unit than a fabric.
constexpr double kUsualMembrane_N_per_m[] = {0.1, 1e6};
constexpr double kUsualBending_N_m[] = {1e-9, 1e-1};
constexpr double kUsualDensity_kg_per_m2[] = {0.005, 3.0};
/// sqrt(12 B / k), the thickness of a solid sheet of the same stretch and bending stiffness [m].
constexpr double kUsualSolidThickness_m[] = {1e-6, 1e-2};

std::string text(double value) {
  std::ostringstream out;
  out.precision(4);
  out << value;
  return out.str();
}

std::string withUnit(double value, std::string_view unit) {
  return unit == "1" ? text(value) : text(value) + " " + std::string(unit);
}

bool outside(double value, const double (&range)[2]) {
  return value < range[0] || value > range[1];
}

double largestStiffness(const StiffnessCurve& curve) {
  double largest = 0.0;
  for (const double k : curve.stiffnesses()) largest = std::max(largest, std::abs(k));
  return largest;
}

void checkCurve(const ComponentInfo& info, const MaterialComponent& component, Findings& out) {
  const StiffnessCurve& curve = component.curve;
  const double largest = largestStiffness(curve);
  const auto say = [&](Severity severity, const std::string& what) {
    out.push_back({severity, component.name, what});
  };
  const auto [strain, minimum] = curve.minimumStiffness();
  if (minimum < -kRoundingFraction * largest && !info.may_be_negative)
    say(Severity::kError, "stiffness falls to " + withUnit(minimum, info.stiffness_unit) +
                              " at strain " + withUnit(strain, info.strain_unit));
  for (const auto& [from, to] : curve.softeningIntervals())
    say(Severity::kWarning, "stress falls while strain grows from " + text(from) + " to " +
                                withUnit(to, info.strain_unit) +
                                "; equilibria there can be unstable");
  if (largest == 0.0 && !info.may_be_negative) say(Severity::kWarning, "has no stiffness at all");
  const bool bending = info.stiffness_unit == "N m";
  if (!info.may_be_negative && largest > 0.0 &&
      (bending ? outside(largest, kUsualBending_N_m) : outside(largest, kUsualMembrane_N_per_m)))
    say(Severity::kNote, "largest stiffness " + withUnit(largest, info.stiffness_unit) +
                             " is unusual for cloth; check the unit");
}

void checkEvidence(const ComponentInfo& info, const MaterialComponent& component, Findings& out) {
  const auto say = [&](Severity severity, const std::string& what) {
    out.push_back({severity, component.name, what});
  };
  if (component.status == ComponentStatus::kUnobserved)
    return say(Severity::kWarning, "no measurement moves with it: its values are a guess");
  if (component.status == ComponentStatus::kAssumed)
    return say(Severity::kNote, "is assumed, not measured");

  const std::vector<double>& strains = component.curve.strains();
  std::string unseen, uncertain;
  for (std::size_t i = 0; i < component.knot_observed.size(); ++i)
    if (!component.knot_observed[i]) unseen += (unseen.empty() ? "" : ", ") + text(strains[i]);
  for (std::size_t i = 0; i < component.knot_std.size(); ++i)
    if (component.knot_std[i] > std::abs(component.curve.stiffnesses()[i]))
      uncertain += (uncertain.empty() ? "" : ", ") + text(strains[i]);
  if (!unseen.empty())
    say(Severity::kWarning, "measurements do not see the knots at strain " + unseen);
  if (!uncertain.empty())
    say(Severity::kWarning, "less certain than its own size at strain " + uncertain);

  const double from = component.observed_min, to = component.observed_max;
  if (from == 0.0 && to == 0.0)
    return say(Severity::kNote, "does not say which strains were measured");
  if (strains.size() > 1 && (strains.front() < from || strains.back() > to))
    say(Severity::kNote, "knots from " + text(strains.front()) + " to " + text(strains.back()) +
                             " reach beyond the measured strains");
  if (!info.constant_only)
    say(Severity::kNote, "measured for strains from " + text(from) + " to " +
                             withUnit(to, info.strain_unit) + "; beyond that it is extrapolated");
}

std::array<double, 2> strainRange(const MaterialComponent& component) {
  const std::vector<double>& strains = component.curve.strains();
  const bool measured = component.observed_min != component.observed_max;
  // Rest belongs to every use of a material.
  return {std::min(0.0, measured ? component.observed_min : strains.front()),
          std::max(0.0, measured ? component.observed_max : strains.back())};
}

/// Smallest eigenvalue of the membrane tangent relative to its largest entry, over a grid of the
/// measured strains.
void checkCoupledTangent(const ClothModel& model, const Material& material, const StrainLaw& law,
                         Findings& out) {
  std::array<std::array<double, 2>, 3> range;
  for (int i = 0; i < 3; ++i)
    range[i] = strainRange(*material.find(std::string(model.component(i).name)));
  const auto relativeMinimum = [&](const Vec3& strain) {
    const Mat3 tangent = law.evaluate(strain, 0).tangent;
    const double scale = std::max(tangent.cwiseAbs().maxCoeff(), 1e-300);
    return Eigen::SelfAdjointEigenSolver<Mat3>(tangent, Eigen::EigenvaluesOnly).eigenvalues()[0] /
           scale;
  };
  const std::string at_rest = "the couplings make the sheet unstable at rest";
  if (relativeMinimum(Vec3::Zero()) < -kRoundingFraction) {
    out.push_back({Severity::kError, "", at_rest});
    return;
  }
  double worst = 0.0;
  Vec3 where = Vec3::Zero();
  const int total = kTangentSamples * kTangentSamples * kTangentSamples;
  for (int n = 0; n < total; ++n) {
    const int index[3] = {n % kTangentSamples, n / kTangentSamples % kTangentSamples,
                          n / (kTangentSamples * kTangentSamples)};
    Vec3 strain;
    for (int i = 0; i < 3; ++i)
      strain[i] = range[i][0] + (range[i][1] - range[i][0]) * index[i] / (kTangentSamples - 1);
    if (const double minimum = relativeMinimum(strain); minimum < worst) {
      worst = minimum;
      where = strain;
    }
  }
  if (worst < -kRoundingFraction)
    out.push_back(
        {Severity::kWarning, "",
         "the membrane tangent is indefinite within the measured strains, worst at weft " +
             text(where[0]) + ", warp " + text(where[1]) + ", shear " + text(where[2]) + " (" +
             text(worst) + " of its largest entry)"});
}

void checkWhole(const ClothModel& model, const Material& material, Findings& out) {
  const auto note = [&](const std::string& what) { out.push_back({Severity::kNote, "", what}); };
  if (model.needs_grid && material.mesh_pattern.empty())
    out.push_back({Severity::kWarning, "",
                   "does not say on which mesh it was fitted, and these numbers hold on no other"});
  else if (model.needs_grid)
    note("holds on its own mesh only: " + material.mesh_pattern);
  if (model.bending == BendingElement::kHinge && material.bending_operator.empty())
    note("does not name the bending operator that it was fitted with");
  const MaterialComponent* const pairs[][2] = {
      {material.find("stretch_weft"), material.find("bend_weft")},
      {material.find("stretch_warp"), material.find("bend_warp")}};
  for (const auto& [stretch, bend] : pairs) {
    if (model.bending != BendingElement::kHinge || stretch == nullptr || bend == nullptr) continue;
    const double k = largestStiffness(stretch->curve), b = largestStiffness(bend->curve);
    if (k == 0.0 || b == 0.0) continue;
    const double thickness = std::sqrt(12.0 * b / k);
    if (outside(thickness, kUsualSolidThickness_m))
      note(stretch->name + " and " + bend->name + " are those of a solid sheet " + text(thickness) +
           " m thick; check the units");
  }
}

void checkDensity(const Material& material, Findings& out) {
  const double density = material.areal_density_kg_per_m2;
  if (density == 0.0)
    out.push_back({Severity::kWarning, "", "has no areal density: it cannot hang under gravity"});
  else if (outside(density, kUsualDensity_kg_per_m2))
    out.push_back(
        {Severity::kNote, "", "areal density " + text(density) + " kg/m^2 is unusual for cloth"});
}

}  // namespace

std::vector<MaterialFinding> checkMaterial(const Material& material) {
  Findings out;
  checkDensity(material, out);
  for (const MaterialComponent& component : material.components) {
    const ComponentInfo info = componentFormat(material.law, component.name);
    checkCurve(info, component, out);
    checkEvidence(info, component, out);
  }
  if (isTabulatedLaw(material.law)) {
    out.push_back(
        {Severity::kNote, "", "is a table of another program: nothing here computes with it"});
    return out;
  }
  const Result<const ClothModel*> model = findClothModel(material.law);
  if (!model.ok()) {
    out.push_back({Severity::kError, "", model.error().message()});
    return out;
  }
  const Result<ClothLaws> laws = makeLaws(**model, material);
  if (!laws.ok()) {
    out.push_back({Severity::kError, "", laws.error().message()});
    return out;
  }
  checkWhole(**model, material, out);
  if ((*model)->membrane_components.size() > 3)
    checkCoupledTangent(**model, material, *laws->membrane, out);
  return out;
}

}  // namespace tenter
