// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/rig/mapping_check.h"
#include "tenter/rig/protocol.h"
#include "tenter/rig/rig_config.h"
#include "tenter/session/records.h"

namespace tenter {

enum class RigState {
  kOff,      ///< Motors without current, or not on the bus.
  kReady,    ///< May do anything.
  kCaution,  ///< Something is doubtful: only moves that unload.
  kRunning,
  kPaused,
  kFault,    ///< A limit was met: halted, unloads, and waits for `reset`.
  kStopped,  ///< Somebody stopped it: holds where it is until `reset`.
};
std::string_view rigStateName(RigState state);
std::optional<RigState> findRigState(std::string_view name);

struct AxisInput {
  std::optional<double> position_m;
  bool energised = false;
  bool position_certain = false;
  bool homing = false;
  std::string fault;  ///< Why there is no reading, or what keeps the device still; empty if well.
};

struct CellInput {
  std::optional<double> gross_N;  ///< Only a tension that may be believed.
  std::int64_t age_ns = 0;
  std::string fault;
};

struct RigCommand {
  enum class Kind {
    kEnable,
    kDisable,
    kHome,
    kTare,
    kJog,
    kRun,
    kPause,
    kResume,
    kAbort,
    kStop,
    kReset,
    kUnload,
    kCheckMapping
  };
  Kind kind = Kind::kStop;
  std::uint64_t id = 0;  ///< The answer carries it.
  int axis = 0;          ///< kJog
  double distance_m = 0.0, speed_m_per_s = 0.0;
  std::shared_ptr<const CaptureProtocol> protocol;  ///< kRun
  /// kRun: whether axes whose force ends a step are tried first, unless they were since they got
  /// current. Sessions from before there was a check say nothing of it.
  enum class Mapping { kUnasked, kCheck, kSkip };
  Mapping mapping = Mapping::kUnasked;
  std::vector<int> axes;  ///< kCheckMapping: of these axes; none: of all that have a cell.
};

std::string_view rigCommandName(RigCommand::Kind kind);
std::optional<RigCommand::Kind> findRigCommand(std::string_view name);

/// A force beyond the absolute limit that a faster watch saw, and halted for, between two ticks.
struct ForceTrip {
  int cell = 0;
  double gross_N = 0.0;
};

/// What was asked for last, of what takes time, and how that ended.
struct RigPurpose {
  std::uint64_t number = 0;  ///< Counts them.
  std::string what;          ///< As the command: "jog", "run", ...
  std::string how;  ///< "done", "aborted", "stopped", "tripped", "refused", "not-unloaded"; empty
                    ///< while it is under way.
  std::string why;  ///< Unless done.
};

/// All that the machine knows of one moment.
struct RigTick {
  std::int64_t time_ns = 0;  ///< Monotonic.
  std::vector<AxisInput> axes;
  std::vector<CellInput> cells;
  bool emergency_stop = false;
  bool halted_outside = false;  ///< Somebody's stop has already halted all axes.
  bool operator_gone = false;   ///< The lease ran out.
  std::string recorder_fault;   ///< Why the session cannot be written any more; empty if it can.
  std::optional<ForceTrip> trip;
  std::vector<RigCommand> commands;
};

struct RigAnswer {
  std::uint64_t id = 0;
  std::string refusal;  ///< Empty: accepted.
};

/// What is to be done now, in this order.
struct RigOrders {
  bool halt = false;          ///< All axes at once, without a ramp.
  bool release_halt = false;  ///< Orders that move may be sent again.
  bool energise = false, deenergise = false, home = false;
  /// Nothing: the axis is only kept alive. One tick ahead of where the axis should be, so that it
  /// does not stop before it is told to go on.
  std::vector<std::optional<double>> targets_m;
  std::vector<double> speeds_m_per_s;  ///< With which the targets are to be gone for.
  std::vector<RecordBody> records;     ///< Decisions, states, faults, phases.
  std::vector<RigAnswer> answers;
  bool run_ended = false;  ///< Unloading included: the session may be closed.
};

/// All that a machine at rest goes by besides the next tick: with it another one goes on as the
/// first would have. Times as in its ticks.
struct RigMemory {
  RigState state = RigState::kOff;
  std::string reason;
  bool enabled = false, emergency = false, blind = false;
  std::optional<std::int64_t> last_ns;
  std::vector<AxisInput> axes;                        ///< The last readings that count.
  std::vector<std::optional<std::int64_t>> heard_ns;  ///< Of each axis, when it last answered.
  std::vector<double> known_m;                        ///< Last positions read.
  std::vector<std::int64_t> felt_ns;                  ///< Of each cell, its last tension.
  std::vector<double> tares_N;
  std::vector<bool> mapped;       ///< Axes whose own cell was seen to answer.
  std::vector<double> origins_m;  ///< Where cords were slack.
};

/// The safety state machine with the runner of protocols inside: pure, so that equal ticks give
/// equal orders, byte for byte. The rules, and what happens under each, stand in
/// docs/rig-safety.md.
class RigMachine {
 public:
  static constexpr std::int64_t kStale_ns = 250'000'000;
  static constexpr std::int64_t kLateTick_ns = 200'000'000;

  explicit RigMachine(RigConfig config);
  /// Goes on where another one was. Precondition: sizes of the configuration.
  RigMachine(RigConfig config, const RigMemory& memory);

  /// Precondition: one input for each axis and each cell.
  RigOrders step(const RigTick& tick);

