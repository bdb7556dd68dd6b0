// SPDX-License-Identifier: GPL-3.0-or-later
#include <set>

#include "calibration_id.h"
#include "cord_calibration_json.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"

namespace tenter {
namespace {

using Json = nlohmann::ordered_json;
using Range = JsonReader::Range;

constexpr std::size_t kMaxCords = 256, kMaxName = 64;
constexpr double kMaxForce_N = 1e5, kMaxStiffness_N_per_m = 1e9, kMaxLength_m = 10.0;
constexpr std::int64_t kMaxSamples = std::int64_t{1} << 31;
constexpr const char* kAccepted = "accepted";
constexpr const char* kRejected = "rejected";

Json frictionJson(const CordFrictionFit& fit) {
  return {{"friction_N", fit.friction_N},
          {"friction_sigma_N", fit.friction_sigma_N},
          {"presliding_m", fit.presliding_m},
          {"spring_N_per_m", fit.spring_N_per_m},
          {"rms_N", fit.rms_N},
          {"samples", fit.samples}};
}

Json stretchJson(const CordStretchFit& fit) {
  return {{"stiffness_N_per_m", fit.stiffness_N_per_m},
          {"stiffness_sigma_N_per_m", fit.stiffness_sigma_N_per_m},
          {"curvature_N_per_m2", fit.curvature_N_per_m2},
          {"at_m", fit.at_m},
          {"rms_N", fit.rms_N},
          {"samples", fit.samples}};
}

Json encode(const CordCalibration& c) {
  Json cords = Json::array();
  for (const CordEntry& entry : c.cords) {
    Json row{{"axis", entry.axis}, {"cell", entry.cell}};
    if (entry.friction) row["friction"] = frictionJson(*entry.friction);
    if (entry.stretch) row["stretch"] = stretchJson(*entry.stretch);
    cords.push_back(row);
  }
  return {{"format", kCordCalibrationMarker},
          {"schema_version", 1},
          {"units", "SI"},
          {"note", c.note},
          {"verdict", c.accepted ? kAccepted : kRejected},
          {"reasons", c.reasons},
          {"warnings", c.warnings},
          {"cords", cords}};
}

CordFrictionFit readFriction(JsonReader in) {
  CordFrictionFit fit;
  fit.friction_N = in.number("friction_N", Range::between(-kMaxForce_N, kMaxForce_N));
  fit.friction_sigma_N = in.number("friction_sigma_N", Range::nonNegative(kMaxForce_N));
  fit.presliding_m = in.number("presliding_m", Range::positive(kMaxLength_m));
  fit.spring_N_per_m =
      in.number("spring_N_per_m", Range::between(-kMaxStiffness_N_per_m, kMaxStiffness_N_per_m));
  fit.rms_N = in.number("rms_N", Range::nonNegative(kMaxForce_N));
  fit.samples = static_cast<int>(in.integer("samples", 1, kMaxSamples - 1));
  return fit;
}

CordStretchFit readStretch(JsonReader in) {
  CordStretchFit fit;
  fit.stiffness_N_per_m = in.number("stiffness_N_per_m", Range::positive(kMaxStiffness_N_per_m));
  fit.stiffness_sigma_N_per_m =
      in.number("stiffness_sigma_N_per_m", Range::nonNegative(kMaxStiffness_N_per_m));
  fit.curvature_N_per_m2 = in.number("curvature_N_per_m2",
                                     Range::between(-kMaxStiffness_N_per_m, kMaxStiffness_N_per_m));
  fit.at_m = in.number("at_m", Range::between(-kMaxLength_m, kMaxLength_m));
  fit.rms_N = in.number("rms_N", Range::nonNegative(kMaxForce_N));
  fit.samples = static_cast<int>(in.integer("samples", 1, kMaxSamples - 1));
  return fit;
}

}  // namespace

std::string idOf(const CordCalibration& calibration) {
  return contentId("cords-", encode(calibration));
}

Result<void> writeCordCalibration(const std::filesystem::path& file,
                                  const CordCalibration& calibration) {
  Json document = encode(calibration);
  document["id"] = calibration.id;
  return writeFileAtomically(file, document.dump(2) + "\n");
}

Result<CordCalibration> readCordCalibration(const std::filesystem::path& file) {
  const auto json = readJsonFile(file);
  if (!json) return json.error();
  JsonReader in(*json, file.string());
  if (in.text("format") != kCordCalibrationMarker && in.ok()) {
    in.fail("format", "is no calibration of cords");
  }
  in.integer("schema_version", 1, 1);
  CordCalibration out;
  out.id = in.text("id", kMaxName);
  out.note = in.text("note");
  const std::string verdict = in.text("verdict", kMaxName);
  out.accepted = verdict == kAccepted;
  if (in.ok() && !out.accepted && verdict != kRejected) {
    in.fail("verdict", "must be accepted or rejected");
  }
  out.reasons = in.texts("reasons");
  out.warnings = in.texts("warnings");
  const std::size_t size = in.arraySize("cords");
  if (in.ok() && size > kMaxCords) in.fail("cords", "must be at most 256");
  std::set<std::string> names;
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    JsonReader row = in.element("cords", i);
    CordEntry entry{row.text("axis", kMaxName), row.text("cell", kMaxName), {}, {}};
    if (row.has("friction")) entry.friction = readFriction(row.object("friction"));
    if (row.has("stretch")) entry.stretch = readStretch(row.object("stretch"));
    if (!names.insert(entry.axis).second) in.fail("cords", "has an axis twice");
    out.cords.push_back(std::move(entry));
  }
  if (in.ok() && out.id != idOf(out)) {
    in.fail("id", "is not that of the content", "calibrate again instead of editing the file");
  }
  if (!in.ok()) return in.error();
  return out;
}

}  // namespace tenter
