// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tenter/session/session_reader.h"

namespace tenter {

/// All that one pass over a journal tells. Damage is described, never an error.
struct JournalSurvey {
  std::uint64_t records = 0, samples = 0, events = 0;
  std::uint64_t next_sequence = 0;
  std::int64_t last_time_ns = 0;  ///< Largest of all.
  std::vector<FrameRecord> frames;
  std::optional<std::vector<FrameFile>> rest;  ///< Pictures at rest, if a record names them.
  TornTail tail;
  bool lacks_line_end = false;      ///< The last record is whole but for the end of its line.
  std::uint64_t damaged_lines = 0;  ///< Before the tail.
  bool closed = false;
  std::string session_id;     ///< From the first record; empty if that is no "begin".
  std::string header_sha256;  ///< From the same.
  std::vector<std::string> problems;
};

/// Error: the journal cannot be read at all.
Result<JournalSurvey> surveyJournal(const std::filesystem::path& folder,
                                    const SessionHeader& header);

/// Images and half-written images below frames/ that no record names, relative to the session.
Result<std::vector<std::string>> strayFiles(const std::filesystem::path& folder,
                                            const std::vector<FrameRecord>& frames);

}  // namespace tenter
