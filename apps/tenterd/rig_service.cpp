// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_service.h"

#include <algorithm>
#include <cmath>

#include "daemon_log.h"

namespace tenter::daemon {
namespace {

using namespace std::chrono_literals;
using Kind = RigCommand::Kind;

constexpr auto kTick = 20ms;
constexpr auto kWatchPeriod = 2ms;
constexpr Actuator::Timeout kDeviceTimeout{40}, kEnergiseTimeout{100}, kConnectTimeout{500};
constexpr auto kAnswerLimit = 2s;
/// Longer than any unloading takes.
constexpr auto kQuitLimit = 150s;
constexpr double kSameSpeedShare = 0.02;
constexpr std::int64_t kReconnectPeriod_ns = 1'000'000'000;

/// What keeps an axis from being moved, though it answers. A late order is cured by the next one.
constexpr std::uint32_t kHarmless = actuator_error::kDeenergised | actuator_error::kCommandTimeout;

nlohmann::json numberOrNull(const std::optional<double>& value) {
  nlohmann::json out;
  if (value) out = *value;
  return out;
}

}  // namespace

/// Calls of the devices do not last longer than twice their time-out; one that did is counted.
template <class Call>
auto RigService::timed(const char* name, Actuator::Timeout timeout, Call call) {
  const auto start = std::chrono::steady_clock::now();
  auto outcome = call();
  const auto taken = std::chrono::steady_clock::now() - start;
  if (taken > 2 * timeout) {
    ++overlong_;
    logEvent(LogLevel::kWarning, "overlong-call",
             {{"call", name},
              {"taken_ms", std::chrono::duration_cast<std::chrono::milliseconds>(taken).count()},
              {"timeout_ms", timeout.count()}});
  }
  return outcome;
}

Result<std::unique_ptr<RigService>> RigService::start(RigConfig config) {
  std::vector<AxisConfig> axes;
  for (const RigAxis& axis : config.axes) axes.push_back(axis.device);
  auto bank = ActuatorBank::create(std::move(axes));
  if (!bank) return bank.error();
  auto events = std::make_shared<CellEvents>();
  LoadCellScannerOptions options;
  options.on_event = [events](const LoadCellEvent& event) { events->push(event); };
  auto alarm = std::make_shared<ForceAlarm>(config.limits.absolute_N);
  options.on_reading = [alarm](const LoadCellReading& reading) { alarm->look(reading); };
  auto scanner = LoadCellScanner::start(config.cells, options);
  if (!scanner) return scanner.error();
  auto section = parseCameraSection(config.text, "cameras");
  if (!section) return section.error();
  auto cameras = std::make_unique<CaptureService>(*std::move(section));
  return std::unique_ptr<RigService>(new RigService(std::move(config), *std::move(bank),
                                                    std::move(events), std::move(alarm),
                                                    *std::move(scanner), std::move(cameras)));
}

RigService::RigService(RigConfig config, ActuatorBank bank, std::shared_ptr<CellEvents> events,
                       std::shared_ptr<ForceAlarm> alarm, std::unique_ptr<LoadCellScanner> scanner,
                       std::unique_ptr<CaptureService> cameras)
    : config_(config),
      bank_(std::move(bank)),
      cell_events_(std::move(events)),
      alarm_(std::move(alarm)),
      scanner_(std::move(scanner)),
      cameras_(std::move(cameras)),
      machine_(std::move(config)),
      speeds_m_per_s_(config_.axes.size(), 0.0),
      status_{{"rig", config_.name},
              {"state", rigStateName(machine_.state())},
              {"reason", "has not been read yet"},
              {"moving", false}},
      watch_([this] { watch(); }) {}

RigService::~RigService() {
  quitting_ = true;
  armed_ = false;
  watch_.join();
}

void RigService::watch() {
  while (!quitting_ || armed_) {
    const std::int64_t now_ns = monotonic_ns();
    for (std::size_t i = 0; i < config_.cells.size() && armed_; ++i) {
      const LoadCellReading reading = scanner_->reading(i);
      if (!alarm_->beyond(reading, now_ns)) continue;
      {
        const double force_N = reading.gross_N(now_ns).value_or(config_.cells[i].capacity_N);
        const std::lock_guard lock(halt_mutex_);
        trip_ = ForceTrip{static_cast<int>(i), force_N};
        armed_ = false;
      }
      (void)haltEverything();
    }
    alarm_->wait(kWatchPeriod);
  }
}

void RigService::stopNow() {
  {
    const std::lock_guard lock(halt_mutex_);
    stopped_ = true;
  }
  (void)haltEverything();
}

/// An axis that is not on the bus halts by itself; one that refused or did not answer is told again
/// in the next tick.
std::vector<AxisOutcome> RigService::haltEverything() {
  std::vector<AxisOutcome> outcomes =
      timed("halt", kDeviceTimeout, [&] { return bank_.haltAll(kDeviceTimeout); });
  halt_again_ = std::any_of(outcomes.begin(), outcomes.end(), [](const AxisOutcome& outcome) {
    return !outcome.ok() && outcome.fault != ActuatorFault::kUnplugged;
  });
  return outcomes;
}

Result<void> RigService::command(RigCommand command, std::shared_ptr<Recorder> recorder) {
  if (quitting_) return Error{ErrorKind::kInterlock, "", "", "tenterd is about to end", ""};
  std::unique_lock lock(command_mutex_);
  const std::uint64_t id = command.id = ++last_command_;
  waiting_[id].recorder = std::move(recorder);
  commands_.push_back(std::move(command));
  const auto answered = [&] { return waiting_[id].refusal.has_value(); };
  if (!answered_.wait_for(lock, kAnswerLimit, answered)) {
    // What the loop has not taken up it must not take up after this was answered.
    std::erase_if(commands_, [&](const RigCommand& waiting) { return waiting.id == id; });
    (void)answered_.wait_for(lock, kAnswerLimit, answered);
  }
  const std::string refusal = waiting_[id].refusal.value_or("the loop does not answer");
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
    try {
      tick();
    } catch (...) {
      armed_ = false;
      (void)haltEverything();
      throw;
    }
    each_tick();
    if (!quitting_) continue;
    if (!quit_at) quit_at = now;
    if (!machine_.busy()) break;
    if (now - *quit_at <= kQuitLimit) continue;
    noteFault("daemon", "not-unloaded", "ended before all cords were slack");
    break;
  }
  armed_ = false;
  (void)haltEverything();
  recorder_.reset();
}

