// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_output.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace tenter {
namespace {

std::string bendingOperator(BendingElement element) {
  switch (element) {
    case BendingElement::kHinge:
      return "hinge-midedge";
    case BendingElement::kSprings:
      return "springs-ring2";
    case BendingElement::kRawHinge:
      return "hinge-raw";
  }
  return "";
}

std::string meshPattern(const FitTestOptions& options) {
  const std::string nodes = std::to_string(options.nodes);
  const bool uniform = options.diagonals == DiagonalPattern::kUniform;
  return std::string("grid ") + nodes + "x" + nodes + (uniform ? " uniform" : " alternating");
}

bool contains(const std::vector<int>& values, int value) {
  return std::ranges::find(values, value) != values.end();
}

/// Place of a component among its group's members.
std::size_t placeOf(const ParameterGroup& group, int component) {
  return static_cast<std::size_t>(std::ranges::find(group.members, component) -
                                  group.members.begin());
}

void addKnotStatistics(MaterialComponent& component, const KnotStatistics& knots, double factor) {
  for (Eigen::Index i = 0; i < knots.value.size(); ++i) {
    component.knot_observed.push_back(knots.observed[i]);
    component.knot_std.push_back(knots.observed[i] ? factor * knots.std[i]
                                                   : std::numeric_limits<double>::quiet_NaN());
  }
  const bool any = std::ranges::find(knots.observed, true) != knots.observed.end();
  component.status = any ? ComponentStatus::kFitted : ComponentStatus::kUnobserved;
}

std::vector<int> allTests(const FitRun& run) {
  std::vector<int> tests(run.roles().size());
  for (std::size_t t = 0; t < tests.size(); ++t) tests[t] = static_cast<int>(t);
  return tests;
}

MaterialComponent componentOf(const FitRun& run, const FitState& state, const FitSpace& space,
                              const FitStatistics* statistics, const Eigen::VectorXd& z, int c) {
  const int g = state.groupOf(c);
  const ParameterGroup& group = state.groups[g];
  const std::size_t place = placeOf(group, c);
  const ComponentCurve curve = state.componentCurve(c);
  MaterialComponent component;
  component.name = std::string(state.model->component(c).name);
  component.curve = curve.curve;
  const Eigen::VectorXd coefficients = group.factors[place] * group.coefficients;
  component.coefficients.assign(coefficients.begin(), coefficients.end());
  const StrainRange range = run.rangeOf(c, allTests(run));
  component.observed_min = range.begin;
  component.observed_max = range.end;
  const bool assumed = static_cast<int>(place) >= group.assumed_from;
  if (assumed || !contains(space.groups(), g)) return component;  // stays kAssumed
  component.status = ComponentStatus::kFitted;
  if (statistics)
    addKnotStatistics(
        component, knotStatistics(space, z, statistics->covariance, statistics->data_covariance, g),
        group.factors[place]);
  return component;
}

ParameterCovariance covarianceOf(const FitSpace& space, const FitStatistics& statistics) {
  const Eigen::VectorXd scale = space.scales();
  ParameterCovariance result{
      .labels = space.labels(),
      .covariance = scale.asDiagonal() * statistics.covariance * scale.asDiagonal()};
  // Rows of what the data do not see are left out of the file's promise.
  for (Eigen::Index i = 0; i < scale.size(); ++i)
    if (statistics.data_covariance(i, i) > kUnseenCoefficientVariance) {
      result.covariance.row(i).setZero();
      result.covariance.col(i).setZero();
    }
  return result;
}

}  // namespace

Material materialOf(const FitRun& run, const FitState& state, const FitSpace& space,
                    const FitStatistics* statistics, const Eigen::VectorXd& z,
                    const std::vector<Measurement>& measurements, const FitOptions& options) {
  Material material;
  material.fabric = measurements.front().fabric;
  material.law = std::string(state.model->id);
  material.variant = variantName(options.variant);
  for (const Measurement& m : measurements) {
    material.areal_density_kg_per_m2 +=
        m.areal_density_kg_per_m2 / static_cast<double>(measurements.size());
    material.thickness_m = std::max(material.thickness_m, m.thickness_m);
  }
  for (int c = 0; c < state.model->componentCount(); ++c)
    material.components.push_back(componentOf(run, state, space, statistics, z, c));
  material.mesh_pattern = meshPattern(options.test);
  material.bending_operator = bendingOperator(state.model->bending);
  if (statistics) material.covariance = covarianceOf(space, *statistics);
  material.provenance = provenanceJson(measurements, options);
  return material;
}

nlohmann::json assumptionsJson(const FitState& state, const std::vector<int>& refined_groups) {
  nlohmann::json list = nlohmann::json::array();
  for (int g = 0; g < static_cast<int>(state.groups.size()); ++g) {
    const ParameterGroup& group = state.groups[g];
    if (!contains(refined_groups, g)) {
      for (const int c : group.members)
        list.push_back({{"component", state.model->component(c).name},
                        {"rule", "no measurement sees it: an ordinary value was put in"}});
      continue;
    }
    for (std::size_t i = group.assumed_from; i < group.members.size(); ++i)
      list.push_back({{"component", state.model->component(group.members[i]).name},
                      {"rule", "follows another component that was measured"},
                      {"follows", state.groupName(g)},
                      {"factor", group.factors[i]}});
  }
  return list;
}

nlohmann::json provenanceJson(const std::vector<Measurement>& measurements,
                              const FitOptions& options) {
  nlohmann::json json = {{"program", "tenter"},
                         {"version", TENTER_VERSION},
                         {"measurements", nlohmann::json::array()}};
  for (const Measurement& m : measurements)
    json["measurements"].push_back({{"name", m.name},
                                    {"specimen", m.specimen},
                                    {"protocol", m.protocol},
                                    {"sha256", m.content_sha256}});
  json["options"] = {{"model", options.model},
                     {"variant", variantName(options.variant)},
                     {"nodes", options.test.nodes},
                     {"max_frames", options.test.max_frames},
                     {"max_knots", options.max_knots},
                     {"knot_improvement", options.knot_improvement},
                     {"max_outer_iterations", options.max_outer_iterations}};
  return json;
}

}  // namespace tenter
