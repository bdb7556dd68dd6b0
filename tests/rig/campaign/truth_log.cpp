// SPDX-License-Identifier: GPL-3.0-or-later
#include "truth_log.h"

#include <algorithm>
#include <chrono>

#include "tenter/rig/load_cell.h"

namespace tenter::campaign {
namespace {

constexpr std::chrono::milliseconds kStep{1};
constexpr std::size_t kMost = 120'000;
constexpr std::int64_t kGap_ns = 20'000'000;
/// Two microsteps; what is less is a rest.
constexpr double kStill_m = 2e-6;

}  // namespace

TruthLog::TruthLog(ServedRig& rig) : rig_(rig), thread_([this] { watch(); }) {}

TruthLog::~TruthLog() {
  quitting_ = true;
  thread_.join();
}

void TruthLog::forget() {
  const std::lock_guard lock(mutex_);
  looks_.clear();
}

TruthLog::Look TruthLog::look() const {
  Look now;
  now.begin_ns = monotonic_ns();
  for (int i = 0; i < ServedRig::kAxes; ++i) {
    const auto at = static_cast<std::size_t>(i);
    now.position_m[at] = rig_.usb().state(i).position_units * ServedRig::kMetresPerMicrostep;
    now.tension_N[at] = rig_.felt_N(i);
  }
  now.time_ns = monotonic_ns();
  return now;
}

void TruthLog::watch() {
  while (!quitting_) {
    std::this_thread::sleep_for(kStep);
    const Look now = look();
    const std::lock_guard lock(mutex_);
    looks_.push_back(now);
    if (looks_.size() > kMost) looks_.pop_front();
  }
}

std::optional<std::pair<double, double>> TruthLog::tensions_N(int cord, std::int64_t from_ns,
                                                              std::int64_t to_ns) const {
  const std::lock_guard lock(mutex_);
  const auto after = [](const Look& look, std::int64_t time_ns) { return look.time_ns < time_ns; };
  auto look = std::lower_bound(looks_.begin(), looks_.end(), from_ns, after);
  if (look == looks_.begin() || look == looks_.end()) return std::nullopt;
  --look;
  double lowest_N = 1e300, highest_N = -1e300;
  std::int64_t last_ns = look->time_ns;
  for (; look != looks_.end(); ++look) {
    if (look->time_ns - last_ns > kGap_ns) return std::nullopt;
    last_ns = look->time_ns;
    const double tension_N = look->tension_N[static_cast<std::size_t>(cord)];
    lowest_N = std::min(lowest_N, tension_N);
    highest_N = std::max(highest_N, tension_N);
    if (look->begin_ns > to_ns) return std::pair(lowest_N, highest_N);
  }
  return std::nullopt;
}

std::int64_t TruthLog::lastLoading_ns(std::int64_t from_ns) const {
  const std::lock_guard lock(mutex_);
  std::int64_t last_ns = 0;
  std::optional<Look> lowest;
  for (const Look& look : looks_) {
    if (look.time_ns < from_ns) continue;
    if (!lowest) lowest = look;
    for (std::size_t i = 0; i < look.position_m.size(); ++i) {
      double& reference_m = lowest->position_m[i];
      if (look.position_m[i] > reference_m + kStill_m) {
        last_ns = look.time_ns;
        reference_m = look.position_m[i];
      }
      reference_m = std::min(reference_m, look.position_m[i]);
    }
  }
  return last_ns;
}

std::int64_t TruthLog::lastMotion_ns(std::int64_t from_ns) const {
  const std::lock_guard lock(mutex_);
  std::int64_t last_ns = 0;
  std::optional<Look> reference;
  for (const Look& look : looks_) {
    if (look.time_ns < from_ns) continue;
    if (!reference) reference = look;
    for (std::size_t i = 0; i < look.position_m.size(); ++i) {
      if (std::abs(look.position_m[i] - reference->position_m[i]) <= kStill_m) continue;
      last_ns = look.time_ns;
      reference->position_m[i] = look.position_m[i];
    }
  }
  return last_ns;
}

double TruthLog::drawn_m(std::int64_t from_ns, std::int64_t to_ns) const {
  const std::lock_guard lock(mutex_);
  double drawn_m = 0.0;
  const Look* before = nullptr;
  for (const Look& look : looks_) {
    if (look.time_ns < from_ns || look.time_ns > to_ns) continue;
    if (before != nullptr) {
      double step_m = 0.0;
      for (std::size_t i = 0; i < look.position_m.size(); ++i) {
        step_m += std::max(0.0, look.position_m[i] - before->position_m[i]);
      }
      drawn_m += step_m;
    }
    before = &look;
  }
  return drawn_m;
}

}  // namespace tenter::campaign
