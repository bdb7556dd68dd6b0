// SPDX-License-Identifier: GPL-3.0-or-later
#include "yield_to_others.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

namespace tenter {

void yieldToOthers(int nice) {
  const auto self = static_cast<id_t>(gettid());
  const sched_param ordinary{};
  sched_setscheduler(gettid(), SCHED_OTHER, &ordinary);  // though the program be real-time
  setpriority(PRIO_PROCESS, self, std::max(nice, getpriority(PRIO_PROCESS, self)));
}

}  // namespace tenter
