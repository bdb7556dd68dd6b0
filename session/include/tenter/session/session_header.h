// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// Version of sessions that this program writes; older ones are migrated on reading.
inline constexpr int kSessionSchemaVersion = 1;

/// session.json: all that is known before the first record, and never changes after it.
struct SessionHeader {
  std::string id;             ///< Letters, digits, '.', '_', '-'; 1 to 100.
  std::string who;            ///< Person or laboratory that the data belong to.
  std::string operator_name;  ///< Person at the bench.
  std::string start_utc;      ///< "2026-11-24T20:49:49.123456789Z"; the moment of time_ns = 0.
  std::string fabric;
  std::string specimen;  ///< Which piece of the fabric.
  double areal_density_kg_per_m2 = 0.0;
  std::string protocol;           ///< "stretch-weft".
  std::string protocol_text;      ///< TOML, as the rig ran it.
  std::string rig_configuration;  ///< TOML of rig and cameras, as the rig ran it.
  std::map<std::string, std::string> calibration_ids;  ///< "cells", "cords", "cameras" to its id.
  std::optional<double> temperature_degC;
  std::optional<double> relative_humidity;        ///< 0 to 1.
  std::vector<std::string> actuators;             ///< Order of positions in samples.
  std::vector<std::string> cells;                 ///< Order of tensions in samples.
  std::int64_t commit_interval_ns = 100'000'000;  ///< Samples of that long may go with the power.
};

/// Lengths, characters, finiteness and magnitudes; error names the field.
Result<void> validateSessionHeader(const SessionHeader& header, const std::string& file = "");

/// The text of session.json. Error: invalid header, or a text that is not UTF-8.
Result<std::string> sessionHeaderJson(const SessionHeader& header);

/// Reads and validates `folder`/session.json.
Result<SessionHeader> readSessionHeader(const std::filesystem::path& folder);

/// "2026-11-24T20:49:49.123456789Z".
std::string utcStamp(std::chrono::system_clock::time_point time);

/// Nanoseconds since 1970 of such a stamp; fraction of 0 to 9 digits. Nothing if it is no stamp.
std::optional<std::int64_t> parseUtcStamp(const std::string& stamp);

}  // namespace tenter
