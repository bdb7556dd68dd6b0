// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "frame_descriptors.h"
#include "lease.h"
#include "rig_service.h"

namespace tenter::daemon {

/// Who speaks on a connection.
struct Client {
  std::uint64_t connection = 0;
  std::string user;
  bool only_stops = false;  ///< One too many.
};

/// JSON-RPC 2.0, one document a line: docs/rig-safety.md. From any thread, one call a client.
class Rpc {
 public:
  explicit Rpc(RigService& service) : service_(service) {}

  /// The answer's line without its end; empty for a notification. Whatever the line holds.
  /// `attached`: what goes to the client along with it, in the order that the answer counts by.
  std::string answer(std::string_view line, const Client& client,
                     std::vector<Descriptor>& attached);
  void clientGone(const Client& client);
  /// To be called in every tick: tells the service whether somebody holds the rig.
  void tick();

 private:
  Result<nlohmann::json> status() const;
  Result<nlohmann::json> frames(std::vector<Descriptor>& attached);
  Result<nlohmann::json> run(const nlohmann::json& params, const Client& client);
  Result<nlohmann::json> checkMapping(const nlohmann::json& params);
  Result<nlohmann::json> jog(const nlohmann::json& params);
  Result<nlohmann::json> plain(RigCommand::Kind kind);
  Result<nlohmann::json> dispatch(const std::string& method, const nlohmann::json& params,
                                  const Client& client, std::vector<Descriptor>& attached);

  RigService& service_;
  Lease lease_;
  mutable std::mutex mutex_;
  std::shared_ptr<Recorder> recorder_;  ///< Of the last run.
};

}  // namespace tenter::daemon
