// SPDX-License-Identifier: GPL-3.0-or-later
#include "fault_names.h"

namespace tenter::daemon {
namespace {

/// Far more than cells can do between two ticks; a loop that is stuck does not fill the memory.
constexpr std::size_t kMostEvents = 4096;

}  // namespace

void CellEvents::push(const LoadCellEvent& event) {
  const std::lock_guard lock(mutex_);
  if (events_.size() < kMostEvents) events_.push_back(event);
}

std::vector<LoadCellEvent> CellEvents::take() {
  const std::lock_guard lock(mutex_);
  std::vector<LoadCellEvent> events;
  events.swap(events_);
  return events;
}

bool FaultNames::isNews(const std::string& source, const std::string& fault, std::int64_t now_ns) {
  const auto [entry, is_new] = told_ns_.try_emplace({source, fault}, now_ns);
  if (is_new) return true;
  const bool is_news = now_ns - entry->second > kQuiet_ns;
  entry->second = now_ns;
  return is_news;
}

}  // namespace tenter::daemon
