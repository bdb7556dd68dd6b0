// SPDX-License-Identifier: GPL-3.0-or-later
#include "session_repair.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <system_error>

#include "posix_file.h"
#include "session_format.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

namespace {

constexpr const char* kReportFormat = "tenter-session-repair";

/// Hands the torn tail to `take` in blocks: it may be larger than memory. Its first error ends it.
Result<void> readTail(const fs::path& journal, int fd, const TornTail& tail,
                      const std::function<Result<void>(std::string_view)>& take) {
  std::string block(std::size_t{1} << 16, '\0');
  std::uint64_t done = 0;
  while (done < tail.cut_bytes) {
    const auto wanted = std::min<std::uint64_t>(block.size(), tail.cut_bytes - done);
    const ssize_t count =
        ::pread(fd, block.data(), wanted, static_cast<off_t>(tail.offset_bytes + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fileError(journal, "cannot be read", errno);
    if (count == 0) return badInput(journal.string(), "", "became shorter while it was repaired");
    auto taken = take(std::string_view(block).substr(0, static_cast<std::size_t>(count)));
    if (!taken) return taken;
    done += static_cast<std::uint64_t>(count);
  }
  return {};
}

Result<std::uint32_t> crcOfTail(const fs::path& journal, int fd, const TornTail& tail) {
  std::uint32_t crc = 0;
  const auto done = readTail(journal, fd, tail, [&](std::string_view block) -> Result<void> {
    crc = crc32Of(block, crc);
    return {};
  });
  if (!done) return done.error();
  return crc;
}

/// Complete or absent, like all that a report speaks of.
Result<void> saveTail(const fs::path& journal, int fd, const TornTail& tail, const fs::path& file) {
  const fs::path part = file.string() + format::kPartSuffix;
  std::error_code error;
  fs::remove(part, error);
  const Descriptor out(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!out.valid()) return fileError(part, "cannot be written", errno);
  auto done = readTail(journal, fd, tail, [&](std::string_view block) -> Result<void> {
    const int code = writeAll(out.get(), block);
    if (code == 0) return {};
    return fileError(part, "cannot be written", code);
  });
  if (done && ::fdatasync(out.get()) != 0) done = fileError(part, "cannot be synced", errno);
  if (done) {
    fs::rename(part, file, error);
    if (!error) return {};
    done = badInput(file.string(), "", "cannot be put in place: " + error.message());
  }
  fs::remove(part, error);
  return done;
}

std::string reportText(const RepairReport& report, std::chrono::system_clock::time_point now) {
  const nlohmann::ordered_json out = {
      {"format", kReportFormat},          {"schema_version", kSessionSchemaVersion},
      {"repaired_utc", utcStamp(now)},    {"offset_bytes", report.offset_bytes},
      {"cut_bytes", report.cut_bytes},    {"cut_records", report.cut_records},
      {"stray_files", report.stray_files}};
  // Names of files need not be UTF-8.
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

/// A name in `folder` that is free, as near to `name` as can be.
fs::path freeName(const fs::path& folder, const fs::path& name) {
  std::error_code error;
  fs::path candidate = folder / name;
  for (int i = 1; fs::exists(fs::symlink_status(candidate, error)); ++i) {
    candidate = folder / (name.string() + "~" + std::to_string(i));
  }
  return candidate;
}

Result<void> moveStrays(const fs::path& session, const fs::path& place,
                        const std::vector<std::string>& strays) {
  for (const std::string& stray : strays) {
    std::error_code error;
    const fs::path from = session / stray;
    fs::rename(from, freeName(place, from.filename()), error);
    if (error) return badInput(from.string(), "", "cannot be moved away: " + error.message());
  }
  if (strays.empty()) return {};
  if (auto done = syncFolder(place); !done) return done;
  return syncFolder(session / format::kFramesFolder);
}

/// The report and all it speaks of are on the disk before anything is cut.
Result<void> save(const fs::path& session, int fd, const TornTail& tail, const RepairReport& report,
                  std::chrono::system_clock::time_point now) {
  const fs::path place = session / report.report;
  std::error_code error;
  fs::create_directories(place, error);
  if (error) return badInput(place.string(), "", "cannot be made: " + error.message());
  if (!fs::exists(place / format::kReportFile, error)) {
    auto done = saveTail(session / format::kJournalFile, fd, tail, place / format::kTailFile);
    if (done) done = writeFileAtomically(place / format::kReportFile, reportText(report, now));
    for (const fs::path& folder : {place, place.parent_path(), session}) {
      if (done) done = syncFolder(folder);
    }
    if (!done) return done;
  }
  return moveStrays(session, place, report.stray_files);
}

Result<void> cut(const fs::path& journal, int fd, const JournalSurvey& survey) {
  const auto end = static_cast<off_t>(survey.tail.offset_bytes);
  if (::ftruncate(fd, end) != 0) return fileError(journal, "cannot be cut", errno);
  if (survey.lacks_line_end) {
    if (const int code = writeAll(fd, "\n"); code != 0) {
      return fileError(journal, "cannot be written", code);
    }
  }
  if (::fsync(fd) != 0) return fileError(journal, "cannot be synced", errno);
  return {};
}

/// Adds one report's numbers, or says what is wrong with it.
void countRepair(const fs::path& file, const std::string& name, SessionReport& report) {
  const auto document = readJsonFile(file);
  if (!document) {
    report.problems.push_back(document.error().message());
    return;
  }
  JsonReader in(*document, name);
  const std::string kind = in.text("format", format::kMaxName);
  const auto bytes = in.integer("cut_bytes", 0, format::kMaxInteger);
  const auto records = in.integer("cut_records", 0, format::kMaxInteger);
  if (in.ok() && kind != kReportFormat) in.fail("format", "is not that of a repair report");
  if (!in.ok()) {
    report.problems.push_back(in.error().message());
    return;
  }
  report.cut_bytes += static_cast<std::uint64_t>(bytes);
  report.cut_records += static_cast<std::uint64_t>(records);
  ++report.repairs;
}

}  // namespace

Result<RepairReport> repairTornSession(const fs::path& folder, int fd, const JournalSurvey& survey,
                                       std::chrono::system_clock::time_point now) {
  const fs::path journal = folder / format::kJournalFile;
  RepairReport report;
  report.cut_bytes = survey.tail.cut_bytes;
  report.cut_records = survey.tail.cut_records;
  report.offset_bytes = survey.tail.offset_bytes;
  report.newline_added = survey.lacks_line_end;
  report.damaged_lines = survey.damaged_lines;
  auto strays = strayFiles(folder, survey.frames);
  if (!strays) return strays.error();
  report.stray_files = std::move(*strays);
  if (report.cut_bytes > 0 || !report.stray_files.empty()) {
    const auto crc = crcOfTail(journal, fd, survey.tail);
    if (!crc) return crc.error();
    report.report = std::string(format::kRepairsFolder) + "/" +
                    format::padded(report.offset_bytes, 12) + "-" + hexadecimal(*crc);
    if (auto done = save(folder, fd, survey.tail, report, now); !done) return done.error();
  }
  if (report.cut_bytes > 0 || report.newline_added) {
    if (auto done = cut(journal, fd, survey); !done) return done.error();
  }
  return report;
}

void countRepairs(const fs::path& folder, SessionReport& report) {
  std::error_code error;
  std::vector<fs::path> places;
  fs::directory_iterator entry(folder / format::kRepairsFolder, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    places.push_back(entry->path());
  }
  std::sort(places.begin(), places.end());
  for (const fs::path& place : places) {
    const fs::path file = place / format::kReportFile;
    // Without its report a repair had not begun to cut: the next one makes it.
    if (!fs::exists(file, error)) continue;
    countRepair(file, file.lexically_relative(folder).string(), report);
  }
}

}  // namespace tenter
