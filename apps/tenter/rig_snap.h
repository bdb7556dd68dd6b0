// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "command.h"

namespace tenter::app {

/// What the daemon's cameras see now, a PNG each, into a folder that is made.
Result<int> takeSnap(const std::string& socket, const std::string& output, Console& console);

/// `tenter rig snap`.
Verb rigSnap();

}  // namespace tenter::app
