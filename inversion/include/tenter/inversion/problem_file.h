// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tenter/inversion/inversion.h"
#include "tenter/mechanics/material.h"

namespace tenter {

inline constexpr int kProblemSchemaVersion = 1;
/// Name of the file in the folder of an inversion result.
inline constexpr const char* kProblemFile = "problem.json";

/// What an inversion was asked (docs/formats/inversion.md), so that its folder stands alone.
struct ProblemFile {
  Material material;
  Vec3 gravity_m_per_s2 = kDefaultGravity;
  double friction = 0.0;  ///< Of obstacles where no contact states its own.
  std::vector<int> fixed;
  std::vector<std::string> obstacles;  ///< As makeObstacle; meshes are copied into the file.
};

/// Error: a mesh of an obstacle that cannot be read.
Result<nlohmann::json> problemToJson(const ProblemFile& problem);

/// An inversion result as its folder holds it.
struct StoredInversion {
  InversionProblem problem;  ///< With the contacts of the certificate.
  Points3 rest;
  std::optional<ElementRest> element_rest;  ///< Of a metric rest state.
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  double friction = 0.0;
};

/// Error with file and field: no such folder, without problem.json, or parts that do not fit
/// together.
Result<StoredInversion> readInversion(const std::filesystem::path& folder);

}  // namespace tenter
