// SPDX-License-Identifier: GPL-3.0-or-later
#include "export_loss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tenter {

namespace {

// Below this fraction of a component's largest stress a relative error means nothing.
constexpr double kNegligible = 1e-6;

struct Sum {
  double squares = 0.0, largest = 0.0;
  int count = 0;

  void add(double relative) {
    squares += relative * relative;
    largest = std::max(largest, std::abs(relative));
    ++count;
  }
  double rms() const {
    return count == 0 ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(squares / count);
  }
  double max() const { return count == 0 ? std::numeric_limits<double>::quiet_NaN() : largest; }
};

void membraneErrors(ExportedMaterial& exported, const SheetResponse& response,
                    const StressFunction& stress) {
  const auto samples = response.membraneSamples();
  Sum all;
  for (int component = 0; component < 3; ++component) {
    double largest = 0.0;
    for (const auto& sample : samples) {
      if (sample.component == component) largest = std::max(largest, sample.stress.norm());
    }
    Sum sum;
    for (const auto& sample : samples) {
      const double size = sample.stress.norm();
      if (sample.component != component || size <= kNegligible * largest) continue;
      const double relative = (stress(sample.green) - sample.stress).norm() / size;
      sum.add(relative);
      all.add(relative);
    }
    const auto window = response.window(kMembraneNames[component]);
    exported.errors.push_back(
        {kMembraneNames[component], window.min, window.max, window.measured, sum.rms(), sum.max()});
  }
  exported.rms_rel = all.rms();
  exported.max_rel = all.max();
}

void bendingErrors(ExportedMaterial& exported, const SheetResponse& response,
                   const MomentFunction& moment) {
  Sum all;
  for (int component = 0; component < 2 && response.bends() && moment; ++component) {
    const double angle = component == 0 ? 0.0 : 0.5 * std::numbers::pi;
    const auto curvatures = response.curvatures(kBendNames[component]);
    double largest = 0.0;
    for (const double kappa : curvatures) {
      largest = std::max(largest, std::abs(response.cylinderMoment(angle, kappa)));
    }
    Sum sum;
    for (const double kappa : curvatures) {
      const double own = response.cylinderMoment(angle, kappa);
      if (std::abs(own) <= kNegligible * largest) continue;
      const double relative = moment(angle, kappa) / own - 1.0;
      sum.add(relative);
      all.add(relative);
    }
    exported.errors.push_back({kBendNames[component], 0.0, curvatures.back(),
                               response.window(kBendNames[component]).measured, sum.rms(),
                               sum.max()});
  }
  exported.bending_rms_rel = all.rms();
  exported.bending_max_rel = all.max();
}

}  // namespace

void setErrors(ExportedMaterial& exported, const SheetResponse& response,
               const StressFunction& stress, const MomentFunction& moment) {
  membraneErrors(exported, response, stress);
  bendingErrors(exported, response, moment);
}

double bestConstant(const std::vector<double>& shape, const std::vector<double>& value) {
  double numerator = 0.0, denominator = 0.0;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (value[i] == 0.0) continue;
    const double ratio = shape[i] / value[i];
    numerator += ratio;
    denominator += ratio * ratio;
  }
  return denominator > 0.0 ? numerator / denominator : 0.0;
}

void noteWindow(ExportedMaterial& exported, const SheetResponse& response) {
  std::string assumed;
  for (const ExportError& error : exported.errors) {
    if (!error.measured) assumed += (assumed.empty() ? "" : ", ") + error.component;
  }
  if (!assumed.empty()) {
    exported.lost.push_back("the material does not say what strains of " + assumed +
                            " were measured; the errors are over a default range");
  }
  for (const char* name : kMembraneNames) {
    const MaterialComponent* component = response.material().find(name);
    if (component != nullptr && component->status == ComponentStatus::kUnobserved) {
      exported.lost.push_back(std::string(name) +
                              " was not seen by any measurement; the exported number is a guess");
    }
  }
  // Targets take no negative stiffness; what they make of it is not what the material says.
  for (const MaterialFinding& finding : checkMaterial(response.material())) {
    if (finding.severity != MaterialFinding::Severity::kError) continue;
    exported.lost.push_back(finding.component + ": " + finding.text);
  }
  exported.lost.emplace_back("standard deviations, correlations and provenance");
}

}  // namespace tenter
