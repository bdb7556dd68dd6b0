// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

/// Row `flat` of `tenter pattern`.
Verb flatPattern();

}  // namespace tenter::app
