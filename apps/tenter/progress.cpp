// SPDX-License-Identifier: GPL-3.0-or-later
#include "progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tenter::app {

namespace {

constexpr int kBarWidth = 24;
constexpr auto kInterval = std::chrono::milliseconds(100);
constexpr const char* kEraseLine = "\r\x1b[K";

}  // namespace

Progress::Progress(const Console& console)
    : active_(!console.quiet && isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (drawn_) std::fputs(kEraseLine, stderr);
}

void Progress::show(double fraction, const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (!active_ || (drawn_ && now - last_ < kInterval)) return;
  last_ = now;
  drawn_ = true;
  std::string bar;
  if (fraction >= 0.0) {
    const int filled = static_cast<int>(std::lround(kBarWidth * std::min(fraction, 1.0)));
    bar = "[" + std::string(static_cast<std::size_t>(filled), '#') +
          std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + "] ";
  }
  std::fprintf(stderr, "%s%s%s", kEraseLine, bar.c_str(), text.c_str());
  std::fflush(stderr);
}

}  // namespace tenter::app
