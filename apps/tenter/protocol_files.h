// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

// What `tenter protocol` has on machines with devices.
Verb protocolShow();
Verb protocolCheck();

}  // namespace tenter::app
