// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "command.h"
#include "progress.h"
#include "rig_client.h"

namespace tenter::app {

/// A session to be recorded.
struct RigRun {
  std::string protocol_text, protocol_name;
  std::string session;  ///< Folder to be made.
  std::string fabric, specimen, who, operator_name;
  double areal_density_kg_per_m2 = 0.0;
  std::optional<double> temperature_degC, relative_humidity;
  bool skip_mapping_check = false;  ///< The session says so.
};

/// One operator's visit to tenterd: holds the lease while it lasts.
class RigVisit {
 public:
  static Result<std::unique_ptr<RigVisit>> begin(const std::string& socket, Console& console);

  Result<nlohmann::json> call(const std::string& method,
                              const nlohmann::json& params = nlohmann::json::object());
  /// Until the rig rests; Ctrl-C aborts, and then it unloads. The last status.
  Result<nlohmann::json> wait(const std::string& what);
  /// Out of "off": motors get current. That is this operator's own action. Then until the cells
  /// give tensions that may be believed; what is amiss after some seconds the daemon will say.
  Result<void> enable();
  Result<void> homeIfLost();
  /// Enables, homes if it must, runs a protocol, and waits until its session is closed.
  Result<int> run(const RigRun& run);
  /// Which cell each axis that was tried has pulled, for the answer and for a person.
  void tellMapping(const nlohmann::json& status, bool all);
  /// Says what the visit ended in: exit 7 unless what was asked for was done; of what takes no
  /// time, unless the rig is no more halted than before.
  Result<int> ended(const nlohmann::json& before, const nlohmann::json& status);

 private:
  RigVisit(std::unique_ptr<RigClient> client, Console& console);

  std::unique_ptr<RigClient> client_;
  Console& console_;
  Progress progress_;
};

}  // namespace tenter::app
