// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/session_writer.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>

#include "frame_store.h"
#include "journal_file.h"
#include "record_codec.h"
#include "session_format.h"
#include "session_repair.h"
#include "tenter/core/files.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

struct SessionWriter::State {
  fs::path folder;
  SessionHeader header;
  std::unique_ptr<JournalFile> journal;
  std::atomic<std::int64_t> last_time_ns{0};
  std::mutex frame_mutex;  ///< One frame after the other, in the order of their numbers.
  std::int64_t next_frame = 0;
};

namespace {

SessionEvent beginEvent(const SessionHeader& header, std::string_view header_json) {
  const nlohmann::ordered_json data = {{"session", header.id},
                                       {"schema_version", kSessionSchemaVersion},
                                       {"header_sha256", sha256(header_json)}};
  return {format::kBegin, data.dump()};
}

Result<void> buildSession(const fs::path& scratch, const SessionHeader& header) {
  const auto json = sessionHeaderJson(header);
  if (!json) return json.error();
  const auto encoded = encodeRecord(0, beginEvent(header, *json), header);
  if (!encoded) return encoded.error();
  std::string line;
  appendSealed(line, withSequence(0, *encoded));
  if (auto done = writeFileAtomically(scratch / format::kHeaderFile, *json); !done) return done;
  if (auto done = writeFileAtomically(scratch / format::kJournalFile, line); !done) return done;
  std::error_code error;
  fs::create_directory(scratch / format::kFramesFolder, error);
  if (error) return badInput(scratch.string(), "", "cannot be filled: " + error.message());
  return syncFolder(scratch);
}

/// Samples and frames leave the last of the disk to the rest.
bool mayUseReserve(const RecordBody& body) {
  return !std::holds_alternative<SampleRecord>(body) && !std::holds_alternative<FrameRecord>(body);
}

bool waitsForDisk(const RecordBody& body, Commit commit) {
  if (commit == Commit::kByKind) return !std::holds_alternative<SampleRecord>(body);
  return commit == Commit::kNow;
}

/// A number that no frame of the session has, whole or damaged.
std::int64_t frameAfter(const std::vector<FrameRecord>& frames) {
  std::int64_t next = 0;
  for (const FrameRecord& frame : frames) next = std::max(next, frame.frame + 1);
  return next;
}

Result<void> checkIdentity(const fs::path& folder, const SessionHeader& header,
                           const JournalSurvey& survey) {
  if (survey.session_id.empty() || survey.session_id == header.id) return {};
  return badInput(
      (folder / format::kJournalFile).string(), "line 1",
      "belongs to session '" + survey.session_id + "', session.json to '" + header.id + "'");
}

SessionEvent resumedEvent(const RepairReport& repair, std::chrono::system_clock::time_point now) {
  const nlohmann::ordered_json data = {{"utc", utcStamp(now)},
                                       {"cut_bytes", repair.cut_bytes},
                                       {"cut_records", repair.cut_records},
                                       {"stray_files", repair.stray_files.size()},
                                       {"report", repair.report}};
  return {format::kResumed, data.dump()};
}

/// Where the clock of the session stands now, by UTC, but never before its last record.
std::int64_t resumeTime_ns(const SessionHeader& header, std::int64_t last_time_ns,
                           std::chrono::system_clock::time_point now) {
  const auto since_1970 =
      std::chrono::duration_cast<std::chrono::nanoseconds>(now.time_since_epoch()).count();
  const std::int64_t elapsed_ns = since_1970 - parseUtcStamp(header.start_utc).value_or(since_1970);
  return std::min(std::max(elapsed_ns, last_time_ns), format::kMaxInteger);
}

bool isWhole(const RepairReport& repair) {
  return repair.cut_bytes == 0 && !repair.newline_added && repair.stray_files.empty();
}

/// A session locked and looked through.
struct HeldSession {
  SessionHeader header;
  Descriptor lock;
  JournalSurvey survey;
};

Result<HeldSession> holdSession(const fs::path& folder) {
  auto header = readSessionHeader(folder);
  if (!header) return header.error();
  auto lock = lockJournal(folder / format::kJournalFile);
  if (!lock) return lock.error();
  auto survey = surveyJournal(folder, *header);
  if (!survey) return survey.error();
  if (auto done = checkIdentity(folder, *header, *survey); !done) return done.error();
  return HeldSession{std::move(*header), std::move(*lock), std::move(*survey)};
}

}  // namespace

SessionWriter::SessionWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
SessionWriter::~SessionWriter() = default;

Result<std::unique_ptr<SessionWriter>> SessionWriter::create(const fs::path& folder,
                                                             const SessionHeader& header) {
  const auto build = [&](const fs::path& scratch) { return buildSession(scratch, header); };
  if (auto done = writeFolderAtomically(folder, FolderKind{}, build); !done) return done.error();
  const fs::path file = folder / format::kJournalFile;
  auto lock = lockJournal(file);
  if (!lock) return lock.error();
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) return badInput(file.string(), "", "cannot be read: " + error.message());
  auto state = std::make_unique<State>();
  state->folder = folder;
  state->header = header;
  state->journal = JournalFile::open(file, std::move(*lock), static_cast<std::int64_t>(size), 1,
                                     std::chrono::nanoseconds(header.commit_interval_ns));
  return std::unique_ptr<SessionWriter>(new SessionWriter(std::move(state)));
}

