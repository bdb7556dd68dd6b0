// SPDX-License-Identifier: GPL-3.0-or-later
#include "sheet_response.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tenter {

namespace {

constexpr int kSamples = 64;
// Where a material does not say what was measured: stretch, shear, curvature [1/m].
constexpr double kDefaultStretch = 0.05, kDefaultShear = 0.1, kDefaultCurvature_per_m = 100.0;
constexpr int kShear = 2;
constexpr int kDiagonal = 2;

double stretchOf(double green) { return std::sqrt(std::max(1.0 + 2.0 * green, 1e-12)); }

}  // namespace

Result<SheetResponse> SheetResponse::create(const Material& material,
                                            std::optional<double> edge_m) {
  const auto model = findClothModel(material.law);
  if (!model.ok()) {
    return badInput("", "law", "is " + material.law + ", which has no continuous law to export",
                    "only its own format can take it");
  }
  if ((*model)->membrane == MembraneElement::kEdges) {
    return badInput("", "law", "is " + material.law + ", two constants that hold on one mesh only",
                    "fit stvk or soft to export");
  }
  auto laws = makeLaws(**model, material);
  if (!laws) return laws.error();
  SheetResponse response(material);
  response.membrane_ = (*model)->membrane;
  response.laws_ = *laws;
  response.springs_ = (*model)->bending == BendingElement::kSprings;
  response.edge_m_ = edge_m.value_or(0.0);
  response.bends_ = !response.springs_ || edge_m.has_value();
  return response;
}

Vec3 SheetResponse::lawStrain(const Vec3& green, Mat3* by_green) const {
  if (membrane_ == MembraneElement::kStvk) {
    if (by_green != nullptr) by_green->setIdentity();
    return green;
  }
  const double u = stretchOf(green[0]), v = stretchOf(green[1]);
  if (by_green != nullptr) *by_green = Vec3(1.0 / u, 1.0 / v, 1.0).asDiagonal();
  return {u - 1.0, v - 1.0, green[2]};
}

/// Per area: one weft and one warp spring of each ring, and half of each of the two diagonals,
/// since a diagonal spring takes half of its quad [Est12] sec. 4.1. Quads are square.
Vec3 SheetResponse::springStress(const Vec3& green) const {
  const double u = stretchOf(green[0]), v = stretchOf(green[1]);
  const double rise = stretchOf(0.5 * (green[0] + green[1] + green[2]));
  const double fall = stretchOf(0.5 * (green[0] + green[1] - green[2]));
  Vec3 stress = Vec3::Zero();
  for (const StrainLaw* law : {laws_.membrane.get(), laws_.bending.get()}) {
    const Vec3 along = law->evaluate(Vec3(u - 1.0, v - 1.0, rise - 1.0), 0).stress;
    const double falling = law->evaluate(Vec3(0.0, 0.0, fall - 1.0), 0).stress[kDiagonal];
    const double rising = 0.5 * along[kDiagonal] * 0.5 / rise;
    const double sinking = 0.5 * falling * 0.5 / fall;
    stress +=
        Vec3(along[0] / u + rising + sinking, along[1] / v + rising + sinking, rising - sinking);
  }
  return stress;
}

Vec3 SheetResponse::membraneStress(const Vec3& green) const {
  if (springs_) return springStress(green);
  Mat3 by_green;
  const Vec3 strain = lawStrain(green, &by_green);
  return by_green.transpose() * laws_.membrane->evaluate(strain, 0).stress;
}

double SheetResponse::cylinderMoment(double angle_rad, double curvature_per_m) const {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  if (!springs_) {
    const Vec3 direction(c * c, s * s, 2.0 * c * s);
    return direction.dot(laws_.bending->evaluate(curvature_per_m * direction, 0).stress);
  }
  // A spring over two edges becomes the chord of its arc: l / l0 = sin(kappa h) / (kappa h).
  double moment = 0.0;
  const auto addSpring = [&](int component, double length, double cosine, double share) {
    const double half = length * cosine * cosine;  // curvature along it is kappa cos^2
    const double x = curvature_per_m * half;
    if (std::abs(x) < 1e-9) return;
    Vec3 strain = Vec3::Zero();
    strain[component] = std::sin(x) / x - 1.0;
    const double slope = (std::cos(x) - std::sin(x) / x) / x * half;
    moment += share * laws_.bending->evaluate(strain, 0).stress[component] * slope;
  };
  addSpring(0, edge_m_, c, 1.0);
  addSpring(1, edge_m_, s, 1.0);
  const double quarter = std::numbers::pi / 4.0;
  addSpring(kDiagonal, std::numbers::sqrt2 * edge_m_, std::cos(angle_rad - quarter), 0.5);
  addSpring(kDiagonal, std::numbers::sqrt2 * edge_m_, std::cos(angle_rad + quarter), 0.5);
  return moment;
}

Vec3 SheetResponse::greenOf(int component, double strain) const {
  Vec3 green = Vec3::Zero();
  const double squared = 0.5 * ((1.0 + strain) * (1.0 + strain) - 1.0);
  if (component == kShear) {
    green[component] = springs_ ? 2.0 * squared : strain;
  } else {
    green[component] = membrane_ == MembraneElement::kStvk ? strain : squared;
  }
  return green;
}

SheetResponse::Window SheetResponse::window(const std::string& name) const {
  const MaterialComponent* component = material_.find(name);
  const bool known = component != nullptr && component->observed_max > component->observed_min;
  if (known) return {component->observed_min, component->observed_max, true};
  if (name.starts_with("bend")) return {0.0, kDefaultCurvature_per_m, false};
  return {0.0, name == kMembraneNames[kShear] ? kDefaultShear : kDefaultStretch, false};
}

std::vector<SheetResponse::Sample> SheetResponse::membraneSamples() const {
  std::vector<Sample> samples;
  for (int component = 0; component < 3; ++component) {
    const Window range = window(kMembraneNames[component]);
    const double from = range.measured ? std::min(range.min, 0.0) : 0.0;
    for (int i = 0; i <= kSamples; ++i) {
      const double strain = from + (range.max - from) * i / kSamples;
      if (std::abs(strain) < 1e-9) continue;
      const Vec3 green = greenOf(component, strain);
      samples.push_back({component, strain, green, membraneStress(green)});
    }
  }
  return samples;
}

std::vector<double> SheetResponse::curvatures(const std::string& component) const {
  const Window range = window(component);
  const double end = std::max(std::abs(range.min), std::abs(range.max));
  // Springs have a strain where others have a curvature; their window says nothing of bending.
  const double limit = springs_ ? kDefaultCurvature_per_m : end;
  std::vector<double> values;
  for (int i = 1; i <= kSamples; ++i) values.push_back(limit * i / kSamples);
  return values;
}

}  // namespace tenter
