// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <limits>
#include <system_error>

#include "hdf5_file.h"
#include "posix_file.h"
#include "record_kinds.h"
#include "session_format.h"
#include "tenter/core/files.h"
#include "tenter/session/session_export.h"
#include "tenter/session/session_reader.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

void writeNote(Hdf5File& out, const std::string& path, const std::string& type,
               const std::string& content) {
  out.group(path, "NXnote");
  out.text(path + "/type", type);
  out.text(path + "/data", content);
}

void writeHeader(Hdf5File& out, const SessionHeader& h, const std::string& session_json) {
  out.attribute("/", "NX_class", "NXroot");
  out.attribute("/", "creator", "tenter");
  out.attribute("/", "default", "entry");
  out.group("/entry", "NXentry");
  out.text("/entry/title", h.fabric + ", " + h.protocol);
  out.text("/entry/entry_identifier", h.id);
  out.text("/entry/start_time", h.start_utc);
  out.text("/entry/experiment_description", h.protocol);
  out.group("/entry/user", "NXuser");
  out.text("/entry/user/name", h.operator_name);
  out.text("/entry/user/role", "operator");
  out.text("/entry/user/affiliation", h.who);
  out.group("/entry/sample", "NXsample");
  out.text("/entry/sample/name", h.fabric);
  out.text("/entry/sample/specimen", h.specimen);
  out.number("/entry/sample/areal_density", h.areal_density_kg_per_m2, "kg/m^2");
  if (h.temperature_degC) out.number("/entry/sample/temperature", *h.temperature_degC, "degC");
  if (h.relative_humidity) out.number("/entry/sample/relative_humidity", *h.relative_humidity, "1");
  out.group("/entry/instrument", "NXinstrument");
  out.text("/entry/instrument/name", "tenter rig");
  writeNote(out, "/entry/instrument/configuration", "application/toml", h.rig_configuration);
  out.group("/entry/instrument/calibrations", "NXcollection");
  std::vector<std::string> kinds, ids;
  for (const auto& [kind, id] : h.calibration_ids) {
    kinds.push_back(kind);
    ids.push_back(id);
  }
  out.texts("/entry/instrument/calibrations/kind", kinds);
  out.texts("/entry/instrument/calibrations/id", ids);
  writeNote(out, "/entry/protocol", "application/toml", h.protocol_text);
  writeNote(out, "/entry/session_json", "application/json", session_json);
}

/// One quantity of all samples: rows are samples, columns are channels.
class Channels {
 public:
  Channels(Hdf5File& out, const std::string& group, const std::string& signal,
           const std::string& units, const std::string& axis, const std::vector<std::string>& names)
      : path_(prepare(out, group, signal, axis, names)),
        values_(out, path_ + "/" + signal, names.size(), units) {}

  void add(const std::optional<double>& value) { values_.add(value.value_or(kNoNumber)); }
  void flush() { values_.flush(); }
  const std::string& path() const { return path_; }

 private:
  static std::string prepare(Hdf5File& out, const std::string& group, const std::string& signal,
                             const std::string& axis, const std::vector<std::string>& names) {
    out.group(group, "NXdata");
    out.attribute(group, "signal", signal);
    out.attribute(group, "axes", std::vector<std::string>{"time", axis});
    out.texts(group + "/" + axis, names);
    out.link("/entry/time", group + "/time");
    return group;
  }
  std::string path_;
  Hdf5Column<double> values_;
};

/// The table of samples. A rig without cells, or without actuators, has no such group.
class Samples {
 public:
  Samples(Hdf5File& out, const SessionHeader& h) : time_(out, "/entry/time", 0, "ns") {
    out.attribute("/entry/time", "start", h.start_utc);
    if (!h.actuators.empty()) {
      out.attribute("/entry", "default", h.cells.empty() ? "positions" : "tensions");
      positions_.emplace(out, "/entry/positions", "position", "m", "actuator", h.actuators);
    }
    if (h.cells.empty()) return;
    if (h.actuators.empty()) out.attribute("/entry", "default", "tensions");
    tensions_.emplace(out, "/entry/tensions", "tension", "N", "cell", h.cells);
    status_.emplace(out, "/entry/tensions/status", h.cells.size(), "");
    age_.emplace(out, "/entry/tensions/age", h.cells.size(), "ns");
    std::vector<std::string> names;
    for (int i = 0; i <= static_cast<int>(TensionStatus::kMissing); ++i) {
      names.emplace_back(nameOf(static_cast<TensionStatus>(i)));
    }
    out.attribute("/entry/tensions/status", "names", names);
  }

  void add(std::int64_t time_ns, const SampleRecord& sample) {
    time_.add(time_ns);
    for (const auto& position : sample.positions_m) positions_->add(position);
    for (const TensionReading& reading : sample.tensions) {
      tensions_->add(reading.tension_N);
      status_->add(static_cast<std::uint8_t>(reading.status));
      age_->add(reading.age_ns);
    }
  }
  void flush() {
    time_.flush();
    if (positions_) positions_->flush();
    if (!tensions_) return;
    tensions_->flush();
    status_->flush();
    age_->flush();
  }

