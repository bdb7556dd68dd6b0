// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "tenter/core/result.h"
#include "tenter/twin/virtual_cell.h"

namespace tenter {

/// Units behind one address.
using VirtualUnits = std::map<int, std::shared_ptr<VirtualCell>>;

struct VirtualTcpOptions {
  int port = 0;  ///< 0: any free one.
  std::chrono::microseconds turnaround{200};
};

struct VirtualRtuOptions {
  std::filesystem::path link;  ///< Symbolic link to the pseudo-terminal; stays when that changes.
  int baud = 115200;
  std::chrono::microseconds turnaround{3000};
  /// Bytes take their time on the wire, and a request that does not keep the gap of 3.5 characters
  /// after the last answer is not understood. Without, answers come after the turnaround alone.
  bool paced = true;
};

struct VirtualModbusCounts {
  std::uint64_t requests = 0;        ///< Well formed and for a unit that is here.
  std::uint64_t answers = 0;         ///< Whole and in time, exceptions included.
  std::uint64_t early_requests = 0;  ///< Came before the gap was over; paced RTU only.
};

/// A Modbus server of virtual load cells with a thread of its own: TCP on 127.0.0.1, or RTU on a
/// pseudo-terminal. Frames are made here, not by a library, so that each of them can be wrong.
class VirtualModbus {
 public:
  static Result<std::unique_ptr<VirtualModbus>> serveTcp(VirtualUnits units,
                                                         const VirtualTcpOptions& options = {});
  static Result<std::unique_ptr<VirtualModbus>> serveRtu(VirtualUnits units,
                                                         const VirtualRtuOptions& options);
  ~VirtualModbus();
  VirtualModbus(const VirtualModbus&) = delete;
  VirtualModbus& operator=(const VirtualModbus&) = delete;

  /// As `parseModbusAddress` reads it.
  std::string address() const;
  int port() const;  ///< 0 for RTU.
  VirtualModbusCounts counts() const;

 private:
  class Server;
  class TcpServer;
  class RtuServer;
  explicit VirtualModbus(std::unique_ptr<Server> server);
  std::unique_ptr<Server> server_;
};

}  // namespace tenter
