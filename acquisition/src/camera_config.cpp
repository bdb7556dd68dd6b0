// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/acquisition/camera_config.h"

#include <algorithm>
#include <set>

#include "pixel_formats.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/toml_document.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;

constexpr const char* kPage = "docs/formats/rig.md";
constexpr std::size_t kMaxName = 64, kMaxText = 256;
constexpr double kMaxExposure_us = 1e7, kMaxGain_dB = 100.0;
constexpr int kMaxSize_px = 16384;

bool isName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
}

/// Keys that stand in the section for all cameras, and in a camera for that one.
void readSettings(JsonReader& in, CameraConfig& camera) {
  if (in.has("exposure_us")) {
    camera.exposure_us = in.number("exposure_us", Range::positive(kMaxExposure_us));
  }
  if (in.has("gain_dB")) camera.gain_dB = in.number("gain_dB", Range::nonNegative(kMaxGain_dB));
  if (in.has("pixel_format")) {
    camera.pixel_format = in.text("pixel_format", kMaxName);
    if (in.ok() && findPixelFormat(camera.pixel_format) == nullptr) {
      in.fail("pixel_format", "\"" + camera.pixel_format + "\" is not supported",
              pixelFormatNames());
    }
  }
  for (const auto& [key, size] :
       {std::pair("width_px", &camera.width_px), std::pair("height_px", &camera.height_px)}) {
    if (in.has(key)) *size = static_cast<int>(in.integer(key, 1, kMaxSize_px));
  }
}

CameraConfig readCamera(JsonReader in, CameraConfig camera, const CameraSection& section) {
  onlyKnownKeys(in,
                {"name", "address", "serial", "exposure_us", "gain_dB", "pixel_format", "width_px",
                 "height_px"},
                kPage);
  camera.name = in.text("name", kMaxName);
  if (in.ok() && !isName(camera.name)) {
    in.fail("name", "must be letters, digits, '_' or '-': it is part of file names");
  }
  if (in.has("address")) camera.address = in.text("address", kMaxText);
  if (in.has("serial")) camera.serial = in.text("serial", kMaxText);
  if (in.ok() && camera.address.empty() && camera.serial.empty()) {
    in.fail("", "address or serial says which camera it is", "see `tenter cameras list`");
  }
  readSettings(in, camera);
  for (const CameraConfig& other : section.cameras) {
    if (!in.ok()) break;
    if (other.name == camera.name) in.fail("name", "another camera has it");
    if (!camera.address.empty() && other.address == camera.address) {
      in.fail("address", "camera " + other.name + " has it");
    }
    if (!camera.serial.empty() && other.serial == camera.serial) {
      in.fail("serial", "camera " + other.name + " has it");
    }
  }
  return camera;
}

void readTrigger(JsonReader& in, CameraSection& section) {
  const std::string trigger = in.textOr("trigger", "software");
  if (in.ok() && trigger != "software" && trigger != "hardware") {
    in.fail("trigger", "must be software or hardware");
  }
  section.hardware_trigger = trigger == "hardware";
  if (in.has("trigger_line")) section.trigger_line = in.text("trigger_line", kMaxName);
  if (in.has("pair_window_ms")) {
    section.pair_window = std::chrono::milliseconds(in.integer("pair_window_ms", 1, 10'000));
  }
  if (in.has("common_clock")) section.common_clock = in.boolean("common_clock");
}

void readSets(JsonReader& in, CameraSection& section) {
  if (in.has("warm_up_sets"))
    section.warm_up_sets = static_cast<int>(in.integer("warm_up_sets", 0, 20));
  if (in.has("retakes")) section.retakes = static_cast<int>(in.integer("retakes", 0, 100));
  if (in.has("set_timeout_ms")) {
    section.set_timeout = std::chrono::milliseconds(in.integer("set_timeout_ms", 50, 60'000));
  }
  if (in.has("packet_bytes")) {
    section.packet_bytes = static_cast<int>(in.integer("packet_bytes", 0, 65'535));
  }
  if (in.has("resend")) section.resend = in.boolean("resend");
  section.saturated_share =
      in.numberOr("saturated_share", section.saturated_share, Range::positive(1.0));
  section.blurred_share = in.numberOr("blurred_share", section.blurred_share, Range::between(0, 1));
}

}  // namespace

Result<CameraSection> parseCameraSection(std::string_view toml, const std::string& file) {
  const auto json = jsonOfToml(toml, file);
  if (!json) return json.error();
  JsonReader whole(*json, file);
  CameraSection section;
  if (!whole.has("cameras")) return section;
  JsonReader in = whole.object("cameras");
  onlyKnownKeys(
      in,
      {"trigger", "trigger_line", "pair_window_ms", "common_clock", "warm_up_sets", "retakes",
       "set_timeout_ms", "packet_bytes", "resend", "saturated_share", "blurred_share",
       "exposure_us", "gain_dB", "pixel_format", "width_px", "height_px", "camera"},
      kPage);
  readTrigger(in, section);
  readSets(in, section);
  CameraConfig common;
  readSettings(in, common);
  const std::size_t size = in.arraySize("camera");
  if (in.ok() && (size == 0 || size > CameraSection::kMaxCameras)) {
    in.fail("camera",
            "must be there 1 to " + std::to_string(CameraSection::kMaxCameras) + " times");
  }
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    section.cameras.push_back(readCamera(in.element("camera", i), common, section));
  }
  if (!whole.ok()) return whole.error();
  return section;
}

}  // namespace tenter
