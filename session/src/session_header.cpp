// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/session_header.h"

#include <algorithm>
#include <array>
#include <functional>
#include <set>

#include "session_format.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"

namespace tenter {

namespace format = session_format;
namespace fs = std::filesystem;
using Json = nlohmann::json;
using Range = JsonReader::Range;

namespace {

constexpr double kMinArealDensity_kg_per_m2 = 0.005;
constexpr double kMaxArealDensity_kg_per_m2 = 5.0;
constexpr double kMinTemperature_degC = -50.0;
constexpr double kMaxTemperature_degC = 100.0;
constexpr std::int64_t kMinCommitInterval_ns = 1'000'000;
constexpr std::int64_t kMaxCommitInterval_ns = 10'000'000'000;

/// kMigrations[i] turns a header of version i + 1 into one of version i + 2.
const std::array<std::function<void(Json&)>, kSessionSchemaVersion - 1> kMigrations{};

Result<int> versionOf(const Json& document, const std::string& file) {
  JsonReader in(document, file);
  const std::string name = in.text("format", format::kMaxName);
  const auto version = in.integer("schema_version", 1, 1'000'000);
  const std::string units = in.text("units", format::kMaxName);
  if (in.ok() && name != format::kFormat) {
    in.fail("format", "is \"" + name + "\" instead of \"" + format::kFormat + "\"");
  }
  if (in.ok() && version > kSessionSchemaVersion) {
    in.fail("schema_version",
            "is " + std::to_string(version) + ", newer than " +
                std::to_string(kSessionSchemaVersion) + ", the newest this program knows",
            "use a newer version of tenter");
  }
  if (in.ok() && units != format::kUnits) in.fail("units", "must be \"SI\"");
  if (!in.ok()) return in.error();
  return static_cast<int>(version);
}

std::map<std::string, std::string> readIds(JsonReader in) {
  std::map<std::string, std::string> ids;
  if (!in.ok()) return ids;
  for (const auto& [kind, id] : in.json().items()) ids[kind] = in.text(kind, format::kMaxName);
  return ids;
}

Result<SessionHeader> headerFrom(const Json& document, const std::string& file) {
  JsonReader in(document, file);
  SessionHeader h;
  h.id = in.text("id", format::kMaxName);
  h.who = in.text("who", format::kMaxName);
  h.operator_name = in.text("operator", format::kMaxName);
  h.start_utc = in.text("start_utc", format::kMaxName);
  h.fabric = in.text("fabric", format::kMaxName);
  h.specimen = in.text("specimen", format::kMaxName);
  h.areal_density_kg_per_m2 = in.number("areal_density_kg_per_m2");
  h.protocol = in.text("protocol", format::kMaxName);
  h.protocol_text = in.text("protocol_text", format::kMaxDocument_bytes);
  h.rig_configuration = in.text("rig_configuration", format::kMaxDocument_bytes);
  h.calibration_ids = readIds(in.object("calibration_ids"));
  if (in.has("temperature_degC")) h.temperature_degC = in.number("temperature_degC");
  if (in.has("relative_humidity")) h.relative_humidity = in.number("relative_humidity");
  h.actuators = in.texts("actuators");
  h.cells = in.texts("cells");
  h.commit_interval_ns =
      in.integer("commit_interval_ns", kMinCommitInterval_ns, kMaxCommitInterval_ns);
  if (!in.ok()) return in.error();
  if (auto done = validateSessionHeader(h, file); !done) return done.error();
  return h;
}

bool isSessionId(const std::string& id) {
  return !id.empty() && id.size() <= 100 && id[0] != '.' &&
         std::all_of(id.begin(), id.end(),
                     [](char c) { return format::isNameCharacter(c) || c == '.'; });
}

std::string channelComplaint(const std::vector<std::string>& names) {
  if (names.size() > format::kMaxChannels) {
    return "has more than " + std::to_string(format::kMaxChannels) + " items";
  }
  std::set<std::string> seen;
  for (const std::string& name : names) {
    if (name.empty() || name.size() > format::kMaxName)
      return "has a name that is empty or too long";
    if (!seen.insert(name).second) return "has '" + name + "' twice";
  }
  return "";
}

bool outside(const std::optional<double>& value, double min, double max) {
  return value && !(*value >= min && *value <= max);
}

/// Field and reason of the first text that is too long.
std::optional<std::pair<const char*, std::size_t>> longText(const SessionHeader& h) {
  const std::array<std::tuple<const char*, const std::string*, std::size_t>, 7> limits = {
      {{"who", &h.who, format::kMaxName},
       {"operator", &h.operator_name, format::kMaxName},
       {"fabric", &h.fabric, format::kMaxName},
       {"specimen", &h.specimen, format::kMaxName},
       {"protocol", &h.protocol, format::kMaxName},
       {"protocol_text", &h.protocol_text, format::kMaxDocument_bytes},
       {"rig_configuration", &h.rig_configuration, format::kMaxDocument_bytes}}};
  for (const auto& [field, text, limit] : limits) {
    if (text->size() > limit) return std::pair(field, limit);
  }
  return std::nullopt;
}

}  // namespace

Result<void> validateSessionHeader(const SessionHeader& h, const std::string& file) {
  const auto wrong = [&](const char* field, const std::string& reason) {
    return badInput(file, field, reason);
  };
  if (!isSessionId(h.id)) return wrong("id", "must be 1 to 100 letters, digits, '.', '_' or '-'");
  if (!parseUtcStamp(h.start_utc)) {
    return wrong("start_utc", "must be a UTC stamp like 2026-11-24T20:49:49.5Z");
  }
  if (const auto text = longText(h)) {
    return wrong(text->first, "is longer than " + std::to_string(text->second) + " bytes");
  }
  if (outside(h.areal_density_kg_per_m2, kMinArealDensity_kg_per_m2, kMaxArealDensity_kg_per_m2)) {
    return wrong("areal_density_kg_per_m2", "must lie between 0.005 and 5; check the unit");
  }
  if (outside(h.temperature_degC, kMinTemperature_degC, kMaxTemperature_degC)) {
    return wrong("temperature_degC", "must lie between -50 and 100; check the unit");
  }
  if (outside(h.relative_humidity, 0.0, 1.0)) {
    return wrong("relative_humidity", "must lie between 0 and 1; check the unit");
  }
  for (const auto& [field, names] : {std::pair{"actuators", &h.actuators}, {"cells", &h.cells}}) {
    if (const auto complaint = channelComplaint(*names); !complaint.empty()) {
      return wrong(field, complaint);
    }
  }
  for (const auto& [kind, id] : h.calibration_ids) {
    if (kind.empty() || kind.size() > format::kMaxName || id.size() > format::kMaxName) {
      return wrong("calibration_ids", "has a name or id that is empty or too long");
    }
  }
  if (h.commit_interval_ns < kMinCommitInterval_ns ||
      h.commit_interval_ns > kMaxCommitInterval_ns) {
    return wrong("commit_interval_ns", "must lie between 1 ms and 10 s");
  }
  return {};
}

Result<std::string> sessionHeaderJson(const SessionHeader& h) {
  if (auto done = validateSessionHeader(h, format::kHeaderFile); !done) return done.error();
  nlohmann::ordered_json out = {{"format", format::kFormat},
                                {"schema_version", kSessionSchemaVersion},
                                {"units", format::kUnits},
                                {"id", h.id},
                                {"who", h.who},
                                {"operator", h.operator_name},
                                {"start_utc", h.start_utc},
                                {"fabric", h.fabric},
                                {"specimen", h.specimen},
                                {"areal_density_kg_per_m2", h.areal_density_kg_per_m2},
                                {"protocol", h.protocol},
                                {"calibration_ids", h.calibration_ids},
                                {"actuators", h.actuators},
                                {"cells", h.cells},
                                {"commit_interval_ns", h.commit_interval_ns}};
  if (h.temperature_degC) out["temperature_degC"] = *h.temperature_degC;
  if (h.relative_humidity) out["relative_humidity"] = *h.relative_humidity;
  out["protocol_text"] = h.protocol_text;
  out["rig_configuration"] = h.rig_configuration;
  try {
    return out.dump(2) + "\n";
  } catch (const Json::exception&) {
    return badInput(format::kHeaderFile, "", "a text of the header is not UTF-8");
  }
}

Result<SessionHeader> readSessionHeader(const fs::path& folder) {
  const std::string file = (folder / format::kHeaderFile).string();
  auto document = readJsonFile(file);
  if (!document) return document.error();
  const auto version = versionOf(*document, file);
  if (!version) return version.error();
  for (std::size_t i = static_cast<std::size_t>(*version) - 1; i < kMigrations.size(); ++i) {
    kMigrations[i](*document);
  }
  return headerFrom(*document, file);
}

}  // namespace tenter
