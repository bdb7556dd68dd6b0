// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "capture.h"
#include "fault_names.h"
#include "force_alarm.h"
#include "lateness.h"
#include "recorder.h"
#include "tenter/rig/actuator_bank.h"
#include "tenter/rig/load_cell_scanner.h"
#include "tenter/rig/rig_journal.h"

namespace tenter::daemon {

/// Devices, state machine and recorder of one rig: a loop at 50 Hz, and a watch that halts all axes
/// by itself as soon as a force is read beyond the absolute limit.
class RigService {
 public:
  /// Opens USB and starts reading the cells; devices that are missing are looked for later.
  static Result<std::unique_ptr<RigService>> start(RigConfig config);
  ~RigService();
  RigService(const RigService&) = delete;
  RigService& operator=(const RigService&) = delete;

  /// Ticks until quit(), and then until the rig has unloaded. `each_tick` is called in each.
  void loop(const std::function<void()>& each_tick);
  void quit() { quitting_ = true; }

  /// From any thread: halts all axes at once, without waiting for the loop.
  void stopNow();
  /// Gives a command to the loop and waits for its answer; error kInterlock with the refusal. With
  /// kRun a recorder that takes the records until the rig is unloaded.
  Result<void> command(RigCommand command, std::shared_ptr<Recorder> recorder = nullptr);
  /// Whether somebody holds the rig; without, what moves is ended.
  void setOperated(bool operated) { operated_ = operated; }
  /// Somebody else holds it from now on: what moves is ended too.
  void operatorChanged() { operator_changed_ = true; }
  nlohmann::json status() const;
  const RigConfig& config() const { return config_; }
  CaptureService& cameras() { return *cameras_; }

 private:
  struct Waiting {
    std::optional<std::string> refusal;
    std::shared_ptr<Recorder> recorder;
  };

  RigService(RigConfig config, ActuatorBank bank, std::shared_ptr<CellEvents> events,
             std::shared_ptr<ForceAlarm> alarm, std::unique_ptr<LoadCellScanner> scanner,
             std::unique_ptr<CaptureService> cameras);
  void tick();
  RigTick readAll();
  void noteFaults(const RigTick& tick);
  void note(const std::vector<AxisOutcome>& outcomes);
  void noteFault(const std::string& source, const std::string& fault, const std::string& text);
  AxisInput axisInput(const AxisReading& reading, bool& emergency) const;
  std::vector<RigCommand> takeCommands();
  void takeHalts(RigTick& tick);
  void obey(const RigOrders& orders);
  std::vector<AxisOutcome> haltEverything();
  void release();
  void limitSpeeds(const RigOrders& orders);
  void attach(const RigOrders& orders, const RigMemory& before);
  void record(const RigTick& tick, const RigOrders& orders);
  template <class Call>
  auto timed(const char* name, Actuator::Timeout timeout, Call call);
  void answer(const RigOrders& orders);
  void publish(const RigTick& tick);
  void noteLateness(std::int64_t late_ns, std::int64_t now_ns);
  void reconnect();
  void watch();

  RigConfig config_;
  ActuatorBank bank_;
  std::shared_ptr<CellEvents> cell_events_;
  std::shared_ptr<ForceAlarm> alarm_;
  std::unique_ptr<LoadCellScanner> scanner_;
  std::unique_ptr<CaptureService> cameras_;
  RigMachine machine_;
  std::atomic<bool> quitting_{false}, operated_{false}, armed_{false}, operator_changed_{false};
  /// A device did not confirm that it halted: it is told again, and not kept alive meanwhile.
  std::atomic<bool> halt_again_{false};
  std::vector<double> speeds_m_per_s_;  ///< As the devices were told; 0: not known.

  std::mutex halt_mutex_;  ///< Of what halts from outside the loop.
  std::optional<ForceTrip> trip_;
  bool stopped_ = false;

  std::mutex command_mutex_;
  std::condition_variable answered_;
  std::vector<RigCommand> commands_;
  std::map<std::uint64_t, Waiting> waiting_;
  std::uint64_t last_command_ = 0;
  std::shared_ptr<Recorder> recorder_;
  RigJournal journal_;  ///< Of the session that recorder_ writes.
  FaultNames named_;

  mutable std::mutex status_mutex_;
  nlohmann::json status_;
  std::uint64_t ticks_ = 0, missed_ = 0;
  std::atomic<std::uint64_t> overlong_{0};  ///< Calls beyond twice their time-out.
  Lateness lateness_;
  unsigned arrivals_ = 0;
  std::int64_t next_reconnect_ns_ = 0;
  std::thread watch_;
};

}  // namespace tenter::daemon