  RigState state() const { return state_; }
  const std::string& reason() const { return reason_; }
  /// Something is under way, be it a tare or a run that is paused.
  bool busy() const { return activity_ != Activity::kNone; }
  bool moving() const { return busy() && state_ != RigState::kPaused; }
  /// Cords are being let out, or will be once the axes stand.
  bool unloading() const {
    return activity_ == Activity::kSettle || activity_ == Activity::kUnload;
  }
  const RigPurpose& purpose() const { return purpose_; }
  bool running() const { return protocol_ != nullptr; }
  const std::vector<double>& tares_N() const { return tares_N_; }
  const RigConfig& config() const { return config_; }
  /// Of the last check of the mapping, as far as it has come.
  const std::vector<MappingFinding>& mapping() const { return findings_; }
  /// Complete while nothing moves and no tare is taken.
  RigMemory memory() const;

 private:
  enum class Activity { kNone, kSettle, kJog, kHome, kRun, kUnload, kTare, kMap };

  /// Motors are at work, or stand by for a run that is paused.
  bool inMotion() const { return busy() && activity_ != Activity::kTare; }
  // rig_machine.cpp: what must not be
  void watch();
  void watchForces();
  void watchLoading();
  void watchAxes();
  void trip(const std::string& source, const std::string& fault, const std::string& text);
  void stop(const std::string& why, bool halt_needed);
  bool staysBehind(std::size_t axis) const;
  void noteUnwritten();
  void conclude(const std::string& how, const std::string& why);
  void takeCurrentAway();
  void changeState(RigState to, const std::string& reason);
  void settleIdleState();
  void remember();
  bool axesFit() const;
  std::string doubt() const;
  // rig_commands.cpp: what may be asked for
  void obey(const RigCommand& command);
  void setOut(RigCommand::Kind kind);
  std::string refusalOf(const RigCommand& command) const;
  void carryOut(const RigCommand& command);
  std::string refusalOfHome() const;
  std::optional<std::size_t> axisAtItsEnd(int cell) const;
  std::string refusalOfJog(const RigCommand& command) const;
  std::string refusalOfRun(const RigCommand& command) const;
  std::string refusalOfMapping(const RigCommand& command) const;
  // rig_motion.cpp: what is to be done
  void act();
  void begin(Activity activity);
  void startUnloading();
  void keepOrigins();
  void actJog();
  void actHome();
  bool homesAstray(std::size_t axis);
  void actTare();
  void actUnload();
  void actRun();
  bool stepDone(const ProtocolStep& step);
  void enterStep();
  void leaveStep();
  void endRun(const std::string& how);
  void move(const std::vector<double>& velocities_m_per_s);
  std::optional<double> net_N(std::size_t cell) const;
  std::optional<double> meanTension_N(const ProtocolStep& step) const;
  double position(std::size_t axis) const;
  double highestForce_N() const;
  bool strays(std::size_t axis) const;
  double seconds() const;
  void unloadingEnded(const std::string& left);
  void driveStep(const ProtocolStep& step);
  void decide(const std::string& name, std::string data = "{}");
  // rig_mapping.cpp: whether each axis pulls its own cell
  std::vector<int> axesToMap(const CaptureProtocol& protocol) const;
  void startMapping(const std::vector<int>& axes);
  void actMap();
  void mappingDone();
  void startProtocol();

  RigConfig config_;
  double cap_m_per_s_;
  RigState state_ = RigState::kOff;
  std::string reason_ = "not enabled";
  Activity activity_ = Activity::kNone;
  const RigTick* tick_ = nullptr;  ///< While in step().
  RigOrders* orders_ = nullptr;
  std::vector<AxisInput> axes_;                        ///< The last readings that count.
  std::vector<std::optional<std::int64_t>> heard_ns_;  ///< Of each axis, when it last answered.
  std::vector<std::int64_t> felt_ns_;                  ///< Of each cell, its last tension.
  bool blind_ = false;  ///< A cell is without tension while something would load.
  std::optional<std::int64_t> last_ns_;
  double dt_s_ = 0.0;
  std::int64_t since_ns_ = 0;  ///< When the activity began.
  bool enabled_ = false, emergency_ = false, loading_ = false, recording_ = false;
  std::vector<double> setpoints_m_;
  std::vector<double> origins_m_;               ///< Where cords were slack, or a run began.
  std::vector<std::optional<double>> goals_m_;  ///< Where this tick's motion is to end exactly.
  std::vector<double> begun_m_;                 ///< Where the activity began.
  std::vector<double> known_m_;                 ///< Last positions read.
  std::vector<double> tares_N_, tare_sums_N_, tare_lowest_N_, tare_highest_N_;
  std::vector<bool> frozen_;  ///< Axes that do not follow while cords are let out.
  bool disabling_ = false;    ///< Until no axis has current any more.
  RigPurpose purpose_;
  std::optional<MappingCheck> mapping_;
  std::vector<MappingFinding> findings_;
  std::vector<bool> mapped_;
  int tare_ticks_ = 0;
  std::deque<std::vector<std::optional<double>>> history_N_;
  std::deque<std::int64_t> history_ns_;
  int jog_axis_ = 0;
  double jog_target_m_ = 0.0, jog_speed_m_per_s_ = 0.0;
  double unload_ceiling_N_ = 0.0;
  std::shared_ptr<const CaptureProtocol> protocol_;
  std::size_t phase_ = 0, step_ = 0;
  int cycle_ = 0;
  double direction_ = 1.0;
  std::int64_t step_since_ns_ = 0, next_capture_ns_ = 0, paused_since_ns_ = 0;
  std::int64_t captures_ = 0;
};

}  // namespace tenter
