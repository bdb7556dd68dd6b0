// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.h"

namespace tenter::app {

/// The daemon's status for a person: state, emergency stop, then a line an axis with its place in
/// the travel and the tension of its cord as shares of what is allowed, cells without an axis, and
/// cameras.
std::vector<std::string> gaugeLines(const nlohmann::json& status);

/// `tenter rig gauges`: the same, five times a second, until Ctrl-C.
Verb rigGauges();

}  // namespace tenter::app
