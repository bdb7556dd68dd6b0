// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <string>

#include "command.h"

namespace tenter::app {

/// One line on stderr that is rewritten in place; silent unless stderr is a terminal, and with
/// --quiet.
class Progress {
 public:
  explicit Progress(const Console& console);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` in 0 to 1 draws a bar; negative: none. Drawn at most ten times a second.
  void show(double fraction, const std::string& text);

 private:
  bool active_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace tenter::app
