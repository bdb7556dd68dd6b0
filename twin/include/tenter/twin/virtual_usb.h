// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// One actuator on the virtual bus. Positions in the device's own units: microsteps of a Tic,
/// 1/1023 of a LAC's feedback.
struct VirtualActuatorSpec {
  std::string driver = "tic";  ///< As in the rig's table of drivers.
  std::uint16_t product = 0;   ///< 0: the driver's first.
  std::string serial;
  double start_units = 0.0;  ///< Where it stands when the power comes on.
  std::optional<double> reverse_switch_units, forward_switch_units;  ///< Limit switches, if any.
  double full_speed_units_per_s = 100.0;  ///< LAC: unloaded, at full power.
};

/// What truly is, whatever the device believes and says.
struct VirtualActuatorState {
  double position_units = 0.0;  ///< Of the mechanics.
  double velocity_units_per_s = 0.0;
  double counted_units = 0.0;  ///< What the device believes: lost steps are the difference.
  bool energised = false;
  bool homing = false;
  bool plugged = true;
  long transfers = 0;  ///< Answered or refused since the start.
};

enum class VirtualFault {
  // of a number of transfers
  kStall,
  kProtocolError,
  kShortReply,
  kMute,              ///< Neither answered nor refused until the host gives up.
  kUnplugInTransfer,  ///< Mute, and unplugged 20 ms later.
  // of the device, until cleared
  kKillSwitch,
  kUnderVoltage,
  kDriverError,
  kForwardLimit,
  kReverseLimit,
  kJammed,          ///< The mechanics do not follow.
  kSettingsLocked,  ///< Takes settings without an error and forgets them.
};

/// A fault by the name that scripts use, such as "kill-switch".
struct VirtualFaultRow {
  VirtualFault fault;
  std::string_view name;
  bool lasts;  ///< Until cleared; otherwise it hits a number of transfers.
};
const std::vector<VirtualFaultRow>& virtualFaults();

/// A bus of virtual actuators that programs see through the real libusb and the real paths of
/// Linux: they are told of it by two variables of their environment and need no change. Faults and
/// unplugging may be called from any thread. One thread answers all programs: one that is stopped
/// (SIGSTOP) in the middle of a transfer keeps the others waiting, but not the mechanics; end it
/// before the bus.
class VirtualUsb {
 public:
  /// To be called first thing in main() of a program that serves virtual devices: starts the
  /// program anew with what it takes to announce devices, unless it was so started. Returns only if
  /// nothing is left to do or it cannot be done.
  static Result<void> preload(char** arguments);

  /// Plugs all in. One bus a process.
  static Result<std::unique_ptr<VirtualUsb>> create(std::vector<VirtualActuatorSpec> devices);
  ~VirtualUsb();
  VirtualUsb(const VirtualUsb&) = delete;
  VirtualUsb& operator=(const VirtualUsb&) = delete;

  int size() const;
  VirtualActuatorState state(int device) const;

  /// Called every 2 ms for every device on a thread of the bus, plugged or not; replaces the one
  /// before, and once this returns that one is called no more. It must not call observe() itself.
  using Observer = std::function<void(int device, const VirtualActuatorState& state)>;
  void observe(Observer observer);

  /// The next `count` transfers meet a passing fault, only those with request code (or LAC packet)
  /// `only_request` if given; a lasting fault begins.
  void inject(int device, VirtualFault fault, int count = 1,
              std::optional<std::uint8_t> only_request = std::nullopt);
  /// Ends a lasting fault, or what is left of a passing one.
  void clear(int device, VirtualFault fault);
  /// Time that each transfer takes.
  void setLatency(int device, std::chrono::microseconds latency);

  void unplug(int device);
  /// Plugs it in at the same port, with the next free address; its power has been off.
  Result<void> replug(int device);

  /// "UMOCKDEV_DIR=..." and "LD_PRELOAD=...": with these any program is on the bus.
  std::vector<std::string> environment() const;
  /// Starts an unchanged program on the bus; its output goes to a file if one is given. The caller
  /// waits for it.
  Result<pid_t> spawn(const std::vector<std::string>& arguments,
                      const std::filesystem::path& output = {}) const;
  /// spawn(), and waits; the exit code, or 128 + the signal that ended it.
  Result<int> run(const std::vector<std::string>& arguments,
                  const std::filesystem::path& output = {}) const;

 private:
  class Bus;
  explicit VirtualUsb(std::unique_ptr<Bus> bus);
  std::unique_ptr<Bus> bus_;
};

}  // namespace tenter