void RigService::noteLateness(std::int64_t late_ns, std::int64_t now_ns) {
  ++ticks_;
  lateness_.add(late_ns);
  if (late_ns <= std::chrono::nanoseconds(kTick).count()) return;
  ++missed_;
  const std::string text = std::to_string(late_ns / 1000) + " us late";
  logEvent(LogLevel::kWarning, "missed-deadline", {{"text", text}});
  if (recorder_) recorder_->append(now_ns, FaultEvent{"loop", "missed-deadline", text});
}

void RigService::tick() {
  reconnect();
  // Before anything is read, so that no session begins after its first tick.
  std::vector<RigCommand> commands = takeCommands();
  RigTick tick = readAll();
  tick.commands = std::move(commands);
  takeHalts(tick);
  const bool was_moving = machine_.moving();
  const RigMemory before = machine_.memory();
  const RigOrders orders = machine_.step(tick);
  obey(orders);
  attach(orders, before);
  noteFaults(tick);
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
  if (machine_.busy() || (arrivals == arrivals_ && now_ns < next_reconnect_ns_)) return;
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
  for (const AxisReading& reading :
       timed("poll", kDeviceTimeout, [&] { return bank_.pollAll(kDeviceTimeout); })) {
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
  const bool changed = operator_changed_.exchange(false);
  tick.operator_gone = (!operated_ || changed) && !quitting_;
  if (recorder_) tick.recorder_fault = recorder_->fault();
  return tick;
}

void RigService::takeHalts(RigTick& tick) {
  const std::lock_guard lock(halt_mutex_);
  tick.trip = trip_;
  tick.halted_outside = stopped_;
  trip_.reset();
  stopped_ = false;
}

std::vector<RigCommand> RigService::takeCommands() {
  std::vector<RigCommand> commands;
  {
    const std::lock_guard lock(command_mutex_);
    commands.swap(commands_);
  }
  // Whatever is under way, paused or not, is ended and lets the cords out; a tare just ends.
  if (quitting_ && machine_.busy() && !machine_.unloading()) {
    RigCommand abort;
    abort.kind = Kind::kAbort;
    commands.push_back(abort);
  }
  return commands;
}

void RigService::release() {
  const std::lock_guard lock(halt_mutex_);
  if (trip_ || stopped_) return;
  halt_again_ = false;
  bank_.allowMotion();
}

void RigService::obey(const RigOrders& orders) {
  if (orders.halt || (halt_again_ && !orders.release_halt)) {
    note(haltEverything());
    if (orders.deenergise) note(bank_.deenergiseAll(kEnergiseTimeout));
    return;
  }
  if (orders.deenergise) note(bank_.deenergiseAll(kEnergiseTimeout));
  if (orders.release_halt) release();
  for (int i = 0; i < bank_.size(); ++i) {
    if (!orders.energise && !orders.home) break;
    if (orders.energise) {
      note({bank_.axis(i).energise(kEnergiseTimeout),
            bank_.axis(i).exitSafeStart(kEnergiseTimeout)});
    }
    if (orders.home) note({bank_.axis(i).goHome(HomeTowards::kMin, kEnergiseTimeout)});
  }
  if (orders.energise || orders.home) speeds_m_per_s_.assign(config_.axes.size(), 0.0);
  limitSpeeds(orders);
  note(timed("targets", kDeviceTimeout,
             [&] { return bank_.setTargets(orders.targets_m, kDeviceTimeout); }));
}

/// Devices go at the speed that is wanted instead of hurrying to each tick's target and waiting
/// there. They are told only what is new.
void RigService::limitSpeeds(const RigOrders& orders) {
  std::vector<std::optional<double>> speeds_m_per_s(config_.axes.size());
  bool any = false;
  for (std::size_t i = 0; i < speeds_m_per_s.size(); ++i) {
    const double speed_m_per_s = orders.speeds_m_per_s[i];
    const bool same =
        std::abs(speed_m_per_s - speeds_m_per_s_[i]) <= kSameSpeedShare * speeds_m_per_s_[i];
    if (!orders.targets_m[i] || speed_m_per_s <= 0.0 || same) continue;
    speeds_m_per_s_[i] = speed_m_per_s;
    speeds_m_per_s[i] = speed_m_per_s;
    any = true;
  }
  if (!any) return;
  for (const AxisOutcome& outcome : timed("speeds", kDeviceTimeout, [&] {
         return bank_.setSpeedLimits(speeds_m_per_s, kDeviceTimeout);
       })) {
    if (outcome.ok()) continue;
    const auto axis = config_.findAxis(outcome.axis);
    // A speed that the device does not have is no fault: it then keeps the one that it had.
    if (outcome.fault == ActuatorFault::kOutOfRange) continue;
    if (axis) speeds_m_per_s_[static_cast<std::size_t>(*axis)] = 0.0;
    note({outcome});
  }
}

/// Orders that were not carried out. Those that a halt forbids or cuts short are as they should be.
void RigService::note(const std::vector<AxisOutcome>& outcomes) {
  for (const AxisOutcome& outcome : outcomes) {
    const ActuatorFault fault = outcome.fault;
    if (fault == ActuatorFault::kNone || fault == ActuatorFault::kHalted ||
        fault == ActuatorFault::kPreempted) {
      continue;
    }
    noteFault(outcome.axis, std::string(actuatorFaultName(fault)), outcome.detail);
  }
}

/// What devices say, whether or not the machine has to act upon it.
void RigService::noteFaults(const RigTick& tick) {
  for (std::size_t i = 0; i < tick.axes.size(); ++i) {
    if (!tick.axes[i].fault.empty()) noteFault(config_.axes[i].device.name, tick.axes[i].fault, "");
  }
  for (const LoadCellEvent& event : cell_events_->take()) {
    if (event.fault == LoadCellFault::kNone) continue;
    std::string name(loadCellFaultName(event.fault));
    if (event.exception_code != 0) name += "-" + std::to_string(event.exception_code);
    noteFault(config_.cells.at(event.cell).id, name, std::string(loadCellFaultText(event.fault)));
  }
}

void RigService::noteFault(const std::string& source, const std::string& fault,
                           const std::string& text) {
  const std::int64_t now_ns = monotonic_ns();
  if (!named_.isNews(source, fault, now_ns)) return;
  logEvent(LogLevel::kWarning, "device", {{"source", source}, {"fault", fault}, {"text", text}});
  if (recorder_) recorder_->append(now_ns, FaultEvent{source, fault, text});
}

/// A run's own records go to its session.
void RigService::attach(const RigOrders& orders, const RigMemory& before) {
  const std::lock_guard lock(command_mutex_);
  for (const RigAnswer& answer : orders.answers) {
    const auto waiting = waiting_.find(answer.id);
    if (waiting == waiting_.end() || !waiting->second.recorder) continue;
    if (!answer.refusal.empty()) continue;
    recorder_ = waiting->second.recorder;
    journal_ = RigJournal();
    named_.forget();
    recorder_->append(recorder_->start_ns(),
                      RigJournal::memoryRecord(before, recorder_->start_ns()));
  }
}

void RigService::record(const RigTick& tick, const RigOrders& orders) {
  for (const RecordBody& body : orders.records) {
    if (const auto* state = std::get_if<StateChange>(&body)) {
      logEvent(LogLevel::kInfo, "state",
               {{"from", state->from}, {"to", state->to}, {"reason", state->reason}});
    } else if (const auto* fault = std::get_if<FaultEvent>(&body)) {
      logEvent(LogLevel::kWarning, "fault",
               {{"source", fault->source}, {"fault", fault->fault}, {"text", fault->text}});
    } else if (const auto* decision = std::get_if<Decision>(&body)) {
      logEvent(LogLevel::kInfo, "decision",
               {{"name", decision->name},
                {"data", nlohmann::json::parse(decision->data, nullptr, false)}});
    }
  }
  if (!recorder_) return;
  for (RecordBody& body : journal_.tickRecords(tick)) {
    recorder_->append(tick.time_ns, std::move(body));
  }
  for (const RecordBody& body : orders.records) {
    recorder_->append(tick.time_ns, body);
    const auto* decision = std::get_if<Decision>(&body);
    if (decision == nullptr || decision->name != "capture" || !cameras_->any()) continue;
    cameras_->request(nlohmann::json::parse(decision->data).value("index", std::int64_t{0}),
                      recorder_);
  }
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
  const RigPurpose& purpose = machine_.purpose();
  nlohmann::json status{{"rig", config_.name},
                        {"state", rigStateName(machine_.state())},
                        {"reason", machine_.reason()},
                        {"moving", machine_.moving()},
                        {"last",
                         {{"number", purpose.number},
                          {"what", purpose.what},
                          {"how", purpose.how},
                          {"why", purpose.why}}},
                        {"emergency_stop", tick.emergency_stop},
                        {"recording", recorder_ != nullptr},
                        {"limits",
                         {{"absolute_N", config_.limits.absolute_N},
                          {"working_N", config_.limits.working_N},
                          {"slack_N", config_.limits.slack_N}}},
                        {"axes", nlohmann::json::array()},
                        {"cells", nlohmann::json::array()}};
  for (std::size_t i = 0; i < tick.axes.size(); ++i) {
    const AxisInput& axis = tick.axes[i];
    const RigAxis& known = config_.axes[i];
    nlohmann::json cell;
    if (known.cell) cell = config_.cells[static_cast<std::size_t>(*known.cell)].id;
    status["axes"].push_back({{"name", known.device.name},
                              {"cell", cell},
                              {"travel_m", {known.device.travel_min_m, known.device.travel_max_m}},
                              {"position_m", numberOrNull(axis.position_m)},
                              {"energised", axis.energised},
                              {"homed", axis.position_certain},
                              {"kill_switch", known.device.kill_switch},
                              {"fault", axis.fault}});
  }
  for (std::size_t i = 0; i < tick.cells.size(); ++i) {
    const CellInput& cell = tick.cells[i];
    const LoadCellScanStatistics scans = scanner_->statistics(i);
    nlohmann::json net_N;
    if (cell.gross_N) net_N = *cell.gross_N - machine_.tares_N()[i];
    status["cells"].push_back({{"name", config_.cells[i].id},
                               {"gross_N", numberOrNull(cell.gross_N)},
                               {"net_N", net_N},
                               {"gain", config_.cells[i].gain},
                               {"offset_N", config_.cells[i].offset_N},
                               {"age_ms", 1e-6 * static_cast<double>(cell.age_ns)},
                               {"scan_ms", 1e-6 * static_cast<double>(scans.mean_ns)},
                               {"longest_scan_ms", 1e-6 * static_cast<double>(scans.longest_ns)},
                               {"fault", cell.fault}});
  }
  status["mapping"] = nlohmann::json::array();
  for (const MappingFinding& finding : machine_.mapping()) {
    nlohmann::json answered;
    if (finding.answered) answered = config_.cells[static_cast<std::size_t>(*finding.answered)].id;
    status["mapping"].push_back(
        {{"axis", config_.axes[static_cast<std::size_t>(finding.axis)].device.name},
         {"cell", config_.cells[static_cast<std::size_t>(finding.cell)].id},
         {"answered", answered},
         {"confirmed", finding.confirmed()},
         {"rise_N", finding.rise_N},
         {"text", mappingText(finding, config_)}});
  }
  status["calibration_ids"] = config_.calibration_ids;
  status["time_ns"] = tick.time_ns;
  status["loop"] = {{"ticks", ticks_},
                    {"overlong_calls", overlong_.load()},
                    {"missed", missed_},
                    {"p99_late_ms", lateness_.quantile_ms(0.99)},
                    {"worst_late_ms", lateness_.worst_ms()}};
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
}

nlohmann::json RigService::status() const {
  nlohmann::json status;
  {
    const std::lock_guard lock(status_mutex_);
    status = status_;
  }
  if (cameras_->any()) status["cameras"] = cameras_->status();
  return status;
}

}  // namespace tenter::daemon
