// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/rest_pictures.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>

#include "frame_store.h"
#include "posix_file.h"
#include "session_format.h"
#include "session_survey.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kFiles = "files";

GenericRecord recordOf(const std::vector<FrameFile>& files) {
  Json list = Json::array();
  for (const FrameFile& file : files)
    list.push_back({{"name", file.name}, {"sha256", file.sha256}, {"size_bytes", file.size_bytes}});
  return {format::kRest, Json{{kFiles, list}}.dump()};
}

struct Picture {
  FrameFile file;
  std::string bytes;
};

/// The pictures of a folder, in the order of their names; other files are not looked at.
Result<std::vector<Picture>> picturesIn(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed);
  for (const fs::directory_iterator end; !failed && entry != end; entry.increment(failed))
    paths.push_back(entry->path());
  if (failed) return badInput(folder.string(), "", "cannot be listed: " + failed.message());
  std::sort(paths.begin(), paths.end());
  std::vector<Picture> pictures;
  for (const fs::path& path : paths) {
    const std::string name = std::string(kRestFolder) + "/" + path.filename().string();
    if (!format::isRestFileName(name)) continue;
    if (const auto opened = openForReading(path); !opened) return opened.error();
    auto bytes = readFile(path);
    if (!bytes) return bytes.error();
    FrameFile file{name, sha256(*bytes), bytes->size()};
    pictures.push_back({std::move(file), std::move(*bytes)});
  }
  if (!pictures.empty()) return pictures;
  return badInput(folder.string(), "", "holds no picture CAMERA.png",
                  "take them with: tenter rig snap -o DIR");
}

/// Whether a session holds these bytes under this name; an error if it holds others.
Result<bool> alreadyThere(const fs::path& session, const Picture& picture) {
  const fs::path path = session / picture.file.name;
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) return false;
  if (const auto opened = openForReading(path); !opened) return opened.error();
  const auto bytes = readFile(path);
  if (!bytes) return bytes.error();
  if (*bytes == picture.bytes) return true;
  return badInput(path.string(), "", "is there already, and is another picture");
}

}  // namespace

Result<std::optional<std::vector<FrameFile>>> restPicturesIn(const RecordBody& body) {
  using Files = std::optional<std::vector<FrameFile>>;
  const auto* record = std::get_if<GenericRecord>(&body);
  if (record == nullptr || record->kind != format::kRest) return Files();
  const auto json = parseJson(record->data, "");
  if (!json) return json.error();
  JsonReader in(*json, "");
  std::vector<FrameFile> files(in.arraySize(kFiles));
  if (in.ok() && (files.empty() || files.size() > format::kMaxFrameFiles))
    in.fail(kFiles, "must name 1 to " + std::to_string(format::kMaxFrameFiles) + " pictures");
  for (std::size_t i = 0; in.ok() && i < files.size(); ++i) {
    JsonReader item = in.element(kFiles, i);
    files[i] = {item.text("name"), item.text("sha256"),
                static_cast<std::uint64_t>(item.integer("size_bytes", 0, format::kMaxInteger))};
    if (!format::isRestFileName(files[i].name)) item.fail("name", "is no picture at rest");
  }
  if (!in.ok()) return in.error();
  return Files(std::move(files));
}

Result<std::vector<FrameFile>> addRestPictures(const fs::path& session, const fs::path& pictures) {
  auto writer = SessionWriter::amend(session);
  if (!writer) return writer.error();
  const auto survey = surveyJournal(session, (*writer)->header());
  if (!survey) return survey.error();
  if (survey->rest) return badInput(session.string(), "", "has pictures at rest already");
  const auto found = picturesIn(pictures);
  if (!found) return found.error();
  std::error_code failed;
  fs::create_directory(session / kRestFolder, failed);
  if (failed)
    return badInput((session / kRestFolder).string(), "", "cannot be made: " + failed.message());
  std::vector<FrameFile> files;
  for (const Picture& picture : *found) {
    const auto there = alreadyThere(session, picture);
    if (!there) return there.error();
    if (!*there)
      if (auto done = storeFile(session, picture.file, picture.bytes); !done) return done.error();
    files.push_back(picture.file);
  }
  if (auto done = syncFolder(session / kRestFolder); !done) return done.error();
  if (auto done = syncFolder(session); !done) return done.error();
  const std::int64_t time_ns = (*writer)->lastTime_ns();
  if (auto added = (*writer)->append(time_ns, recordOf(files)); !added) return added.error();
  if (auto closed = (*writer)->close(time_ns); !closed) return closed.error();
  return files;
}

}  // namespace tenter
