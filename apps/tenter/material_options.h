// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/material.h"

namespace tenter::app {

/// What a sheet is made of: a material file, or the two constants of [Inv18] and an areal density.
struct MaterialOptions {
  std::string file;
  double rho = 0.0, k_stretch = 0.0, k_bend = 0.0;
  CLI::Option *rho_option = nullptr, *stretch_option = nullptr, *bend_option = nullptr;
};

/// --material, --rho, --k-stretch, --k-bend.
void declareMaterial(CLI::App& command, MaterialOptions& o);

/// The material that was given, with a positive areal density. Usage error unless it is given in
/// one way, and wholly.
Result<Material> materialOf(const MaterialOptions& o);

/// A material with the model and the laws that it is simulated by.
struct SimulatedMaterial {
  Material material;
  const ClothModel* model = nullptr;
  ClothLaws laws;
};
/// As materialOf(); refuses laws whose forces are no energy's, such as ARCSim's tables.
Result<SimulatedMaterial> simulatedMaterialOf(const MaterialOptions& o);

}  // namespace tenter::app
