// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tenter/core/result.h"

namespace tenter::app {

/// A file that another program handed over; closed with its owner.
class FileDescriptor {
 public:
  explicit FileDescriptor(int number) : number_(number) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&&) = delete;
  int number() const { return number_; }
  std::size_t size_bytes() const;

 private:
  int number_;
};

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
  /// What came along with the last answer, in the order that it counts by.
  std::vector<FileDescriptor> takeFiles() { return std::exchange(files_, {}); }

 private:
  explicit RigClient(int descriptor) : descriptor_(descriptor) {}
  bool receive();

  int descriptor_;
  int last_id_ = 0;
  std::string pending_;
  std::vector<FileDescriptor> files_;
};

}  // namespace tenter::app
