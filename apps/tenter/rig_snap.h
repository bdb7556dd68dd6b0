// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

/// `tenter rig snap`.
Verb rigSnap();

}  // namespace tenter::app
