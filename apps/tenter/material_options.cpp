// SPDX-License-Identifier: GPL-3.0-or-later
#include "material_options.h"

#include <cmath>
#include <utility>

namespace tenter::app {

namespace {

bool positive(double value) { return std::isfinite(value) && value > 0.0; }

/// The two constants of [Inv18] as a material, so that both ways go on together.
Result<Material> twoConstants(const MaterialOptions& o) {
  if (!positive(o.rho) || !positive(o.k_stretch) || !std::isfinite(o.k_bend) || o.k_bend < 0.0) {
    return usageError("--rho and --k-stretch must be positive, --k-bend not negative");
  }
  Material material;
  material.law = "edge-hinge";
  material.areal_density_kg_per_m2 = o.rho;
  const auto add = [&](const char* name, double value) {
    MaterialComponent component;
    component.name = name;
    component.curve = StiffnessCurve::constant(value);
    material.components.push_back(std::move(component));
  };
  add("edge_stretch", o.k_stretch);
  add("hinge_bend", o.k_bend);
  return material;
}

}  // namespace

void declareMaterial(CLI::App& command, MaterialOptions& o) {
  command.add_option("--material", o.file, "Material file");
  o.rho_option = command.add_option("--rho", o.rho,
                                    "Areal density [kg/m^2]; with --k-stretch and "
                                    "--k-bend instead of a material");
  o.stretch_option =
      command.add_option("--k-stretch", o.k_stretch, "Stretching constant of [Inv18] eq. 9 [N/m]");
  o.bend_option =
      command.add_option("--k-bend", o.k_bend, "Bending constant of [Inv18] eq. 10 [N m]");
}

Result<Material> materialOf(const MaterialOptions& o) {
  const int given = static_cast<int>(o.rho_option->count() > 0) +
                    static_cast<int>(o.stretch_option->count() > 0) +
                    static_cast<int>(o.bend_option->count() > 0);
  if (o.file.empty() ? given != 3 : given != 0) {
    return usageError("give either --material, or all of --rho, --k-stretch and --k-bend");
  }
  if (o.file.empty()) return twoConstants(o);
  auto material = readMaterial(o.file);
  if (material.ok() && material->areal_density_kg_per_m2 <= 0.0) {
    return badInput(o.file, "areal_density_kg_per_m2", "is missing, so the sheet has no weight",
                    "write it into the material");
  }
  return material;
}

Result<SimulatedMaterial> simulatedMaterialOf(const MaterialOptions& o) {
  auto material = materialOf(o);
  if (!material) return material.error();
  const auto model = findClothModel(material->law);
  if (!model) {
    return badInput(
        o.file, "law",
        "is " + material->law +
            ", whose tabulated forces belong to no energy, and an equilibrium is a minimum of one",
        "use it in its own program, or fit a law of tenter to measurements of the fabric");
  }
  auto laws = makeLaws(**model, *material);
  if (!laws) return laws.error().in(o.file);
  return SimulatedMaterial{*std::move(material), *model, *std::move(laws)};
}

}  // namespace tenter::app
