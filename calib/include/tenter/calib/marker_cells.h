// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "tenter/calib/byte_image.h"

namespace tenter {

/// A marker at one pixel a cell, black border included: 0 and 255. Nothing if the dictionary is not
/// one of markerDictionaries() or has no such marker.
std::optional<ByteImage> markerCells(const std::string& dictionary, int id);

}  // namespace tenter
