// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "export_loss.h"
#include "export_targets.h"

namespace tenter {

namespace {

constexpr int kPointsPerInterval = 40;
constexpr const char* kMarker = "# tenter stiffness curves";

std::string number(double value) {
  if (std::isnan(value)) return "";
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

/// Strains of the table: all knots and the measured range, with points between, and zero.
std::vector<double> strainsOf(const MaterialComponent& component) {
  std::vector<double> marks = component.curve.strains();
  marks.push_back(0.0);
  marks.push_back(component.observed_min);
  marks.push_back(component.observed_max);
  if (marks.size() == 4 && component.observed_max == component.observed_min) marks.push_back(0.1);
  std::sort(marks.begin(), marks.end());
  marks.erase(std::unique(marks.begin(), marks.end()), marks.end());
  std::vector<double> strains;
  for (std::size_t i = 0; i + 1 < marks.size(); ++i) {
    for (int n = 0; n < kPointsPerInterval; ++n) {
      strains.push_back(marks[i] + (marks[i + 1] - marks[i]) * n / kPointsPerInterval);
    }
  }
  strains.push_back(marks.back());
  return strains;
}

double stdAt(const MaterialComponent& component, double strain) {
  const auto& knots = component.curve.strains();
  const auto found = std::find(knots.begin(), knots.end(), strain);
  if (found == knots.end() || component.knot_std.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return component.knot_std[static_cast<std::size_t>(found - knots.begin())];
}

using Points = std::vector<std::pair<double, double>>;

/// The reader's formula: stiffness by straight lines between rows, constant beyond, times strain.
double interpolatedStress(const Points& points, double strain, bool even) {
  const double at = even ? std::abs(strain) : strain;
  if (at <= points.front().first) return points.front().second * strain;
  if (at >= points.back().first) return points.back().second * strain;
  const auto above = std::upper_bound(points.begin(), points.end(), at,
                                      [](double x, const auto& p) { return x < p.first; });
  const auto& [x1, y1] = *above;
  const auto& [x0, y0] = *(above - 1);
  return (y0 + (y1 - y0) * (at - x0) / (x1 - x0)) * strain;
}

struct ErrorSum {
  double squares = 0.0, largest = 0.0;
  int count = 0;
};

void addError(const MaterialComponent& component, const Points& points, ExportedMaterial& exported,
              ErrorSum& sum) {
  const double from = component.observed_min, to = component.observed_max;
  ErrorSum own;
  for (int i = 1; i <= 200; ++i) {
    const double strain = from + (to - from) * (i - 0.5) / 200.0;
    const double stress = component.curve.evaluate(strain).stress;
    if (stress == 0.0 || to <= from) continue;
    const double relative =
        interpolatedStress(points, strain, component.curve.even()) / stress - 1.0;
    own.squares += relative * relative;
    own.largest = std::max(own.largest, std::abs(relative));
    ++own.count;
  }
  sum.squares += own.squares;
  sum.largest = std::max(sum.largest, own.largest);
  sum.count += own.count;
  const double rms = own.count > 0 ? std::sqrt(own.squares / own.count) : 0.0;
  exported.errors.push_back({component.name, from, to, to > from, rms, own.largest});
}

Result<ExportedMaterial> make(const Material& material, const ExportOptions& /*options*/) {
  if (material.components.empty()) {
    return badInput("", "components", "there are none: the law " + material.law + " is tabulated",
                    "export it to its own format");
  }
  ExportedMaterial exported;
  exported.content = std::string(kMarker) + " of " + material.fabric + ", law " + material.law +
                     "; stress = stiffness x strain, SI units\n" +
                     "component,strain,stiffness,stress,stiffness_std\n";
  ErrorSum sum;
  for (const MaterialComponent& component : material.components) {
    Points points;
    for (const double strain : strainsOf(component)) {
      const CurveValue value = component.curve.evaluate(strain);
      points.emplace_back(strain, value.stiffness);
      exported.content += component.name + "," + number(strain) + "," + number(value.stiffness) +
                          "," + number(value.stress) + "," + number(stdAt(component, strain)) +
                          "\n";
    }
    addError(component, points, exported, sum);
  }
  exported.rms_rel = sum.count > 0 ? std::sqrt(sum.squares / sum.count) : 0.0;
  exported.max_rel = sum.largest;
  exported.bending_rms_rel = exported.bending_max_rel = std::numeric_limits<double>::quiet_NaN();
  exported.lost.emplace_back("the cubic curves become straight lines of stiffness between rows");
  exported.lost.emplace_back("correlations and provenance");
  return exported;
}

}  // namespace

ExportTarget csvExport() {
  return {.id = "csv",
          .description = "stiffness and stress over strain, one row a point (CSV)",
          .file_extension = ".csv",
          .marker = kMarker,
          .make = make};
}

}  // namespace tenter
