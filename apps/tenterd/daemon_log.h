// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

namespace tenter::daemon {

/// The log on standard error, one JSON object a line: time (UTC), level, event, and what belongs to
/// the event (docs/rig.md). A thread of its own writes it: whoever reads it slowly, or not at all,
/// holds nothing up, and then the oldest lines are lost.
void startLog();
/// Writes what is left.
void endLog();

enum class LogLevel { kInfo, kWarning, kError };
/// @param fields  an object.
void logEvent(LogLevel level, std::string_view event, nlohmann::json fields);

}  // namespace tenter::daemon
