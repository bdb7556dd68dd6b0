// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "tenter/core/result.h"
#include "tenter/session/records.h"
#include "tenter/session/session_header.h"

namespace tenter {

/// A record from its time onwards, `"time_ns":...}`; the store puts the sequence number before it.
/// Error: a value that the format has no place for, or sizes other than the header's.
Result<std::string> encodeRecord(std::int64_t time_ns, const RecordBody& body,
                                 const SessionHeader& header);

/// The whole JSON text of a record.
std::string withSequence(std::uint64_t sequence, std::string_view encoded);

/// The part of a record's text that encodeRecord made; the whole text if it begins otherwise.
std::string_view withoutSequence(std::string_view text);

/// Reads a record; sizes must be the header's. Error names `file`, `place` and the field.
Result<JournalRecord> decodeRecord(std::string text, const SessionHeader& header,
                                   const std::string& file, const std::string& place);

}  // namespace tenter
