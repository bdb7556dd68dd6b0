// SPDX-License-Identifier: GPL-3.0-or-later
#include "frame_judge.h"

#include <algorithm>
#include <string_view>

#include "tenter/core/median.h"

namespace tenter {
namespace {

constexpr std::size_t kRemembered = 15;
/// Fewer images say little of how sharp a camera is.
constexpr std::size_t kFewestSharpnesses = 3;

template <class T>
void remember(std::deque<T>& values, T value) {
  values.push_back(value);
  if (values.size() > kRemembered) values.pop_front();
}

std::size_t hashOf(const CameraImage& image) {
  return std::hash<std::string_view>()(
      {reinterpret_cast<const char*>(image.pixels.data()), image.pixels.size()});
}

}  // namespace

void FrameJudge::forget() { *this = FrameJudge(*section_); }

void FrameJudge::triggered(std::int64_t now_ns) {
  ++triggers_;
  trigger_before_ns_ = trigger_ns_;
  trigger_ns_ = now_ns;
}

/// The time between trigger and time stamp may be longer than ever, on a busy machine, but hardly
/// shorter: a frame of the trigger before is earlier by the time between the two.
bool FrameJudge::isStale(const CameraImage& image) const {
  if (triggers_ == 0) return false;
  if (last_id_ && image.frame_id > *last_id_ && image.frame_id - *last_id_ < triggers_) return true;
  if (leads_ns_.empty()) return false;
  const std::int64_t least_ns = *std::min_element(leads_ns_.begin(), leads_ns_.end());
  return image.camera_ns - trigger_ns_ < least_ns - (trigger_ns_ - trigger_before_ns_) / 2;
}

FrameFault FrameJudge::faultOf(const SetFrame& frame, std::size_t hash) const {
  if (last_id_ && frame.image.frame_id == *last_id_) return FrameFault::kRepeatedFrame;
  // Where all is white, images are equal without being the same.
  if (frame.quality.saturated_share > section_->saturated_share) return FrameFault::kSaturated;
  if (last_hash_ == hash) return FrameFault::kFrozen;
  const bool blurred = sharpnesses_.size() >= kFewestSharpnesses &&
                       frame.quality.sharpness < section_->blurred_share * medianOf(sharpnesses_);
  return blurred ? FrameFault::kBlurred : FrameFault::kNone;
}

void FrameJudge::judge(SetFrame& frame) {
  const std::size_t hash = hashOf(frame.image);
  frame.quality = frameQuality(frame.image);
  frame.fault = faultOf(frame, hash);
  last_id_ = frame.image.frame_id;
  last_hash_ = hash;
  if (triggers_ > 0) remember(leads_ns_, frame.image.camera_ns - trigger_ns_);
  triggers_ = 0;
  if (frame.fault == FrameFault::kNone) remember(sharpnesses_, frame.quality.sharpness);
}

}  // namespace tenter
