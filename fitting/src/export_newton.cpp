// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>

#include "export_loss.h"
#include "export_targets.h"

namespace tenter {

namespace {

constexpr double kRigidityPerHinge = 3.0;  // energy k/2 * 3/A (w x)^2, aligned hinges: B = 3 k

struct Constants {
  double weft, warp, shear;                    // tri_aniso_ke [N/m]
  double bend_weft, bend_warp, bend_diagonal;  // edge_aniso_ke [N m]
};

/// The target's stress with unit constants: k (|w| - 1) along a fibre, k w_u . w_v in shear.
Vec3 unitStress(const Vec3& green) {
  const double u = std::sqrt(1.0 + 2.0 * green[0]), v = std::sqrt(1.0 + 2.0 * green[1]);
  return {(u - 1.0) / u, (v - 1.0) / v, green[2]};
}

double bestStiffness(const SheetResponse& response, int component) {
  std::vector<double> shape, value;
  for (const auto& sample : response.membraneSamples()) {
    if (sample.component != component) continue;
    shape.push_back(unitStress(sample.green)[component]);
    value.push_back(sample.stress[component]);
  }
  return bestConstant(shape, value);
}

double bestRigidity(const SheetResponse& response, const char* window, double angle) {
  std::vector<double> shape, value;
  for (const double kappa : response.curvatures(window)) {
    shape.push_back(kappa);
    value.push_back(response.cylinderMoment(angle, kappa));
  }
  return bestConstant(shape, value);
}

Constants constantsOf(const SheetResponse& response) {
  Constants c{};
  c.weft = bestStiffness(response, 0);
  c.warp = bestStiffness(response, 1);
  c.shear = bestStiffness(response, 2);
  if (!response.bends()) return c;
  c.bend_weft = bestRigidity(response, kBendNames[0], 0.0) / kRigidityPerHinge;
  c.bend_warp = bestRigidity(response, kBendNames[1], 0.5 * std::numbers::pi) / kRigidityPerHinge;
  // A hinge at 45 degrees has (weft + warp) / 64 + diagonal.
  const double at_45 =
      bestRigidity(response, kBendNames[0], 0.25 * std::numbers::pi) / kRigidityPerHinge;
  c.bend_diagonal = std::max(at_45 - (c.bend_weft + c.bend_warp) / 64.0, 0.0);
  return c;
}

nlohmann::json fileOf(const Constants& c, const Material& material) {
  return {{"format", "tenter-linear-orthotropic"},
          {"schema_version", 1},
          {"generator", kGenerator},
          {"fabric", material.fabric},
          {"density", material.areal_density_kg_per_m2},
          {"tri_aniso_ke", {c.weft, c.warp, c.shear}},
          {"edge_aniso_ke", {c.bend_weft, c.bend_warp, c.bend_diagonal}},
          {"units", {{"density", "kg/m^2"}, {"tri_aniso_ke", "N/m"}, {"edge_aniso_ke", "N m"}}},
          {"order", {"weft", "warp", "shear or diagonal"}}};
}

Result<ExportedMaterial> make(const Material& material, const ExportOptions& options) {
  const auto response = SheetResponse::create(material, options.edge_m);
  if (!response) return response.error();
  if (!response->bends()) {
    return usageError("springs of the second ring bend by the mesh they are on",
                      "give its mean edge with --edge-mm");
  }
  const Constants c = constantsOf(*response);
  ExportedMaterial exported;
  exported.content = fileOf(c, material).dump(2) + "\n";
  setErrors(
      exported, *response,
      [&](const Vec3& green) {
        return Vec3(Vec3(c.weft, c.warp, c.shear).cwiseProduct(unitStress(green)));
      },
      [&](double angle, double kappa) {
        return kRigidityPerHinge * (angle == 0.0 ? c.bend_weft : c.bend_warp) * kappa;
      });
  exported.lost.emplace_back("every stiffness is one number: curves become their best constant");
  exported.lost.emplace_back("coupling of weft and warp, and of shear and tension");
  exported.lost.emplace_back("compression has the stiffness of tension");
  noteWindow(exported, *response);
  return exported;
}

}  // namespace

ExportTarget newtonExport() {
  return {.id = "newton",
          .description = "linear orthotropic constants of Newton's Style3D cloth (JSON)",
          .file_extension = ".json",
          .marker = "\"format\": \"tenter-linear-orthotropic\"",
          .make = make};
}

}  // namespace tenter
