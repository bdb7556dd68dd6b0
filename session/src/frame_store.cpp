// SPDX-License-Identifier: GPL-3.0-or-later
#include "frame_store.h"

#include <set>
#include <system_error>

#include "posix_file.h"
#include "session_format.h"
#include "tenter/core/files.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

Result<void> storeFile(const fs::path& session, const FrameFile& file, std::string_view bytes) {
  const fs::path target = session / file.name;
  const fs::path part = target.string() + format::kPartSuffix;
  if (auto done = writeNewFile(part, bytes); !done) return done;
  std::error_code error;
  fs::rename(part, target, error);
  if (!error) return {};
  std::error_code ignored;
  fs::remove(part, ignored);
  return badInput(target.string(), "", "cannot be put in place: " + error.message());
}

Result<void> checkImages(std::span<const FrameImage> images) {
  if (images.empty() || images.size() > format::kMaxFrameFiles) {
    return badInput("", "images", "must be 1 to " + std::to_string(format::kMaxFrameFiles));
  }
  std::set<std::string> cameras;
  for (const FrameImage& image : images) {
    if (!format::isCameraName(image.camera)) {
      return badInput("", "camera", "must be 1 to 64 letters, digits, '_' or '-'");
    }
    if (!format::isExtension(image.extension)) {
      return badInput("", "extension", "must be 1 to 8 lower-case letters or digits");
    }
    if (!cameras.insert(image.camera).second) {
      return badInput("", "camera", "'" + image.camera + "' comes twice in one frame");
    }
  }
  return {};
}

Result<FrameRecord> storeImages(const fs::path& session, std::int64_t frame,
                                std::span<const FrameImage> images) {
  FrameRecord record{frame, {}};
  for (const FrameImage& image : images) {
    FrameFile file{format::frameFileName(frame, image.camera, image.extension), sha256(image.bytes),
                   image.bytes.size()};
    if (auto done = storeFile(session, file, image.bytes); !done) {
      removeImages(session, record);
      return done.error();
    }
    record.files.push_back(std::move(file));
  }
  if (auto done = syncFolder(session / format::kFramesFolder); !done) {
    removeImages(session, record);
    return done.error();
  }
  return record;
}

void removeImages(const fs::path& session, const FrameRecord& frame) {
  for (const FrameFile& file : frame.files) {
    std::error_code ignored;
    fs::remove(session / file.name, ignored);
  }
}

}  // namespace tenter
