// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tenter/session/mounting.h"

namespace tenter {

/// What hangs in the virtual rig for a protocol: clips with their tags and bodies, cords, the
/// table. Cords have the cells and actuators of MountedSpecimen. No rest frame is set. Error: no
/// such fabric or protocol.
Result<Mounting> rigMounting(const std::string& fabric, const std::string& protocol);

}  // namespace tenter
