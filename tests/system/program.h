// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tenter::system_test {

struct Outcome {
  int exit_code = -1;  ///< -1 if a signal ended it.
  std::string out, err;
  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// Runs the built `tenter` with these arguments in a folder. `interrupt_after_s` > 0 sends SIGINT
/// once after that time.
Outcome tenter(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
               double interrupt_after_s = 0.0);

}  // namespace tenter::system_test
