// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>

#include "tenter/session/session_writer.h"

namespace tenter {

/// Error if cameras or extensions have characters that do not belong into a file's name, or if a
/// camera comes twice.
Result<void> checkImages(std::span<const FrameImage> images);

/// Writes a file of the session so that its name appears with its content (.part, fdatasync,
/// rename); its folder is not synced. Error: it is there already.
Result<void> storeFile(const std::filesystem::path& session, const FrameFile& file,
                       std::string_view bytes);

/// Writes the images of a frame so that each name appears with its content on the disk (.part,
/// fdatasync, rename, fsync of the folder). On error none is left.
Result<FrameRecord> storeImages(const std::filesystem::path& session, std::int64_t frame,
                                std::span<const FrameImage> images);

/// Takes back what storeImages did.
void removeImages(const std::filesystem::path& session, const FrameRecord& frame);

}  // namespace tenter
