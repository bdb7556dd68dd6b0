// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "tenter/acquisition/camera.h"

namespace tenter {
namespace {

struct Row {
  FrameFault fault;
  std::string_view name, text;
  bool lost;
};

constexpr std::array<Row, 11> kRows{{
    {FrameFault::kNone, "", "", false},
    {FrameFault::kNotConnected, "not-connected", "the camera is not there", true},
    {FrameFault::kSwapped, "swapped", "another camera answers at its address", true},
    {FrameFault::kNoAnswer, "no-answer", "the camera does not answer", true},
    {FrameFault::kNoFrame, "no-frame", "no image came in time", true},
    {FrameFault::kLostPackets, "lost-packets", "a part of the image was lost", true},
    {FrameFault::kStale, "stale", "the image was taken before the trigger", true},
    {FrameFault::kRepeatedFrame, "repeated-frame", "the camera gives one frame twice", true},
    {FrameFault::kFrozen, "frozen", "the image is that of before, pixel for pixel", true},
    {FrameFault::kSaturated, "saturated", "the image is over-exposed", false},
    {FrameFault::kBlurred, "blurred", "the image is far less sharp than before", false},
}};

const Row& rowOf(FrameFault fault) { return kRows.at(static_cast<std::size_t>(fault)); }

}  // namespace

std::string_view frameFaultName(FrameFault fault) { return rowOf(fault).name; }
std::string_view frameFaultText(FrameFault fault) { return rowOf(fault).text; }
bool isLost(FrameFault fault) { return rowOf(fault).lost; }

}  // namespace tenter
