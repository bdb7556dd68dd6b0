// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tenter::test_support {

/// What is wrong with `document` by the JSON Schema (draft 7) in `schema_file`, "place: reason"
/// each; empty if valid. Throws std::runtime_error if the schema itself cannot be read.
std::vector<std::string> schemaErrors(const nlohmann::json& document,
                                      const std::filesystem::path& schema_file);

}  // namespace tenter::test_support
