// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <thread>
#include <vector>

namespace tenter {

/// Calls work(i, worker) for i in [0, count), shared out over `threads` in a fixed manner, so that
/// results that depend on i alone do not depend on the number of threads. `work` must not throw.
template <class Work>
void parallelFor(std::size_t count, int threads, const Work& work) {
  const std::size_t workers = std::min(static_cast<std::size_t>(std::max(threads, 1)), count);
  const auto share = [&](std::size_t worker) {
    for (std::size_t i = worker; i < count; i += workers) work(i, worker);
  };
  std::vector<std::thread> others;
  for (std::size_t worker = 1; worker < workers; ++worker) others.emplace_back(share, worker);
  if (workers > 0) share(0);
  for (std::thread& other : others) other.join();
}

}  // namespace tenter
