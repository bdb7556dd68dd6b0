// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

/// Kinds of a session's records that hold what the machine went by.
namespace tenter::rig_journal {

inline constexpr const char* kMemory = "rig-memory";
inline constexpr const char* kInput = "rig-input";
inline constexpr const char* kHalt = "rig-halt";
inline constexpr const char* kCommand = "rig-command";

}  // namespace tenter::rig_journal
