// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "tenter/twin/virtual_cell.h"

namespace tenter {
namespace {

using Kind = VirtualCellFaultKind;

struct FaultName {
  Kind kind;
  std::string_view name;
  std::chrono::microseconds usual_delay{};
};

constexpr std::array kNames{
    FaultName{Kind::kSilence, "silence"},
    FaultName{Kind::kException, "exception-"},  // its code follows
    FaultName{Kind::kBadCrc, "bad-crc"},
    FaultName{Kind::kHalfFrame, "half-frame"},
    FaultName{Kind::kDribble, "dribble", std::chrono::milliseconds(5)},
    FaultName{Kind::kLateAnswer, "late-answer", std::chrono::milliseconds(100)},
    FaultName{Kind::kEcho, "echo"},
    FaultName{Kind::kWrongUnit, "wrong-unit"},
    FaultName{Kind::kWrongFunction, "wrong-function"},
    FaultName{Kind::kWrongCount, "wrong-count"},
    FaultName{Kind::kTrailingBytes, "trailing-bytes"},
    FaultName{Kind::kHangUp, "hang-up"},
    FaultName{Kind::kStuck, "stuck"},
    FaultName{Kind::kNotANumber, "not-a-number"},
    FaultName{Kind::kOverRange, "over-range"},
    FaultName{Kind::kSignFlip, "sign-flip"},
    FaultName{Kind::kWordSwap, "word-swap"},
    FaultName{Kind::kCellError, "cell-error"},
};
constexpr std::array kExceptionCodes{1, 2, 3, 4, 5, 6, 11};

}  // namespace

std::string virtualCellFaultName(const VirtualCellFault& fault) {
  std::string name(kNames[static_cast<std::size_t>(fault.kind)].name);
  if (fault.kind == Kind::kException) name += std::to_string(fault.exception_code);
  return name;
}

std::vector<std::string> virtualCellFaultNames() {
  std::vector<std::string> names;
  for (const FaultName& entry : kNames) {
    if (entry.kind != Kind::kException) {
      names.emplace_back(entry.name);
      continue;
    }
    for (const int code : kExceptionCodes) {
      names.push_back(std::string(entry.name) + std::to_string(code));
    }
  }
  return names;
}

Result<VirtualCellFault> parseVirtualCellFault(std::string_view name) {
  std::string known;
  for (const FaultName& entry : kNames) {
    VirtualCellFault fault{entry.kind, 0, entry.usual_delay, 1};
    if (entry.kind != Kind::kException) {
      if (name == entry.name) return fault;
      known += (known.empty() ? "" : ", ") + std::string(entry.name);
      continue;
    }
    for (const int code : kExceptionCodes) {
      fault.exception_code = code;
      if (name == virtualCellFaultName(fault)) return fault;
      known += (known.empty() ? "" : ", ") + virtualCellFaultName(fault);
    }
  }
  return usageError("there is no fault \"" + std::string(name) + "\" of a load cell",
                    "faults: " + known);
}

bool isFaultOfTheWire(Kind kind) { return kind < Kind::kStuck; }

bool canBefall(Kind kind, bool tcp) {
  return !tcp || (kind != Kind::kBadCrc && kind != Kind::kEcho);
}

}  // namespace tenter
