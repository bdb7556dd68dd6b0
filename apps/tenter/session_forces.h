// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

/// A row of `tenter session`.
Verb sessionForces();

}  // namespace tenter::app
