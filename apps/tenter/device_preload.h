// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/core/result.h"

namespace tenter::app {

/// The program anew, with what it takes to announce virtual devices; returns if it already has it.
Result<void> preloadDevices();

}  // namespace tenter::app
