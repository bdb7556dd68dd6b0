// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/session_reader.h"

#include "journal_line.h"
#include "posix_file.h"
#include "record_codec.h"
#include "session_format.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;

struct SessionReader::State {
  std::string file;
  SessionHeader header;
  JournalScanner scanner;
  std::uint64_t next_sequence = 0;
  TornTail tail;
};

SessionReader::SessionReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
SessionReader::~SessionReader() = default;

Result<std::unique_ptr<SessionReader>> SessionReader::open(const fs::path& folder) {
  auto header = readSessionHeader(folder);
  if (!header) return header.error();
  const fs::path file = folder / format::kJournalFile;
  auto source = journalSource(file);
  if (!source) return source.error();
  std::unique_ptr<State> state(
      new State{file.string(), std::move(*header), JournalScanner(std::move(*source)), 0, {}});
  return std::unique_ptr<SessionReader>(new SessionReader(std::move(state)));
}

const SessionHeader& SessionReader::header() const { return state_->header; }
const TornTail& SessionReader::tail() const { return state_->tail; }

Result<std::optional<JournalRecord>> SessionReader::next() {
  constexpr const char* kAdvice = "`tenter session verify` lists all that is wrong";
  std::string bad_place;  // First bad line; only a good one after it tells damage from a torn tail.
  while (true) {
    auto scanned = state_->scanner.next();
    if (!scanned) return scanned.error();
    if (!scanned->has_value()) return std::optional<JournalRecord>();
    JournalLine& line = **scanned;
    const std::string place = "line " + std::to_string(line.number);
    if (!line.good) {
      if (bad_place.empty()) bad_place = place;
      state_->tail.cut_bytes += line.size_bytes;
      ++state_->tail.cut_records;
      continue;
    }
    if (!bad_place.empty()) {
      return badInput(state_->file, bad_place, "is damaged: its CRC does not fit", kAdvice);
    }
    auto record = decodeRecord(std::move(line.json), state_->header, state_->file, place);
    if (!record) return record.error();
    if (record->sequence != state_->next_sequence) {
      return badInput(state_->file, place,
                      "has sequence number " + std::to_string(record->sequence) + " instead of " +
                          std::to_string(state_->next_sequence),
                      kAdvice);
    }
    ++state_->next_sequence;
    state_->tail.offset_bytes = line.offset_bytes + line.size_bytes;
    return std::optional(std::move(*record));
  }
}

}  // namespace tenter
