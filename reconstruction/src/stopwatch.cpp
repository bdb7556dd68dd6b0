// SPDX-License-Identifier: GPL-3.0-or-later
#include "stopwatch.h"

#include <ctime>

namespace tenter {

void Stopwatch::read(CorrelationField& field) const {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin_;
  field.seconds = passed.count();
  field.cpu_seconds = processSeconds() - cpu_begin_;
}

double Stopwatch::processSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace tenter
