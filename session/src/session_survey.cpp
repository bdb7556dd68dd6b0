// SPDX-License-Identifier: GPL-3.0-or-later
#include "session_survey.h"

#include <algorithm>
#include <set>
#include <system_error>

#include "journal_line.h"
#include "posix_file.h"
#include "record_codec.h"
#include "session_format.h"
#include "tenter/core/json_reader.h"
#include "tenter/session/rest_pictures.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

namespace {

/// Bad lines since the last good one: damage if another good one follows, else the tail.
struct BadRun {
  std::uint64_t lines = 0;
  std::vector<std::string> whole_lines;  ///< Complaints about those that no crash explains.
};

constexpr std::size_t kMaxComplaints = 1000;

std::string lineName(const JournalLine& line) {
  return std::string(format::kJournalFile) + ": line " + std::to_string(line.number);
}

class Surveyor {
 public:
  explicit Surveyor(const SessionHeader& header) : header_(header) {}

  void take(JournalLine line) {
    if (!line.good) return takeBad(line);
    takeRun();
    survey_.tail.offset_bytes = line.offset_bytes + line.size_bytes;
    survey_.lacks_line_end = !line.has_line_end;
    ++survey_.records;
    auto record = decodeRecord(std::move(line.json), header_, format::kJournalFile,
                               "line " + std::to_string(line.number));
    if (!record) {
      // Committed, so its number is taken, whatever is wrong with the rest.
      complain(record.error().message());
      ++survey_.next_sequence;
      survey_.closed = false;
      return;
    }
    checkSequence(*record, lineName(line));
    count(*record);
    readRest(*record, lineName(line));
  }

  JournalSurvey finish() {
    survey_.tail.cut_records = run_.lines;
    for (std::string& text : run_.whole_lines) complain(std::move(text));
    return std::move(survey_);
  }

 private:
  void takeBad(const JournalLine& line) {
    ++run_.lines;
    survey_.tail.cut_bytes += line.size_bytes;
    const bool torn = !line.has_line_end || line.has_nul;
    if (!torn && run_.whole_lines.size() < kMaxComplaints) {
      run_.whole_lines.push_back(lineName(line) + ": its CRC does not fit");
    }
  }

  /// A good line follows what was bad: it stays where it is.
  void takeRun() {
    if (run_.lines == 0) return;
    if (run_.whole_lines.empty()) {
      run_.whole_lines.push_back(std::string(format::kJournalFile) + ": damaged at byte " +
                                 std::to_string(survey_.tail.offset_bytes));
    }
    for (std::string& text : run_.whole_lines) complain(std::move(text));
    survey_.damaged_lines += run_.lines;
    survey_.tail.cut_bytes = 0;
    run_ = {};
    after_damage_ = true;
  }

  void checkSequence(const JournalRecord& record, const std::string& place) {
    const bool expected = record.sequence == survey_.next_sequence;
    const bool skipped = after_damage_ && record.sequence > survey_.next_sequence;
    if (!expected && !skipped) {
      complain(place + ": has sequence number " + std::to_string(record.sequence) + " instead of " +
               std::to_string(survey_.next_sequence));
    }
    after_damage_ = false;
    survey_.next_sequence = std::max(survey_.next_sequence, record.sequence + 1);
    if (record.sequence == 0) readBegin(record);
  }

  void readBegin(const JournalRecord& record) {
    const auto* event = std::get_if<SessionEvent>(&record.body);
    if (event == nullptr || event->what != format::kBegin) return;
    const auto data = parseJson(event->data, format::kJournalFile);
    if (!data) return;
    JsonReader in(*data, format::kJournalFile);
    survey_.session_id = in.textOr("session", "");
    survey_.header_sha256 = in.textOr("header_sha256", "");
  }

  void readRest(const JournalRecord& record, const std::string& place) {
    auto rest = restPicturesIn(record.body);
    if (!rest) return complain(place + ": " + rest.error().message());
    if (!rest->has_value()) return;
    if (survey_.rest) return complain(place + ": names pictures at rest again");
    survey_.rest = std::move(*rest);
  }

  void count(const JournalRecord& record) {
    survey_.last_time_ns = std::max(survey_.last_time_ns, record.time_ns);
    if (std::holds_alternative<SampleRecord>(record.body)) ++survey_.samples;
    if (isEvent(record.body)) ++survey_.events;
    if (const auto* frame = std::get_if<FrameRecord>(&record.body))
      survey_.frames.push_back(*frame);
    const auto* event = std::get_if<SessionEvent>(&record.body);
    survey_.closed = event != nullptr && event->what == format::kClosed;
  }

  void complain(std::string text) { survey_.problems.push_back(std::move(text)); }

  const SessionHeader& header_;
  JournalSurvey survey_;
  BadRun run_;
  bool after_damage_ = false;
};

}  // namespace

Result<JournalSurvey> surveyJournal(const fs::path& folder, const SessionHeader& header) {
  auto source = journalSource(folder / format::kJournalFile);
  if (!source) return source.error();
  JournalScanner scanner(std::move(*source));
  Surveyor surveyor(header);
  while (true) {
    auto line = scanner.next();
    if (!line) return line.error();
    if (!line->has_value()) return surveyor.finish();
    surveyor.take(std::move(**line));
  }
}

Result<std::vector<std::string>> strayFiles(const fs::path& folder,
                                            const std::vector<FrameRecord>& frames) {
  std::set<std::string> known;
  for (const FrameRecord& frame : frames) {
    for (const FrameFile& file : frame.files) known.insert(file.name);
  }
  std::vector<std::string> strays;
  std::error_code error;
  fs::directory_iterator entry(folder / format::kFramesFolder, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    const std::string name =
        std::string(format::kFramesFolder) + "/" + entry->path().filename().string();
    if (!known.contains(name)) strays.push_back(name);
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    return badInput((folder / format::kFramesFolder).string(), "",
                    "cannot be listed: " + error.message());
  }
  std::sort(strays.begin(), strays.end());
  return strays;
}

}  // namespace tenter
