// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "tenter/inversion/obstacle.h"

namespace tenter {

/// The body that `description` names, null if its kind is none of these. Usage error for numbers
/// that make no body.
Result<std::unique_ptr<Obstacle>> makeAnalyticObstacle(const std::string& description);

}  // namespace tenter
