// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/image_session.h"

#include <algorithm>
#include <set>

#include "tenter/core/files.h"
#include "tenter/session/rest_pictures.h"

namespace tenter {

namespace fs = std::filesystem;

namespace {

/// The camera's name in "frames/000012-left.png".
std::string cameraOf(const std::string& name) {
  const std::string stem = fs::path(name).stem().string();
  const auto dash = stem.find('-');
  return dash == std::string::npos ? "" : stem.substr(dash + 1);
}

/// Whether a file is the one that the header speaks of.
Result<void> checkIdentity(const SessionHeader& header, const std::string& key,
                           const fs::path& file) {
  const auto bytes = readFile(file);
  if (!bytes) return bytes.error();
  const auto known = header.calibration_ids.find(key);
  if (known == header.calibration_ids.end() || known->second == sha256(*bytes)) return {};
  return badInput(file.string(), "",
                  "is not the file that the session was recorded with: its SHA-256 differs from "
                  "calibration_ids[\"" +
                      key + "\"]",
                  "restore the session's own file");
}

struct TimedSample {
  std::int64_t time_ns;
  SampleRecord sample;
};

/// Frames and samples of the journal.
Result<void> readJournal(SessionReader& reader, ImageSession& session,
                         std::vector<TimedSample>& samples) {
  std::set<std::string> unknown;
  while (true) {
    const auto record = reader.next();
    if (!record) return record.error();
    if (!record->has_value()) break;
    if (const auto* sample = std::get_if<SampleRecord>(&(*record)->body)) {
      samples.push_back({(*record)->time_ns, *sample});
      continue;
    }
    auto rest = restPicturesIn((*record)->body);
    if (!rest) return rest.error().in((session.folder / "journal.jsonl").string());
    if (rest->has_value()) session.rest_pictures = std::move(*rest);
    const auto* frame = std::get_if<FrameRecord>(&(*record)->body);
    if (!frame) continue;
    SessionMoment moment;
    moment.frame = frame->frame;
    moment.time_ns = (*record)->time_ns;
    moment.files.resize(session.views.size());
    for (const FrameFile& file : frame->files) {
      const std::string camera = cameraOf(file.name);
      const auto view = std::find_if(session.views.begin(), session.views.end(),
                                     [&](const CameraView& v) { return v.name == camera; });
      if (view == session.views.end()) {
        unknown.insert(camera);
        continue;
      }
      moment.files[static_cast<std::size_t>(view - session.views.begin())] = file;
    }
    session.moments.push_back(std::move(moment));
  }
  for (const std::string& camera : unknown) {
    session.warnings.push_back("camera '" + camera + "' is not in the calibration: left out");
  }
  return {};
}

/// Gives each moment the sample nearest to it in time.
void attachSamples(const std::vector<TimedSample>& samples, ImageSession& session) {
  std::size_t at = 0;
  const auto apart = [&](std::size_t i, std::int64_t time_ns) {
    return std::abs(samples[i].time_ns - time_ns);
  };
  for (SessionMoment& moment : session.moments) {
    if (samples.empty()) break;
    while (at + 1 < samples.size() && apart(at + 1, moment.time_ns) <= apart(at, moment.time_ns)) {
      ++at;
    }
    moment.sample = samples[at].sample;
    moment.sample_apart_ns = apart(at, moment.time_ns);
  }
}

/// What lies at rest beside a session that has no record of it, from before there were such
/// records.
Result<std::optional<FrameFile>> unrecordedRest(const fs::path& session, const std::string& name) {
  std::error_code failed;
  if (!fs::exists(session / name, failed)) return std::optional<FrameFile>();
  const auto bytes = readFile(session / name);
  if (!bytes) return bytes.error();
  return std::optional(FrameFile{name, sha256(*bytes), bytes->size()});
}

/// Pictures from before the session, of the sample at rest; they come before its frames.
Result<void> addRest(ImageSession& session) {
  const fs::path folder = session.folder / kRestFolder;
  std::error_code failed;
  if (session.mounting.rest_frame) return {};
  if (!session.rest_pictures && !fs::is_directory(folder, failed)) return {};
  SessionMoment rest;
  rest.frame = -1;
  rest.files.resize(session.views.size());
  for (std::size_t v = 0; v < session.views.size(); ++v) {
    const std::string name = std::string(kRestFolder) + "/" + session.views[v].name + ".png";
    if (session.rest_pictures) {
      const auto& known = *session.rest_pictures;
      const auto file = std::find_if(known.begin(), known.end(),
                                     [&](const FrameFile& f) { return f.name == name; });
      if (file != known.end()) rest.files[v] = *file;
    } else {
      auto file = unrecordedRest(session.folder, name);
      if (!file) return file.error();
      rest.files[v] = std::move(*file);
    }
    if (!rest.files[v]) continue;
    session.identity += "\n" + rest.files[v]->name + "=" + rest.files[v]->sha256;
  }
  session.moments.insert(session.moments.begin(), std::move(rest));
  session.at_rest = true;
  return {};
}

Result<void> findReference(ImageSession& session) {
  if (session.at_rest) return {};
  if (!session.mounting.rest_frame) {
    session.warnings.push_back(
        "the session has no frame at rest: (u, v) are those of the first frame, as stretched as it "
        "is");
    return {};
  }
  const auto rest =
      std::find_if(session.moments.begin(), session.moments.end(),
                   [&](const SessionMoment& m) { return m.frame == *session.mounting.rest_frame; });
  if (rest == session.moments.end()) {
    return badInput(
        (session.folder / kMountingFile).string(), "rest_frame",
        "frame " + std::to_string(*session.mounting.rest_frame) + " is not in the session");
  }
  session.reference = static_cast<std::size_t>(rest - session.moments.begin());
  session.at_rest = true;
  return {};
}

}  // namespace

Result<ImageSession> openImageSession(const fs::path& folder) {
  auto reader = SessionReader::open(folder);
  if (!reader) return reader.error();
  ImageSession session;
  session.folder = folder;
  session.header = (*reader)->header();
  const fs::path mounting_file = folder / kMountingFile;
  const fs::path calibration_file = folder / kSessionCalibrationFile;
  if (auto same = checkIdentity(session.header, "mounting", mounting_file); !same) {
    return same.error();
  }
  if (auto same = checkIdentity(session.header, "cameras", calibration_file); !same) {
    return same.error();
  }
  auto mounting = readMounting(mounting_file);
  if (!mounting) return mounting.error();
  session.mounting = std::move(*mounting);
  auto calibration = readCalibration(calibration_file);
  if (!calibration) return calibration.error();
  session.calibration = std::move(*calibration);
  if (!session.calibration.rig) {
    return badInput(calibration_file.string(), "rig",
                    "the calibration does not say where the rig is", "calibrate with --rig-board");
  }
  session.views = viewsOf(session.calibration);
  std::vector<TimedSample> samples;
  if (auto done = readJournal(**reader, session, samples); !done) return done.error();
  attachSamples(samples, session);
  session.identity = session.header.id + "\n" + session.header.start_utc;
  for (const auto& [key, id] : session.header.calibration_ids) {
    session.identity += "\n" + key + "=" + id;
  }
  if (session.moments.empty()) {
    return badInput((folder / "journal.jsonl").string(), "", "the session has no images",
                    "was it recorded without cameras?");
  }
  if (auto added = addRest(session); !added) return added.error();
  if (auto found = findReference(session); !found) return found.error();
  return session;
}

std::vector<GrayImage> readMoment(const ImageSession& session, const SessionMoment& moment,
                                  std::vector<std::string>& warnings) {
  std::vector<GrayImage> images(session.views.size());
  for (std::size_t v = 0; v < session.views.size(); ++v) {
    const CameraView& view = session.views[v];
    if (!moment.files[v]) {
      warnings.push_back("no image of camera '" + view.name + "'");
      continue;
    }
    const FrameFile& file = *moment.files[v];
    const auto bytes = readFile(session.folder / file.name);
    if (!bytes) {
      warnings.push_back(bytes.error().message());
      continue;
    }
    if (sha256(*bytes) != file.sha256) {
      warnings.push_back(file.name + ": is not the image that was recorded: its SHA-256 differs");
      continue;
    }
    auto image = decodeGrayImage(*bytes, file.name);
    if (!image) {
      warnings.push_back(image.error().message());
      continue;
    }
    if (image->image.width != view.model.widthPx() ||
        image->image.height != view.model.heightPx()) {
      warnings.push_back(file.name + ": has another size than camera '" + view.name +
                         "' was calibrated with");
      continue;
    }
    images[v] = std::move(image->image);
  }
  return images;
}

GrayImage pictureOf(const ImageSession& session, std::int64_t frame) {
  const auto moment = std::find_if(session.moments.begin(), session.moments.end(),
                                   [&](const SessionMoment& m) { return m.frame == frame; });
  if (moment == session.moments.end()) return {};
  std::vector<std::string> unread;
  return std::move(readMoment(session, *moment, unread).front());
}

}  // namespace tenter
