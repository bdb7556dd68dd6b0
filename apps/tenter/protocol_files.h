// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

/// A shipped protocol by its name, or a file that is one.
Result<std::string> protocolText(const std::string& name);

// What `tenter protocol` has on machines with devices.
Verb protocolShow();
Verb protocolCheck();

}  // namespace tenter::app
