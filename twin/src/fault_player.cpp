// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/fault_player.h"

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "tenter/rig/load_cell.h"

namespace tenter {
namespace {

constexpr std::chrono::milliseconds kStep{2};
constexpr int kEndless = 1'000'000;  // transfers; a script has no longer count

struct Apply {
  ServedRig& rig;
  const ScriptedFault& fault;
  bool begins;

  void operator()(VirtualFault kind) const {
    if (begins) {
      rig.usb().inject(fault.device, kind, fault.count > 0 ? fault.count : kEndless);
    } else {
      rig.usb().clear(fault.device, kind);
    }
  }
  void operator()(const UnplugFault& /*kind*/) const {
    if (begins) {
      rig.usb().unplug(fault.device);
    } else {
      (void)rig.usb().replug(fault.device);
    }
  }
  void operator()(const SlowFault& kind) const {
    rig.usb().setLatency(fault.device, begins ? kind.latency : std::chrono::microseconds(0));
  }
  void operator()(const VirtualCellFault& kind) const {
    if (begins) {
      rig.cell(fault.device).inject(kind);
    } else {
      rig.cell(fault.device).clear();
    }
  }
  void operator()(const AddedForceFault& kind) const {
    rig.addForce(fault.device, begins ? kind.force_N : 0.0);
  }
  void operator()(const CameraFault& kind) const {
    VirtualCameras* cameras = rig.cameras();
    if (cameras == nullptr) return;
    switch (kind.kind) {
      case CameraFault::Kind::kLostPackets:
        return cameras->losePackets(fault.device, begins ? kind.lost_share : 0.0);
      case CameraFault::Kind::kUnplugged:
        if (begins) return cameras->unplug(fault.device);
        return (void)cameras->replug(fault.device);
      case CameraFault::Kind::kFrozen:
        return cameras->freeze(fault.device, begins);
      case CameraFault::Kind::kSaturated:
        return cameras->overexpose(fault.device, begins);
      case CameraFault::Kind::kSwapped:  // a second exchange undoes the first
        return (void)cameras->exchange(fault.device, kind.other);
      case CameraFault::Kind::kDefocused:
        return cameras->defocus(fault.device, begins ? kind.blur_px : 0.0);
    }
  }
};

}  // namespace

void applyFault(ServedRig& rig, const ScriptedFault& fault, bool begins) {
  std::visit(Apply{rig, fault, begins}, fault.kind);
}

Result<std::unique_ptr<FaultPlayer>> FaultPlayer::start(ServedRig& rig, FaultScript script,
                                                        const std::filesystem::path& log) {
  std::FILE* file = std::fopen(log.c_str(), "we");
  if (file == nullptr) return badInput(log.string(), "", std::strerror(errno));
  return std::unique_ptr<FaultPlayer>(new FaultPlayer(rig, std::move(script), file));
}

FaultPlayer::FaultPlayer(ServedRig& rig, FaultScript script, std::FILE* log)
    : rig_(rig), schedule_(std::move(script)), log_(log), thread_([this] { play(); }) {}

FaultPlayer::~FaultPlayer() {
  quitting_ = true;
  thread_.join();
}

RigSnapshot FaultPlayer::look() const {
  RigSnapshot now;
  for (int i = 0; i < ServedRig::kAxes; ++i) {
    const VirtualActuatorState state = rig_.usb().state(i);
    now.positions_m.push_back(state.position_units * ServedRig::kMetresPerMicrostep);
    now.homing.push_back(state.homing);
    now.tensions_N.push_back(rig_.tension_N(i));
  }
  return now;
}

void FaultPlayer::play() {
  const auto start = std::chrono::steady_clock::now();
  for (auto next = start; !quitting_; next += kStep) {
    std::this_thread::sleep_until(next);
    const double time_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const RigSnapshot now = look();
    for (const FaultAction& action : schedule_.step(time_s, now)) {
      const ScriptedFault& fault = schedule_.script().faults[action.fault];
      applyFault(rig_, fault, action.begins);
      write(fault, action.begins, time_s, now);
    }
  }
}

void FaultPlayer::write(const ScriptedFault& fault, bool begins, double time_s,
                        const RigSnapshot& now) {
  const auto device = static_cast<std::size_t>(fault.device);
  nlohmann::ordered_json line{{"monotonic_ns", monotonic_ns()},
                              {"time_s", time_s},
                              {"fault", fault.name},
                              {"device", fault.deviceName()},
                              {"kind", fault.kind_name},
                              {"what", begins ? "begins" : "ends"}};
  if (!fault.on_camera) {
    line["position_m"] = now.positions_m[device];
    line["tension_N"] = now.tensions_N[device];
  }
  std::fprintf(log_.get(), "%s\n", line.dump().c_str());
  std::fflush(log_.get());
}

}  // namespace tenter
