// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "export_loss.h"
#include "export_targets.h"

namespace tenter {

namespace {

constexpr const char* kMarker = "# Cloth preset written by tenter";
constexpr double kForceScale = 1000.0;  // edge stiffness [N/m] = 1000 tension / edge
constexpr double kBendScale = 50.0;     // moment of a hinge [N m] = 50 bending edge^2 theta
constexpr double kLargestSetting = 10000.0;

struct Settings {
  double tension, compression, shear, bending;  ///< As the program takes them.
  double mass_kg;                               ///< Of one vertex.
  double edge_m;
};

/// Square quads with springs along their edges (constant K [N/m]) and both diagonals (G): every
/// spring linear in its length.
Vec3 latticeStress(const Settings& s, const Vec3& green) {
  const double u = std::sqrt(1.0 + 2.0 * green[0]), v = std::sqrt(1.0 + 2.0 * green[1]);
  const double rise = std::sqrt(1.0 + green[0] + green[1] + green[2]);
  const double fall = std::sqrt(1.0 + green[0] + green[1] - green[2]);
  const double per_setting = kForceScale / s.edge_m;
  const double k = per_setting * s.tension, g = per_setting * s.shear;
  const auto along = [&](double stretch) {
    return (stretch >= 1.0 ? k : per_setting * s.compression) * (stretch - 1.0) / stretch;
  };
  // Each diagonal stores g (sqrt2 h)^2 (stretch - 1)^2 / 2 per h^2: g (stretch - 1)^2.
  const double a = g * (rise - 1.0) / rise, b = g * (fall - 1.0) / fall;
  return {along(u) + a + b, along(v) + a + b, a - b};
}

double bestMembrane(const SheetResponse& response, bool shear) {
  std::vector<double> shape, value;
  for (const auto& sample : response.membraneSamples()) {
    if ((sample.component == 2) != shear) continue;
    const double stretch = std::sqrt(1.0 + 2.0 * sample.green[sample.component]);
    shape.push_back(shear ? sample.green[2] : (stretch - 1.0) / stretch);
    value.push_back(sample.stress[sample.component]);
  }
  return bestConstant(shape, value);
}

double bestBending(const SheetResponse& response) {
  std::vector<double> shape, value;
  for (int component = 0; component < 2; ++component) {
    for (const double kappa : response.curvatures(kBendNames[component])) {
      shape.push_back(kappa);
      value.push_back(response.cylinderMoment(0.5 * std::numbers::pi * component, kappa));
    }
  }
  return bestConstant(shape, value);
}

Settings settingsOf(const SheetResponse& response, double edge_m) {
  Settings s{};
  s.edge_m = edge_m;
  s.tension = bestMembrane(response, false) * edge_m / kForceScale;
  s.compression = s.tension;
  s.shear = bestMembrane(response, true) * edge_m / kForceScale;
  s.bending = bestBending(response) / (kBendScale * edge_m * edge_m);
  s.mass_kg = response.material().areal_density_kg_per_m2 * edge_m * edge_m;
  return s;
}

std::string line(const char* name, double value) {
  char text[96];
  std::snprintf(text, sizeof text, "cloth.settings.%s = %.9g\n", name, value);
  return text;
}

/// One line: a name from a file must not become code.
std::string commentSafe(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  return text;
}

std::string presetOf(const Settings& s, const Material& material) {
  char edge[32];
  std::snprintf(edge, sizeof edge, "%.6g", 1e3 * s.edge_m);
  return std::string(kMarker) + ": " + commentSafe(material.fabric) +
         ", for square quads with edges of " + edge +
         " mm\nimport bpy\ncloth = bpy.context.cloth\n\ncloth.settings.bending_model = "
         "'ANGULAR'\n" +
         line("mass", s.mass_kg) + line("tension_stiffness", s.tension) +
         line("compression_stiffness", s.compression) + line("shear_stiffness", s.shear) +
         line("bending_stiffness", s.bending);
}

void noteLosses(ExportedMaterial& exported, const Settings& s) {
  auto& lost = exported.lost;
  lost.emplace_back("weft and warp become one tension: springs do not know directions");
  lost.emplace_back("every stiffness is one number: curves become their best constant");
  lost.emplace_back(
      "shear becomes springs across the quads, which also resist stretching and "
      "couple weft and warp; the errors include that");
  lost.emplace_back("compression takes the number of tension; cloth was measured in tension");
  lost.emplace_back(
      "at the boundary of a sheet an edge has quads on one side only but the full "
      "spring and the full vertex mass: borders are twice as stiff and heavy");
  const double largest = std::max({s.tension, s.shear, s.bending});
  if (largest > kLargestSetting) {
    lost.emplace_back("a setting exceeds the 10000 that the program allows; use a finer mesh");
  }
}

Result<ExportedMaterial> make(const Material& material, const ExportOptions& options) {
  const auto response = SheetResponse::create(material, options.edge_m);
  if (!response) return response.error();
  const Settings s = settingsOf(*response, *options.edge_m);
  ExportedMaterial exported;
  exported.content = presetOf(s, material);
  setErrors(
      exported, *response, [&](const Vec3& green) { return latticeStress(s, green); },
      [&](double /*angle*/, double kappa) {
        return kBendScale * s.bending * s.edge_m * s.edge_m * kappa;
      });
  noteLosses(exported, s);
  noteWindow(exported, *response);
  return exported;
}

}  // namespace

ExportTarget blenderExport() {
  return {.id = "blender",
          .description = "cloth preset of Blender (Python), for one edge length",
          .file_extension = ".py",
          .marker = kMarker,
          .needs_edge = true,
          .make = make};
}

}  // namespace tenter
