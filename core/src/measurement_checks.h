// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tenter/core/measurement.h"

namespace tenter {

/// Checks of what measurement.json holds; `cloth` says that there is, or will be, a rest mesh.
/// Errors name its fields.
Result<void> checkHeader(const Measurement& m, const std::string& file, bool cloth);
/// Checks of the rest mesh against the header.
Result<void> checkRest(const Measurement& m, const std::string& file);
/// Checks of one line of frames.jsonl against header and rest mesh; `mesh_file` is the frame's own
/// VTP.
Result<void> checkFrame(const Measurement& m, std::size_t frame, const std::string& file,
                        const std::string& mesh_file);

/// checkFrame on all; `folder` ends in a slash or is empty.
Result<void> checkFrames(const Measurement& m, const std::string& folder);

/// Collects the first complaint about a file; straight lists of checks read better than a return a
/// line.
class Complaint {
 public:
  explicit Complaint(std::string file, std::string prefix = "")
      : file_(std::move(file)), prefix_(std::move(prefix)) {}

  void check(bool good, const std::string& place, const std::string& reason,
             const std::string& advice = "") {
    if (!good && result_.ok()) result_ = badInput(file_, prefix_ + place, reason, advice);
  }
  /// Refuses NaN too.
  void range(double value, double min, double max, const std::string& place,
             const std::string& advice);
  bool ok() const { return result_.ok(); }
  const Result<void>& result() const { return result_; }

 private:
  std::string file_, prefix_;
  Result<void> result_;
};

}  // namespace tenter
