// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter {

/// Refuses what VTK's XML readers do not survive, before they see it: counts that the file cannot
/// hold (memory is allocated as announced), arrays of text (read past their end), headers of
/// compressed blocks that contradict themselves (indexed unchecked), and XML entities, behind which
/// all of these could hide. What passes may still be no mesh; VTK says so itself.
Result<void> checkVtkXml(std::string_view content, const std::string& file);

}  // namespace tenter
