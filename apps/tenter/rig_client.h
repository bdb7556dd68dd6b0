// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "tenter/core/result.h"

namespace tenter::app {

/// A connection to tenterd. Not for several threads.
class RigClient {
 public:
  /// Error kind kHardware: nobody listens there, or this user may not.
  static Result<std::unique_ptr<RigClient>> connect(const std::string& socket);
  ~RigClient();
  RigClient(const RigClient&) = delete;
  RigClient& operator=(const RigClient&) = delete;

  /// The answer, or the daemon's error with its kind.
  Result<nlohmann::json> call(const std::string& method,
                              const nlohmann::json& params = nlohmann::json::object());

 private:
  explicit RigClient(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
  int last_id_ = 0;
  std::string pending_;
};

}  // namespace tenter::app
