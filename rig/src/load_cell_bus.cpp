// SPDX-License-Identifier: GPL-3.0-or-later
#include "load_cell_bus.h"

#include <algorithm>

namespace tenter {
namespace {

// A bus whose cells cannot be asked (closed, waiting) must not keep a processor busy.
constexpr std::int64_t kShortestScan_ns = 2'000'000;

std::int64_t inNanoseconds(int milliseconds) { return std::int64_t{1'000'000} * milliseconds; }

/// The cell's own time, or the map's.
std::int64_t timeOr(std::chrono::milliseconds own, int milliseconds_of_map) {
  return own.count() > 0 ? std::chrono::nanoseconds(own).count()
                         : inNanoseconds(milliseconds_of_map);
}

}  // namespace

LoadCellBus::LoadCellBus(ModbusAddress address, const LoadCellScannerOptions& options)
    : address_(std::move(address)), options_(options) {}

LoadCellBus::~LoadCellBus() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::size_t LoadCellBus::add(const LoadCellConfig& config, std::size_t number) {
  cells_.push_back(std::make_unique<Cell>(config, number));
  return cells_.size() - 1;
}

void LoadCellBus::start() {
  ModbusTiming timing;
  timing.response_timeout_ns = timing.longest_latency_ns = 0;
  for (const auto& cell : cells_) {
    const LoadCellConfig& config = cell->reader.config();
    timing.response_timeout_ns =
        std::max(timing.response_timeout_ns,
                 timeOr(config.response_timeout, config.map->response_timeout_ms));
    timing.longest_latency_ns = std::max(
        timing.longest_latency_ns, timeOr(config.longest_latency, config.map->longest_latency_ms));
  }
  link_ = std::make_unique<ModbusLink>(address_, timing);
  planned_ns_ = plannedScan_ns();
  for (const auto& cell : cells_) {
    cell->last.scan_ns = planned_ns_;
    cell->snapshot.store(cell->last);
  }
  thread_ = std::thread([this] { loop(); });
}

/// RTU: frames and gaps at the bus's speed and the amplifiers' usual turnaround.
std::int64_t LoadCellBus::plannedScan_ns() const {
  if (address_.tcp) return std::chrono::nanoseconds(options_.tcp_period).count();
  constexpr int kRequest = 8, kAnswerFrame = 5;  // bytes
  std::int64_t time_ns = 0;
  for (const auto& cell : cells_) {
    const RegisterMap& map = *cell->reader.config().map;
    for (const RegisterBlock& block : map.blocks) {
      const int most = *std::max_element(block.counts.begin(), block.counts.end());
      time_ns += rtuCharacter_ns(address_) * (kRequest + kAnswerFrame + 2 * most) +
                 2 * rtuGap_ns(address_.baud) + inNanoseconds(map.turnaround_ms);
    }
  }
  return time_ns;
}

void LoadCellBus::scanCell(Cell& cell) {
  const LoadCellSample sample = cell.reader.sample(*link_);
  LoadCellReading reading = cell.last;
  reading.attempt_ns = monotonic_ns();
  reading.fault = sample.fault;
  reading.exception_code = sample.exception_code;
  if (sample.late_seen) ++reading.late_answers;
  if (sample.fault == LoadCellFault::kNone) {
    ++reading.samples;
    reading.last_gross_N = sample.gross_N;
    reading.last_net_N = sample.net_N;
    reading.stamp_ns = sample.stamp_ns;
    reading.stable = sample.stable;
    reading.net_mode = sample.net_mode;
  } else {
    ++reading.failures;
  }
  cell.snapshot.store(reading);
  if (options_.on_reading) options_.on_reading(reading);
  const bool changed =
      reading.fault != cell.last.fault || reading.exception_code != cell.last.exception_code;
  cell.last = reading;
  if (!options_.on_event) return;
  if (sample.late_seen && sample.fault != LoadCellFault::kLateAnswer) {
    options_.on_event({cell.number, LoadCellFault::kLateAnswer, 0, reading.attempt_ns});
  }
  if (changed) {
    options_.on_event({cell.number, reading.fault, reading.exception_code, reading.attempt_ns});
  }
}

void LoadCellBus::doOrders() {
  if (!has_orders_.load(std::memory_order_acquire)) return;
  std::unique_lock lock(mutex_);
  while (!orders_.empty()) {
    const std::shared_ptr<Order> order = orders_.front();
    orders_.erase(orders_.begin());
    if (order->given_up) continue;
    order->begun = true;
    lock.unlock();
    const ModbusAnswer answer = order->job(*this);
    lock.lock();
    order->answer = answer;
    changed_.notify_all();
  }
  has_orders_.store(false, std::memory_order_release);
}

std::optional<ModbusAnswer> LoadCellBus::run(Job job, std::chrono::milliseconds limit) {
  const auto order = std::make_shared<Order>();
  order->job = std::move(job);
  std::unique_lock lock(mutex_);
  orders_.push_back(order);
  has_orders_.store(true, std::memory_order_release);
  changed_.wait_for(lock, limit, [&] { return order->answer.has_value(); });
  order->given_up = true;
  return order->answer;
}

void LoadCellBus::noteScan(std::int64_t begin_ns) {
  totals_.last_ns = monotonic_ns() - begin_ns;
  totals_.longest_ns = std::max(totals_.longest_ns, totals_.last_ns);
  const auto scans = static_cast<std::int64_t>(totals_.scans);
  totals_.mean_ns += (totals_.last_ns - totals_.mean_ns) / (scans + 1);
  ++totals_.scans;
  statistics_.store(totals_);
}

void LoadCellBus::loop() {
  const std::int64_t period_ns = address_.tcp ? planned_ns_ : kShortestScan_ns;
  std::int64_t begin_ns = monotonic_ns();
  while (!stop_) {
    for (const auto& cell : cells_) {
      doOrders();
      if (stop_) return;
      scanCell(*cell);
    }
    noteScan(begin_ns);
    // A scan that took too long is not made up for by a burst.
    const std::int64_t now_ns = monotonic_ns();
    const std::int64_t next_ns = std::max(begin_ns + period_ns, now_ns);
    std::this_thread::sleep_for(std::chrono::nanoseconds(next_ns - now_ns));
    begin_ns = next_ns;
  }
}

}  // namespace tenter
