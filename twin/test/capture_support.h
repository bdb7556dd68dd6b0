// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tenter/twin/capture.h"

namespace tenter {

/// A capture small enough for a unit test.
inline CaptureOptions smallCapture(std::string_view fabric, std::string_view protocol) {
  CaptureOptions options;
  options.fabric = fabric;
  options.protocol = protocol;
  options.seed = 7;
  options.nodes = 17;
  options.frames = 5;
  options.tracked = 41;
  return options;
}

inline CaptureResult captured(const CaptureOptions& options) {
  auto result = captureMeasurement(options);
  if (!result)
    throw std::runtime_error(options.fabric + " " + options.protocol + ": " +
                             result.error().message());
  return std::move(result).value();
}

}  // namespace tenter