 private:
  Hdf5Column<std::int64_t> time_;
  std::optional<Channels> positions_, tensions_;
  std::optional<Hdf5Column<std::uint8_t>> status_;
  std::optional<Hdf5Column<std::int64_t>> age_;
};

/// One row an image.
class Frames {
 public:
  explicit Frames(Hdf5File& out)
      : frame_(out, table(out) + "/frame", 0, ""),
        time_(out, "/entry/frames/time", 0, "ns"),
        size_(out, "/entry/frames/size", 0, "byte"),
        file_(out, "/entry/frames/file", 0, ""),
        sha256_(out, "/entry/frames/sha256", 0, "") {}
  void add(std::int64_t time_ns, const FrameRecord& frame) {
    for (const FrameFile& file : frame.files) {
      frame_.add(frame.frame);
      time_.add(time_ns);
      size_.add(static_cast<std::int64_t>(file.size_bytes));
      file_.add(file.name);
      sha256_.add(file.sha256);
    }
  }
  void flush() {
    for (auto* column : {&frame_, &time_, &size_}) column->flush();
    for (auto* column : {&file_, &sha256_}) column->flush();
  }

 private:
  static std::string table(Hdf5File& out) {
    out.group("/entry/frames", "NXcollection");
    return "/entry/frames";
  }
  Hdf5Column<std::int64_t> frame_, time_, size_;
  Hdf5Column<std::string> file_, sha256_;
};

/// All that is neither a sample nor a frame, in order, with its JSON.
class Events {
 public:
  explicit Events(Hdf5File& out)
      : sequence_(out, table(out) + "/sequence", 0, ""),
        time_(out, "/entry/events/time", 0, "ns"),
        kind_(out, "/entry/events/kind", 0, ""),
        json_(out, "/entry/events/json", 0, "") {}
  void add(const JournalRecord& record) {
    const RecordKind kind = kindOf(record.body);
    sequence_.add(static_cast<std::int64_t>(record.sequence));
    time_.add(record.time_ns);
    kind_.add(std::string(kind.event.empty() ? kind.kind : kind.event));
    json_.add(record.text);
  }
  void flush() {
    for (auto* column : {&sequence_, &time_}) column->flush();
    for (auto* column : {&kind_, &json_}) column->flush();
  }

 private:
  static std::string table(Hdf5File& out) {
    out.group("/entry/events", "NXcollection");
    return "/entry/events";
  }
  Hdf5Column<std::int64_t> sequence_, time_;
  Hdf5Column<std::string> kind_, json_;
};

/// Goes once through the session. Failures of `out` are left to its finish().
Result<void> writeRecords(SessionReader& reader, Hdf5File& out) {
  Samples samples(out, reader.header());
  Frames frames(out);
  Events events(out);
  std::int64_t last_ns = 0;
  while (out.ok()) {
    const auto record = reader.next();
    if (!record) return record.error();
    if (!record->has_value()) break;
    const JournalRecord& r = **record;
    last_ns = std::max(last_ns, r.time_ns);
    if (const auto* sample = std::get_if<SampleRecord>(&r.body)) {
      samples.add(r.time_ns, *sample);
    } else if (const auto* frame = std::get_if<FrameRecord>(&r.body)) {
      frames.add(r.time_ns, *frame);
    } else {
      events.add(r);
    }
  }
  samples.flush();
  frames.flush();
  events.flush();
  out.number("/entry/duration", 1e-9 * static_cast<double>(last_ns), "s");
  return {};
}

Result<void> writeHdf5(SessionReader& reader, const std::string& session_json, const fs::path& part,
                       const std::string& shown) {
  Hdf5File out(part);
  writeHeader(out, reader.header(), session_json);
  if (auto done = writeRecords(reader, out); !done) return done;
  if (!out.finish()) {
    return badInput(shown, "", "cannot be written", "check the folder and the room on the disk");
  }
  const Descriptor fd(::open(part.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd.valid() || ::fsync(fd.get()) != 0) return fileError(shown, "cannot be synced", errno);
  return {};
}

}  // namespace

Result<void> exportSessionToHdf5(const fs::path& session, const fs::path& file) {
  auto reader = SessionReader::open(session);
  if (!reader) return reader.error();
  const auto session_json = readFile(session / format::kHeaderFile);
  if (!session_json) return session_json.error();
  const fs::path target = fs::absolute(file).lexically_normal();
  std::error_code error;
  fs::create_directories(target.parent_path(), error);
  if (error) return badInput(file.string(), "", "its folder cannot be made: " + error.message());
  fs::path part = target;
  part.replace_filename("." + target.filename().string() + ".part-" + std::to_string(::getpid()));
  fs::remove(part, error);
  auto written = writeHdf5(**reader, *session_json, part, file.string());
  std::error_code rename_error;
  if (written) fs::rename(part, target, rename_error);
  if (written && !rename_error) return syncFolder(target.parent_path());
  fs::remove(part, error);
  if (!written) return written;
  return badInput(file.string(), "", "cannot be put in place: " + rename_error.message());
}

}  // namespace tenter
