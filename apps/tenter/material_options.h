// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <string>

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

}  // namespace tenter::app
