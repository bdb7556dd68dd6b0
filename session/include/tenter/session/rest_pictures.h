// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/session/records.h"

namespace tenter {

/// Where a session keeps pictures, CAMERA.png, of the sample as it lay flat before it was hung.
inline constexpr const char* kRestFolder = "rest";

/// What a record says the pictures at rest are; nothing if it is another kind of record. Error
/// (without a file): a list that cannot be, such as a name that leads out of the folder.
Result<std::optional<std::vector<FrameFile>>> restPicturesIn(const RecordBody& body);

/// Puts the pictures of a folder, CAMERA.png, into a session that nobody writes to any more, and
/// their SHA-256 into its journal. The folder may be the session's own, where pictures without a
/// record lie. Error: no picture there, the session has some on record, it is torn or in use.
Result<std::vector<FrameFile>> addRestPictures(const std::filesystem::path& session,
                                               const std::filesystem::path& pictures);

}  // namespace tenter
