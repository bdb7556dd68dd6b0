// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace tenter::daemon {

/// How late the loop began its ticks: bins of 0.1 ms, without allocation.
class Lateness {
 public:
  void add(std::int64_t late_ns) {
    worst_ns_ = std::max(worst_ns_, late_ns);
    const auto bin = static_cast<std::size_t>(std::max<std::int64_t>(0, late_ns) / kBin_ns);
    ++bins_[std::min(bin, bins_.size() - 1)];
  }

  double worst_ms() const { return 1e-6 * static_cast<double>(worst_ns_); }

  /// The upper end of the bin that `share` of all ticks do not exceed, or the worst if it is less.
  double quantile_ms(double share) const {
    const std::uint64_t count = std::accumulate(bins_.begin(), bins_.end(), std::uint64_t{0});
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count)));
    std::uint64_t below = 0;
    std::size_t bin = 0;
    while (bin + 1 < bins_.size() && (below += bins_[bin]) < wanted) ++bin;
    const double end_ms = 1e-6 * static_cast<double>(kBin_ns) * static_cast<double>(bin + 1);
    return bin + 1 == bins_.size() ? worst_ms() : std::min(end_ms, worst_ms());
  }

 private:
  static constexpr std::int64_t kBin_ns = 100'000;
  std::array<std::uint64_t, 401> bins_{};  ///< The last: 40 ms and more.
  std::int64_t worst_ns_ = 0;
};

}  // namespace tenter::daemon
