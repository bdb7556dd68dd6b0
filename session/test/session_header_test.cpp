// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/session_header.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "session_samples.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using session_samples::header;
using test_support::TemporaryFolder;
using testing::HasSubstr;

TEST(SessionHeaderTest, ComesBackAsItWas) {
  const TemporaryFolder folder;
  const SessionHeader h = header();
  folder.write("session.json", sessionHeaderJson(h).value());
  const auto back = readSessionHeader(folder.path());
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ(*sessionHeaderJson(*back), *sessionHeaderJson(h));
  EXPECT_EQ(back->operator_name, "Zoë");
  EXPECT_EQ(back->protocol_text, h.protocol_text);
  EXPECT_EQ(back->rig_configuration, h.rig_configuration);
  EXPECT_EQ(back->calibration_ids, h.calibration_ids);
  EXPECT_EQ(back->temperature_degC, h.temperature_degC);
  EXPECT_EQ(back->cells, h.cells);
}

TEST(SessionHeaderTest, WhatWasNotMeasuredIsAbsent) {
  const TemporaryFolder folder;
  SessionHeader h = header();
  h.temperature_degC.reset();
  h.relative_humidity.reset();
  folder.write("session.json", sessionHeaderJson(h).value());
  const auto back = readSessionHeader(folder.path());
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_FALSE(back->temperature_degC.has_value());
  EXPECT_FALSE(back->relative_humidity.has_value());
}

TEST(SessionHeaderTest, RefusesWhatCannotBe) {
  const std::vector<std::pair<std::function<void(SessionHeader&)>, const char*>> spoilers = {
      {[](SessionHeader& h) { h.id = "../escape"; }, "id"},
      {[](SessionHeader& h) { h.id = ""; }, "id"},
      {[](SessionHeader& h) { h.start_utc = "yesterday"; }, "start_utc"},
      {[](SessionHeader& h) { h.areal_density_kg_per_m2 = 150.0; }, "areal_density_kg_per_m2"},
      {[](SessionHeader& h) { h.areal_density_kg_per_m2 = std::nan(""); },
       "areal_density_kg_per_m2"},
      {[](SessionHeader& h) { h.temperature_degC = 293.15; }, "temperature_degC"},
      {[](SessionHeader& h) { h.relative_humidity = 65.0; }, "relative_humidity"},
      {[](SessionHeader& h) {
         h.cells = {"a", "a"};
       },
       "cells"},
      {[](SessionHeader& h) { h.actuators = {""}; }, "actuators"},
      {[](SessionHeader& h) { h.fabric = std::string(201, 'x'); }, "fabric"},
      {[](SessionHeader& h) { h.who = "\xff"; }, "UTF-8"},
      {[](SessionHeader& h) { h.commit_interval_ns = 0; }, "commit_interval_ns"},
  };
  for (const auto& [spoil, place] : spoilers) {
    SessionHeader h = header();
    spoil(h);
    const auto json = sessionHeaderJson(h);
    ASSERT_FALSE(json.ok()) << place;
    EXPECT_THAT(json.error().message(), HasSubstr(place));
  }
}

TEST(SessionHeaderTest, RefusesFilesThatAreNotSessions) {
  const TemporaryFolder folder;
  const auto good = nlohmann::json::parse(sessionHeaderJson(header()).value());
  const std::vector<std::tuple<const char*, nlohmann::json, const char*>> spoilers = {
      {"format", "tenter-measurement", "format"},
      {"schema_version", 2, "newer"},
      {"units", "imperial", "units"},
      {"calibration_ids", nlohmann::json::array(), "calibration_ids"},
      {"protocol_text", 7, "protocol_text"},
      {"cells", {"a", 3}, "cells[1]"},
  };
  for (const auto& [field, value, complaint] : spoilers) {
    auto damaged = good;
    damaged[field] = value;
    folder.write("session.json", damaged.dump());
    const auto back = readSessionHeader(folder.path());
    ASSERT_FALSE(back.ok()) << field;
    EXPECT_THAT(back.error().message(), HasSubstr(complaint));
    damaged.erase(field);
    folder.write("session.json", damaged.dump());
    EXPECT_FALSE(readSessionHeader(folder.path()).ok()) << field;
  }
}

TEST(UtcStampTest, KnownMomentsComeOutRight) {
  // date --date=@1795553389 --utc
  const std::int64_t moment_ns = 1'795'553'389'123'456'789;
  const std::chrono::system_clock::time_point time{std::chrono::nanoseconds(moment_ns)};
  EXPECT_EQ(utcStamp(time), "2026-11-24T20:49:49.123456789Z");
  EXPECT_EQ(parseUtcStamp("2026-11-24T20:49:49.123456789Z"), moment_ns);
  EXPECT_EQ(parseUtcStamp("1970-01-01T00:00:01.5Z"), 1'500'000'000);
  EXPECT_EQ(parseUtcStamp("1970-01-02T00:00:00Z"), 86'400'000'000'000);
}

TEST(UtcStampTest, RefusesWhatIsNoStamp) {
  for (const char* text :
       {"", "Z", "2026-11-24T20:49:49", "2026-11-24 20:49:49Z", "2026-02-30T00:00:00Z",
        "2026-11-24T24:00:00Z", "2026-11-24T20:49:49.Z", "2026-11-24T20:49:49.1234567891Z",
        "2026-11-24T20:49:49+01:00Z", "9999-11-24T20:49:49Z", "2o26-11-24T20:49:49Z"}) {
    EXPECT_FALSE(parseUtcStamp(text).has_value()) << text;
  }
}

}  // namespace
}  // namespace tenter
