// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// One camera of the rig.
struct CameraConfig {
  std::string name;     ///< Letters, digits, '_', '-'; part of the names of its images.
  std::string address;  ///< "192.168.1.21"; empty: looked for by its serial number.
  std::string serial;   ///< As the camera says it; empty: not compared.
  std::optional<double> exposure_us, gain_dB;
  std::string pixel_format = "Mono8";
  /// Of the image; nothing: as the camera has it.
  std::optional<int> width_px, height_px;
};

/// Table `cameras` of the rig's file (docs/formats/rig.md).
struct CameraSection {
  static constexpr std::size_t kMaxCameras = 16;

  bool hardware_trigger = false;  ///< Else the program triggers each set.
  std::string trigger_line = "Line1";
  /// Hardware trigger: frames whose last packets come further apart are not of one pulse.
  std::chrono::milliseconds pair_window{20};
  int warm_up_sets = 1;  ///< Thrown away each time that a camera was opened.
  int retakes = 3;       ///< How often a set with a lost frame is taken again.
  std::chrono::milliseconds set_timeout{2000};
  int packet_bytes = 0;  ///< GigE; 0: the largest that comes through.
  bool resend = true;    ///< GigE: ask for lost packets again.
  /// The cameras' clocks are one (IEEE 1588), so that their time stamps can be compared.
  bool common_clock = false;
  double saturated_share = 0.02;  ///< Of the pixels at the end of the scale: over-exposed.
  double blurred_share = 0.5;     ///< Of the sharpness that the camera had: out of focus.
  std::vector<CameraConfig> cameras;
};

/// The section of a rig's file; without it there are no cameras. The error names file, key, reason.
Result<CameraSection> parseCameraSection(std::string_view toml, const std::string& file);

}  // namespace tenter