Result<ResumedSession> SessionWriter::open(const fs::path& folder,
                                           std::chrono::system_clock::time_point now,
                                           bool leave_if_whole) {
  auto held = holdSession(folder);
  if (!held) return held.error();
  auto repair = repairTornSession(folder, held->lock.get(), held->survey, now);
  if (!repair) return repair.error();
  if (leave_if_whole && isWhole(*repair)) return ResumedSession{nullptr, *repair};
  auto state = std::make_unique<State>();
  const std::uint64_t size = repair->offset_bytes + (repair->newline_added ? 1 : 0);
  state->folder = folder;
  state->journal = JournalFile::open(folder / format::kJournalFile, std::move(held->lock),
                                     static_cast<std::int64_t>(size), held->survey.next_sequence,
                                     std::chrono::nanoseconds(held->header.commit_interval_ns));
  state->header = held->header;
  state->next_frame = frameAfter(held->survey.frames);
  std::unique_ptr<SessionWriter> writer(new SessionWriter(std::move(state)));
  if (held->survey.records == 0) {
    const auto json = readFile(folder / format::kHeaderFile);
    if (!json) return json.error();
    const auto begun = writer->append(0, beginEvent(held->header, *json), Commit::kGroup);
    if (!begun) return begun.error();
  }
  const auto added = writer->append(resumeTime_ns(held->header, held->survey.last_time_ns, now),
                                    resumedEvent(*repair, now));
  if (!added) return added.error();
  return ResumedSession{std::move(writer), std::move(*repair)};
}

Result<ResumedSession> SessionWriter::resume(const fs::path& folder,
                                             std::chrono::system_clock::time_point now) {
  return open(folder, now, false);
}

Result<std::unique_ptr<SessionWriter>> SessionWriter::amend(const fs::path& folder) {
  auto held = holdSession(folder);
  if (!held) return held.error();
  const fs::path file = folder / format::kJournalFile;
  const JournalSurvey& survey = held->survey;
  if (survey.tail.cut_bytes > 0 || survey.lacks_line_end || survey.records == 0)
    return badInput(file.string(), "", "ends in a torn record", "tenter session repair");
  auto state = std::make_unique<State>();
  state->folder = folder;
  state->journal = JournalFile::open(
      file, std::move(held->lock), static_cast<std::int64_t>(survey.tail.offset_bytes),
      survey.next_sequence, std::chrono::nanoseconds(held->header.commit_interval_ns));
  state->header = std::move(held->header);
  state->last_time_ns = survey.last_time_ns;
  state->next_frame = frameAfter(survey.frames);
  return std::unique_ptr<SessionWriter>(new SessionWriter(std::move(state)));
}

Result<RepairReport> SessionWriter::repair(const fs::path& folder,
                                           std::chrono::system_clock::time_point now) {
  auto opened = open(folder, now, true);
  if (!opened) return opened.error();
  if (opened->writer) {
    if (auto done = opened->writer->close(opened->writer->lastTime_ns()); !done) {
      return done.error();
    }
  }
  return std::move(opened->repair);
}

Result<std::uint64_t> SessionWriter::append(std::int64_t time_ns, const RecordBody& body,
                                            Commit commit) {
  const auto encoded = encodeRecord(time_ns, body, state_->header);
  if (!encoded) return encoded.error();
  const auto sequence = state_->journal->append(*encoded, mayUseReserve(body));
  if (!sequence) return sequence.error();
  std::int64_t last_ns = state_->last_time_ns;
  while (last_ns < time_ns && !state_->last_time_ns.compare_exchange_weak(last_ns, time_ns)) {
  }
  if (waitsForDisk(body, commit)) {
    if (auto done = state_->journal->sync(); !done) return done.error();
  }
  return *sequence;
}

Result<FrameRecord> SessionWriter::addFrame(std::int64_t time_ns,
                                            std::span<const FrameImage> images) {
  if (auto done = checkImages(images); !done) return done.error();
  const std::lock_guard lock(state_->frame_mutex);
  auto record = storeImages(state_->folder, state_->next_frame, images);
  if (!record) return record.error();
  // With its line in the journal a frame is there, even if the sync then fails.
  ++state_->next_frame;
  const auto added = append(time_ns, *record, Commit::kGroup);
  if (!added) {
    removeImages(state_->folder, *record);
    --state_->next_frame;
    return added.error();
  }
  if (auto done = state_->journal->sync(); !done) return done.error();
  return std::move(*record);
}

Result<void> SessionWriter::sync() { return state_->journal->sync(); }

Result<void> SessionWriter::close(std::int64_t time_ns) {
  const auto added = append(time_ns, SessionEvent{format::kClosed, "{}"});
  auto closed = state_->journal->close();
  if (!added) return added.error();
  return closed;
}

std::uint64_t SessionWriter::committedRecords() const { return state_->journal->committed(); }
std::uint64_t SessionWriter::records() const { return state_->journal->records(); }
std::int64_t SessionWriter::lastTime_ns() const { return state_->last_time_ns; }
const SessionHeader& SessionWriter::header() const { return state_->header; }
const fs::path& SessionWriter::folder() const { return state_->folder; }

}  // namespace tenter
