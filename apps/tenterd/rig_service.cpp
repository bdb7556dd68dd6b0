// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_service.h"

#include <spdlog/spdlog.h>

namespace tenter::daemon {
namespace {

using namespace std::chrono_literals;
using Kind = RigCommand::Kind;

constexpr auto kTick = 20ms;
constexpr auto kWatchPeriod = 2ms;
constexpr Actuator::Timeout kDeviceTimeout{40}, kEnergiseTimeout{100}, kConnectTimeout{500};
constexpr auto kAnswerLimit = 2s;
constexpr auto kQuitLimit = 30s;
constexpr std::int64_t kReconnectPeriod_ns = 1'000'000'000;

/// What keeps an axis from being moved, though it answers. A late order is cured by the next one.
constexpr std::uint32_t kHarmless = actuator_error::kDeenergised | actuator_error::kCommandTimeout;

TensionReading tensionOf(const CellInput& cell) {
  TensionReading out{cell.gross_N, TensionStatus::kOk, std::max<std::int64_t>(0, cell.age_ns)};
  if (cell.gross_N) return out;
  out.status = cell.fault == "stale"        ? TensionStatus::kStale
               : cell.fault == "over-range" ? TensionStatus::kOverRange
               : cell.fault == "never-read" ? TensionStatus::kMissing
                                            : TensionStatus::kFault;
  return out;
}

nlohmann::json numberOrNull(const std::optional<double>& value) {
  nlohmann::json out;
  if (value) out = *value;
  return out;
}

}  // namespace

Result<std::unique_ptr<RigService>> RigService::start(RigConfig config) {
  std::vector<AxisConfig> axes;
  for (const RigAxis& axis : config.axes) axes.push_back(axis.device);
  auto bank = ActuatorBank::create(std::move(axes));
  if (!bank) return bank.error();
  auto scanner = LoadCellScanner::start(config.cells, {});
  if (!scanner) return scanner.error();
  return std::unique_ptr<RigService>(
      new RigService(std::move(config), *std::move(bank), *std::move(scanner)));
}

RigService::RigService(RigConfig config, ActuatorBank bank,
                       std::unique_ptr<LoadCellScanner> scanner)
    : config_(config),
      bank_(std::move(bank)),
      scanner_(std::move(scanner)),
      machine_(std::move(config)),
      status_{{"rig", config_.name},
              {"state", rigStateName(machine_.state())},
              {"reason", "has not been read yet"},
              {"moving", false}},
      watch_([this] { watch(); }) {}

RigService::~RigService() {
  quitting_ = true;
  watch_.join();
}

void RigService::watch() {
  while (!quitting_ || armed_) {
    const std::int64_t now_ns = monotonic_ns();
    for (std::size_t i = 0; i < config_.cells.size() && armed_; ++i) {
      const LoadCellReading reading = scanner_->reading(i);
      const auto gross_N = reading.gross_N(now_ns);
      const bool over = gross_N ? *gross_N > config_.limits.absolute_N
                                : reading.faultAt(now_ns) == LoadCellFault::kOverRange;
      if (!over) continue;
      {
        const std::lock_guard lock(halt_mutex_);
        trip_ = ForceTrip{static_cast<int>(i), gross_N.value_or(config_.cells[i].capacity_N)};
        armed_ = false;
      }
      (void)bank_.haltAll(kDeviceTimeout);
    }
    std::this_thread::sleep_for(kWatchPeriod);
  }
}

void RigService::stopNow() {
  {
    const std::lock_guard lock(halt_mutex_);
    stopped_ = true;
  }
  (void)bank_.haltAll(kDeviceTimeout);
}

Result<void> RigService::command(RigCommand command, std::shared_ptr<Recorder> recorder) {
  std::unique_lock lock(command_mutex_);
  const std::uint64_t id = command.id = ++last_command_;
  waiting_[id].recorder = std::move(recorder);
  commands_.push_back(std::move(command));
  const bool in_time =
      answered_.wait_for(lock, kAnswerLimit, [&] { return waiting_[id].refusal.has_value(); });
  const std::string refusal = in_time ? *waiting_[id].refusal : "the loop does not answer";
  waiting_.erase(id);
  if (!refusal.empty()) return Error{ErrorKind::kInterlock, "", "", refusal, ""};
  return {};
}

void RigService::loop(const std::function<void()>& each_tick) {
  auto next = std::chrono::steady_clock::now();
  std::optional<std::chrono::steady_clock::time_point> quit_at;
  for (;;) {
    std::this_thread::sleep_until(next);
    const auto now = std::chrono::steady_clock::now();
    noteLateness((now - next).count(), monotonic_ns());
    next = now - next > kTick ? now + kTick : next + kTick;
    tick();
    each_tick();
    if (!quitting_) continue;
    if (!quit_at) quit_at = now;
    if (!machine_.moving() || now - *quit_at > kQuitLimit) break;
  }
  armed_ = false;
  (void)bank_.haltAll(kDeviceTimeout);
  recorder_.reset();
}

void RigService::noteLateness(std::int64_t late_ns, std::int64_t now_ns) {
  ++ticks_;
  worst_late_ns_ = std::max(worst_late_ns_, late_ns);
  if (late_ns <= std::chrono::nanoseconds(kTick).count()) return;
  ++missed_;
  const std::string text = std::to_string(late_ns / 1000) + " us late";
  spdlog::warn("loop: missed deadline, {}", text);
  if (recorder_) recorder_->append(now_ns, FaultEvent{"loop", "missed-deadline", text});
}

void RigService::tick() {
  reconnect();
  RigTick tick = readAll();
  takeCommands(tick);
  const bool was_moving = machine_.moving();
  const RigOrders orders = machine_.step(tick);
  obey(orders);
  record(tick, orders);
  answer(orders);
  publish(tick);
  const RigState state = machine_.state();
  const std::lock_guard lock(halt_mutex_);
  armed_ = !trip_ && !stopped_ && state != RigState::kFault && state != RigState::kStopped &&
           state != RigState::kOff && (!quitting_ || was_moving || machine_.moving());
}

void RigService::reconnect() {
  const std::int64_t now_ns = monotonic_ns();
  const unsigned arrivals = bank_.arrivals();
  if (machine_.moving() || (arrivals == arrivals_ && now_ns < next_reconnect_ns_)) return;
  bool missing = false;
  for (int i = 0; i < bank_.size(); ++i) missing = missing || !bank_.axis(i).connected();
  arrivals_ = arrivals;
  next_reconnect_ns_ = now_ns + kReconnectPeriod_ns;
  if (missing) (void)bank_.reconnectMissing(kConnectTimeout);
}

AxisInput RigService::axisInput(const AxisReading& reading, bool& emergency) const {
  AxisInput input;
  if (!reading.status) {
    input.fault = actuatorFaultName(reading.outcome.fault);
    return input;
  }
  const ActuatorStatus& status = *reading.status;
  input.position_m = status.position_m;
  input.energised = status.energised;
  input.position_certain = !status.position_uncertain;
  input.homing = status.homing;
  for (const std::string& name : actuatorErrorNames(status.errors & ~kHarmless)) {
    input.fault += (input.fault.empty() ? "" : "+") + name;
  }
  if ((status.errors & actuator_error::kKillSwitch) != 0) emergency = true;
  return input;
}

RigTick RigService::readAll() {
  RigTick tick;
  for (const AxisReading& reading : bank_.pollAll(kDeviceTimeout)) {
    tick.axes.push_back(axisInput(reading, tick.emergency_stop));
  }
  const std::int64_t now_ns = monotonic_ns();
  for (std::size_t i = 0; i < config_.cells.size(); ++i) {
    const LoadCellReading reading = scanner_->reading(i);
    const LoadCellFault fault = reading.faultAt(now_ns);
    CellInput cell;
    cell.gross_N = reading.gross_N(now_ns);
    cell.age_ns = reading.samples > 0 ? now_ns - reading.stamp_ns : 0;
    if (!cell.gross_N) cell.fault = loadCellFaultName(fault);
    tick.cells.push_back(std::move(cell));
  }
  tick.time_ns = now_ns;
  tick.operator_gone = !operated_ && !quitting_;
  if (recorder_) tick.recorder_fault = recorder_->fault();
  return tick;
}

void RigService::takeCommands(RigTick& tick) {
  {
    const std::lock_guard lock(halt_mutex_);
    tick.trip = trip_;
    tick.halted_outside = stopped_;
    trip_.reset();
    stopped_ = false;
  }
  {
    const std::lock_guard lock(command_mutex_);
    tick.commands.swap(commands_);
  }
  if (quitting_ && machine_.running()) {
    RigCommand abort;
    abort.kind = Kind::kAbort;
    tick.commands.push_back(abort);
  }
}

void RigService::release() {
  const std::lock_guard lock(halt_mutex_);
  if (!trip_ && !stopped_) bank_.allowMotion();
}

void RigService::obey(const RigOrders& orders) {
  if (orders.halt) {
    (void)bank_.haltAll(kDeviceTimeout);
    return;
  }
  if (orders.deenergise) (void)bank_.deenergiseAll(kEnergiseTimeout);
  if (orders.release_halt) release();
  for (int i = 0; i < bank_.size(); ++i) {
    if (!orders.energise && !orders.home) break;
    // A device that refuses shows in its next reading.
    if (orders.energise) {
      (void)bank_.axis(i).energise(kEnergiseTimeout);
      (void)bank_.axis(i).exitSafeStart(kEnergiseTimeout);
    }
    if (orders.home) (void)bank_.axis(i).goHome(HomeTowards::kMin, kEnergiseTimeout);
  }
  (void)bank_.setTargets(orders.targets_m, kDeviceTimeout);
}

void RigService::record(const RigTick& tick, const RigOrders& orders) {
  for (const RigAnswer& answer : orders.answers) {  // the run's own records go to its session
    const std::lock_guard lock(command_mutex_);
    const auto waiting = waiting_.find(answer.id);
    if (waiting == waiting_.end() || !waiting->second.recorder) continue;
    if (answer.refusal.empty()) recorder_ = waiting->second.recorder;
  }
  for (const RecordBody& body : orders.records) {
    if (const auto* state = std::get_if<StateChange>(&body)) {
      spdlog::info("state: {} -> {} ({})", state->from, state->to, state->reason);
    } else if (const auto* fault = std::get_if<FaultEvent>(&body)) {
      spdlog::warn("fault: {}: {} {}", fault->source, fault->fault, fault->text);
    } else if (const auto* decision = std::get_if<Decision>(&body)) {
      spdlog::info("decision: {} {}", decision->name, decision->data);
    }
  }
  if (!recorder_) return;
  SampleRecord sample;
  for (const AxisInput& axis : tick.axes) sample.positions_m.push_back(axis.position_m);
  for (const CellInput& cell : tick.cells) sample.tensions.push_back(tensionOf(cell));
  recorder_->append(tick.time_ns, std::move(sample));
  for (const RecordBody& body : orders.records) recorder_->append(tick.time_ns, body);
  if (!orders.run_ended) return;
  recorder_->close(tick.time_ns);
  const std::lock_guard lock(command_mutex_);
  recorder_.reset();
}

void RigService::answer(const RigOrders& orders) {
  if (orders.answers.empty()) return;
  const std::lock_guard lock(command_mutex_);
  for (const RigAnswer& answer : orders.answers) {
    const auto waiting = waiting_.find(answer.id);
    if (waiting != waiting_.end()) waiting->second.refusal = answer.refusal;
  }
  answered_.notify_all();
}

void RigService::publish(const RigTick& tick) {
  nlohmann::json status{{"rig", config_.name},
                        {"state", rigStateName(machine_.state())},
                        {"reason", machine_.reason()},
                        {"moving", machine_.moving()},
                        {"emergency_stop", tick.emergency_stop},
                        {"recording", recorder_ != nullptr},
                        {"axes", nlohmann::json::array()},
                        {"cells", nlohmann::json::array()}};
  for (std::size_t i = 0; i < tick.axes.size(); ++i) {
    const AxisInput& axis = tick.axes[i];
    status["axes"].push_back({{"name", config_.axes[i].device.name},
                              {"position_m", numberOrNull(axis.position_m)},
                              {"energised", axis.energised},
                              {"homed", axis.position_certain},
                              {"fault", axis.fault}});
  }
  for (std::size_t i = 0; i < tick.cells.size(); ++i) {
    const CellInput& cell = tick.cells[i];
    nlohmann::json net_N;
    if (cell.gross_N) net_N = *cell.gross_N - machine_.tares_N()[i];
    status["cells"].push_back({{"name", config_.cells[i].id},
                               {"gross_N", numberOrNull(cell.gross_N)},
                               {"net_N", net_N},
                               {"age_ms", 1e-6 * static_cast<double>(cell.age_ns)},
                               {"fault", cell.fault}});
  }
  status["loop"] = {{"ticks", ticks_},
                    {"missed", missed_},
                    {"worst_late_ms", 1e-6 * static_cast<double>(worst_late_ns_)}};
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
}

nlohmann::json RigService::status() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

}  // namespace tenter::daemon
