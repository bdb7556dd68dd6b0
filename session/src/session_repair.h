// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "session_survey.h"
#include "tenter/session/session_writer.h"

namespace tenter {

/// Moves the torn tail of a journal and stray images into a folder below repairs/ and cuts the
/// journal. `fd` is open for writing and locked. A crash in between leaves work that the next
/// repair does the same way, into the same folder.
Result<RepairReport> repairTornSession(const std::filesystem::path& folder, int fd,
                                       const JournalSurvey& survey,
                                       std::chrono::system_clock::time_point now);

/// What the reports below repairs/ say was cut; adds what is wrong with them to `report`.
void countRepairs(const std::filesystem::path& folder, SessionReport& report);

}  // namespace tenter
