// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "../rpc_peer.h"
#include "../running_rig.h"
#include "fault_plan.h"
#include "truth_log.h"

namespace tenter::campaign {

using rig_system_test::RpcPeer;
using rig_system_test::RunningRig;

/// A virtual rig with its daemon and its operator, brought into one phase after the other. Throws
/// what goes wrong with the rig itself.
class TrialRig {
 public:
  explicit TrialRig(bool tcp);

  RunningRig& running() { return running_; }
  ServedRig& rig() { return running_.rig(); }
  TruthLog& truth() { return truth_; }
  RpcPeer& peer() { return *peer_; }
  const std::string& session() const { return session_; }  ///< Of the phase; empty without one.

  /// Until the rig is ready, whatever state it is in. Throws after a minute.
  void recover();
  /// An operator's; throws where it stays refused for some seconds.
  void order(const std::string& method, const nlohmann::json& params = nlohmann::json::object());
  /// Into the phase; of the device's axis, or of the direction that it pulls in.
  void enter(RigPhase phase, int device);
  /// Once its run has ended, or the limit is over; whether it closed.
  bool waitForSession(double limit_s);
  void connect();
  void disconnect() { peer_.reset(); }
  void restart();
  /// Keeps the lease for so long, and hands each status to `see`.
  template <class See>
  void stay(double span_s, bool with_heartbeat, See see);

 private:
  void jog(int axis, double distance_m, double speed_m_per_s);
  void run(int device, bool hold);
  void sleep(double span_s);
  void rest();

  RunningRig running_;
  TruthLog truth_;
  std::unique_ptr<RpcPeer> peer_;
  std::string session_;
  int sessions_ = 0;
};

template <class See>
void TrialRig::stay(double span_s, bool with_heartbeat, See see) {
  constexpr double kPoll_s = 0.015;
  rig_system_test::waitFor(span_s, [&] {
    if (peer_) {
      if (with_heartbeat) peer_->order("heartbeat");
      see(peer_->status());
    }
    rig_system_test::waitFor(kPoll_s, [] { return false; });
    return false;
  });
}

}  // namespace tenter::campaign
