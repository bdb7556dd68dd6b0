// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "tenter/acquisition/camera_bank.h"

namespace tenter {

/// Tells what may be wrong with a frame from those that one camera gave before.
class FrameJudge {
 public:
  explicit FrameJudge(const CameraSection& section) : section_(&section) {}

  /// As of a camera that was opened anew.
  void forget();
  /// A trigger goes out.
  void triggered(std::int64_t now_ns);
  /// A frame that was asked for has not come, so how many are to come is not known any more.
  void missed() { last_id_.reset(); }
  /// Whether the frame belongs to an earlier trigger: its number or its time stamp are too small.
  bool isStale(const CameraImage& image) const;
  /// Fills in quality and fault, and remembers the frame.
  void judge(SetFrame& frame);

 private:
  FrameFault faultOf(const SetFrame& frame, std::size_t hash) const;

  const CameraSection* section_;
  std::optional<std::uint64_t> last_id_;
  std::optional<std::size_t> last_hash_;
  std::uint64_t triggers_ = 0;  ///< Since the frame of last_id_.
  std::int64_t trigger_ns_ = 0, trigger_before_ns_ = 0;
  std::deque<std::int64_t> leads_ns_;  ///< Camera's clock at the frame minus ours at its trigger.
  std::deque<double> sharpnesses_;
};

}  // namespace tenter
