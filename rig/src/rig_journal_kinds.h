// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

/// Kinds of a session's records that hold what the machine went by.
namespace tenter::rig_journal {

/// Of RigCommand::Mapping, in its order.
inline constexpr std::array<const char*, 3> kMappingNames{"unasked", "check", "skip"};

inline constexpr const char* kMemory = "rig-memory";
inline constexpr const char* kInput = "rig-input";
inline constexpr const char* kHalt = "rig-halt";
inline constexpr const char* kCommand = "rig-command";

}  // namespace tenter::rig_journal
