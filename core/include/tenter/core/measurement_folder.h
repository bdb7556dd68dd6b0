// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/core/files.h"

namespace tenter {

/// What tells a measurement's folder from others.
const FolderKind& measurementFolder();

}  // namespace tenter
