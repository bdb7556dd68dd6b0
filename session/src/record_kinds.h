// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

#include "tenter/session/records.h"

namespace tenter {

/// How a record says what it is. `event` is empty but for kind "event".
struct RecordKind {
  std::string_view kind, event;
};

/// Views into static texts, or into a generic record's own.
RecordKind kindOf(const RecordBody& body);

/// Whether a generic record may be called so.
bool isGenericKind(std::string_view kind);

}  // namespace tenter
