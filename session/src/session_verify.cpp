// SPDX-License-Identifier: GPL-3.0-or-later
#include <set>
#include <system_error>

#include "posix_file.h"
#include "session_format.h"
#include "session_repair.h"
#include "session_survey.h"
#include "tenter/core/files.h"
#include "tenter/session/rest_pictures.h"
#include "tenter/session/session_reader.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxProblems = 1000;

SessionReport reportOf(const JournalSurvey& survey) {
  SessionReport report;
  report.records = survey.records;
  report.frames = survey.frames.size();
  report.samples = survey.samples;
  report.events = survey.events;
  report.cut_bytes = survey.tail.cut_bytes;
  report.cut_records = survey.tail.cut_records;
  report.duration_ns = survey.last_time_ns;
  report.closed = survey.closed && survey.tail.cut_bytes == 0;
  report.rest_pictures = survey.rest ? survey.rest->size() : 0;
  report.problems = survey.problems;
  return report;
}

Result<SessionReport> inspect(const fs::path& folder, const SessionHeader& header,
                              JournalSurvey& survey) {
  auto surveyed = surveyJournal(folder, header);
  if (!surveyed) return surveyed.error();
  survey = std::move(*surveyed);
  SessionReport report = reportOf(survey);
  countRepairs(folder, report);
  const auto strays = strayFiles(folder, survey.frames);
  if (!strays) return strays.error();
  report.stray_files = strays->size();
  return report;
}

void limitProblems(SessionReport& report) {
  if (report.problems.size() <= kMaxProblems) return;
  const std::size_t more = report.problems.size() - kMaxProblems;
  report.problems.resize(kMaxProblems);
  report.problems.push_back("and " + std::to_string(more) + " more");
}

/// The journal is this header's, and the header what it was when the session began.
Result<void> checkHeader(const fs::path& folder, const SessionHeader& header,
                         const JournalSurvey& survey, SessionReport& report) {
  if (survey.session_id.empty()) {
    report.problems.push_back(std::string(format::kJournalFile) + ": does not begin with a \"" +
                              format::kBegin + "\" record");
    return {};
  }
  if (survey.session_id != header.id) {
    report.problems.push_back(std::string(format::kJournalFile) + ": belongs to session '" +
                              survey.session_id + "'");
  }
  const auto hash = sha256OfPath(folder / format::kHeaderFile);
  if (!hash) return hash.error();
  if (*hash != survey.header_sha256) {
    report.problems.push_back(std::string(format::kHeaderFile) +
                              ": was changed after the session began");
  }
  return {};
}

/// What is wrong with one image, or nothing.
std::string imageComplaint(const fs::path& folder, const FrameFile& file) {
  const fs::path path = folder / file.name;
  // Neither links nor pipes are what the writer made.
  if (const auto opened = openForReading(path); !opened) return opened.error().reason;
  const auto bytes = readFile(path);
  if (!bytes) return bytes.error().reason;
  if (bytes->size() != file.size_bytes) {
    return "has " + std::to_string(bytes->size()) + " bytes instead of " +
           std::to_string(file.size_bytes);
  }
  return sha256(*bytes) == file.sha256 ? "" : "has another SHA-256 than its record";
}

void checkFrames(const fs::path& folder, const JournalSurvey& survey, SessionReport& report) {
  std::set<std::string> seen;
  std::int64_t expected = 0;
  for (const FrameRecord& frame : survey.frames) {
    if (frame.frame != expected) {
      report.problems.push_back("frame " + std::to_string(frame.frame) + ": comes instead of " +
                                std::to_string(expected));
    }
    expected = frame.frame + 1;
    for (const FrameFile& file : frame.files) {
      if (!seen.insert(file.name).second) {
        report.problems.push_back(file.name + ": is named by two records");
        continue;
      }
      if (const std::string complaint = imageComplaint(folder, file); !complaint.empty()) {
        report.problems.push_back(file.name + ": " + complaint);
      }
    }
  }
}

/// Sessions from before there was a record of them, or pictures that were copied in by hand.
void checkRest(const fs::path& folder, const JournalSurvey& survey, SessionReport& report) {
  std::set<std::string> named;
  if (survey.rest) {
    for (const FrameFile& file : *survey.rest) {
      named.insert(file.name);
      if (const std::string complaint = imageComplaint(folder, file); !complaint.empty())
        report.problems.push_back(file.name + ": " + complaint);
    }
  }
  std::set<std::string> unnamed;
  std::error_code failed;
  fs::directory_iterator entry(folder / kRestFolder, failed);
  for (const fs::directory_iterator end; !failed && entry != end; entry.increment(failed)) {
    const std::string name = std::string(kRestFolder) + "/" + entry->path().filename().string();
    if (!named.contains(name)) unnamed.insert(name);
  }
  for (const std::string& name : unnamed)
    report.notes.push_back(name +
                           ": no record has its SHA-256, so whether it was changed is not "
                           "known");
}

}  // namespace

Result<SessionReport> inspectSession(const fs::path& folder) {
  const auto header = readSessionHeader(folder);
  if (!header) return header.error();
  JournalSurvey survey;
  auto report = inspect(folder, *header, survey);
  if (report) limitProblems(*report);
  return report;
}

Result<SessionReport> verifySession(const fs::path& folder) {
  const auto header = readSessionHeader(folder);
  if (!header) return header.error();
  JournalSurvey survey;
  auto report = inspect(folder, *header, survey);
  if (!report) return report;
  if (auto done = checkHeader(folder, *header, survey, *report); !done) return done.error();
  checkFrames(folder, survey, *report);
  checkRest(folder, survey, *report);
  limitProblems(*report);
  return report;
}

}  // namespace tenter
