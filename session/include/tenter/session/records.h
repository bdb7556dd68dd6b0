// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace tenter {

/// Whether a tension may be believed.
enum class TensionStatus { kOk, kStale, kOverRange, kFault, kMissing };

/// One load cell in one sample. A status of kOk has a number; NaN counts as no number.
struct TensionReading {
  std::optional<double> tension_N;
  TensionStatus status = TensionStatus::kMissing;
  std::int64_t age_ns = 0;  ///< How long before the sample's time the cell was read; not negative.
};

/// What the rig felt at one moment, in the order of the header's `actuators` and `cells`.
struct SampleRecord {
  std::vector<std::optional<double>> positions_m;  ///< Travel; nothing where it was not read.
  std::vector<TensionReading> tensions;
};

/// One image of a frame as it lies on disk.
struct FrameFile {
  std::string name;    ///< "frames/000012-left.png", relative to the session.
  std::string sha256;  ///< 64 lower-case hexadecimal digits.
  std::uint64_t size_bytes = 0;
};

/// One moment seen by the cameras.
struct FrameRecord {
  std::int64_t frame = 0;  ///< Counts from 0 without gaps.
  std::vector<FrameFile> files;
};

/// A phase of the protocol begins or ends.
struct PhaseRecord {
  std::int64_t index = 0;  ///< Place in the protocol, from 0.
  std::int64_t cycle = 0;  ///< Which repetition, from 0.
  std::string name;
  bool begins = true;
};

/// Something a person asked for.
struct OperatorEvent {
  std::string action;  ///< "jog", "pause", "note" ...
  std::string text;
};

/// The safety state machine went from one state to another.
struct StateChange {
  std::string from, to, reason;
};

/// Something went wrong.
struct FaultEvent {
  std::string source;  ///< Device or part: "cell-3", "disk".
  std::string fault;   ///< Its short name: "stale".
  std::string text;
};

/// What the program decided from the records before it; compared byte for byte on replay.
struct Decision {
  std::string name;
  std::string data = "{}";  ///< A JSON object on one line; kept byte for byte.
};

/// The store's own: "begin", "resumed", "closed".
struct SessionEvent {
  std::string what;
  std::string data = "{}";  ///< A JSON object on one line; kept byte for byte.
};

/// Any other kind, so that a later program can add its own and an older one still reads the file.
struct GenericRecord {
  std::string kind;         ///< Lower-case letters, digits, '-'; none of the kinds above.
  std::string data = "{}";  ///< A JSON object on one line; kept byte for byte.
};

using RecordBody = std::variant<SampleRecord, FrameRecord, PhaseRecord, OperatorEvent, StateChange,
                                FaultEvent, Decision, SessionEvent, GenericRecord>;

/// One line of the journal.
struct JournalRecord {
  std::uint64_t sequence = 0;  ///< Counts from 0 without gaps.
  std::int64_t time_ns = 0;    ///< Since the session's start.
  RecordBody body;
  std::string text;  ///< The JSON as it stands in the file, without its CRC.
};

/// Whether the record belongs to the log of events that replays are compared by.
bool isEvent(const RecordBody& body);

/// "ok", "stale", "over-range", "fault", "missing".
std::string_view nameOf(TensionStatus status);

}  // namespace tenter
