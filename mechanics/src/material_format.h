// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/material.h"

namespace tenter {

/// Laws whose numbers stand in `tables`: imported, not in the cloth model registry.
inline constexpr std::array<std::string_view, 1> kTabulatedLaws = {"arcsim"};

inline constexpr std::array<std::string_view, 4> kMaterialVariants = {
    "orthotropic", "linear", "isotropic", "linear-isotropic"};

inline constexpr std::array<std::pair<ComponentStatus, std::string_view>, 3> kStatusNames = {{
    {ComponentStatus::kFitted, "fitted"},
    {ComponentStatus::kAssumed, "assumed"},
    {ComponentStatus::kUnobserved, "unobserved"},
}};

bool isTabulatedLaw(std::string_view law);

/// "springs soft stvk ... arcsim".
std::string knownLaws();

/// How a component is written (its name refers to `name`): from the registry, or for tabulated and
/// unknown laws by its name
/// ("bend..." is bending).
ComponentInfo componentFormat(const std::string& law, const std::string& name);

}  // namespace tenter
