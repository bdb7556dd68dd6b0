// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/protocol_simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine_bench.h"

namespace tenter::rig_test {
namespace {

using testing::HasSubstr;

RigConfig rig() { return *parseRigConfig(benchToml(), "rig.toml"); }
CaptureProtocol protocolOf(const std::string& toml) {
  return *parseCaptureProtocol(toml, "protocol.toml");
}

std::string travelToml(const std::string& target_m) {
  return R"(schema_version = 1
name = "draw"
description = "one cord by a way"
axes = ["axis-1"]
speed_m_per_s = 0.002
capture_interval_s = 1.0
[[phase]]
name = "draw"
[[phase.step]]
end = "travel"
targets_m = {axis-1 = )" +
         target_m + "}\n";
}

TEST(ProtocolSimulation, ForcesTimesAndWaysAreThoseOfTheSpring) {
  const ProtocolRun run = simulateProtocol(protocolOf(travelToml("0.01")), rig(), 100.0);
  EXPECT_TRUE(run.completed) << run.fault;
  EXPECT_NEAR(run.longest_way_m, 0.01, 1e-6);
  EXPECT_NEAR(run.highest_force_N, 1.0, 1e-3);
  EXPECT_EQ(run.captures, 6);  // 5 s
  EXPECT_GT(run.duration_s, 5.0);
  EXPECT_LT(run.duration_s, 10.0) << "unloading is at the axis' largest speed";
}

TEST(ProtocolSimulation, TooStiffASampleMeetsTheLimit) {
  const ProtocolForecast forecast = forecastProtocol(protocolOf(travelToml("0.02")), rig());
  EXPECT_FALSE(forecast.runs.front().completed);  // 8 N at 400 N/m, 5 N is the limit
  EXPECT_THAT(forecast.runs.front().fault, HasSubstr("phase draw, step 0"));
  EXPECT_THAT(forecast.runs.front().fault, HasSubstr("working-force"));
  ASSERT_NE(forecast.stiffest(), nullptr);
  EXPECT_EQ(forecast.stiffest()->stiffness_N_per_m, 200.0);
  ASSERT_NE(forecast.softest(), nullptr);
  EXPECT_EQ(forecast.softest(), &forecast.runs.back()) << "a way is gone on any sample";
}

TEST(ProtocolSimulation, TooSoftASampleNeverReachesItsForce) {
  const ProtocolForecast forecast = forecastProtocol(protocolOf(benchProtocolToml()), rig());
  ASSERT_NE(forecast.stiffest(), nullptr);
  EXPECT_EQ(forecast.stiffest(), &forecast.runs.front());
  EXPECT_LE(forecast.stiffest()->highest_force_N, 5.0);
  EXPECT_FALSE(forecast.runs.back().completed);  // 3 N take 7.7 m
  EXPECT_THAT(forecast.runs.back().fault, HasSubstr("force-not-reached"));
}

TEST(ProtocolSimulation, AWayBeyondTheTravelIsSeen) {
  std::string toml = travelToml("0.06");
  toml += "[[phase.step]]\nend = \"travel\"\ntargets_m = {axis-1 = 0.09}\n";
  const CaptureProtocol protocol = protocolOf(toml);
  const ProtocolForecast forecast = forecastProtocol(protocol, rig());
  EXPECT_EQ(forecast.stiffest(), nullptr);
  EXPECT_THAT(forecast.runs.back().fault, HasSubstr("travel"));
}

TEST(ProtocolSimulation, EndsThoughTheProtocolHardlyDoes) {
  std::string toml = travelToml("0.001");
  toml += "[[phase.step]]\nend = \"hold\"\nhold_s = 3600\n";
  toml.replace(toml.find("[[phase]]\n"), 10, "[[phase]]\ncycles = 100\n");
  const auto protocol = parseCaptureProtocol(toml, "protocol.toml");
  ASSERT_TRUE(protocol.ok()) << protocol.error().message();
  const ProtocolRun run = simulateProtocol(*protocol, rig(), 100.0);
  EXPECT_FALSE(run.completed);
  EXPECT_THAT(run.fault, HasSubstr("four hours"));
}

}  // namespace
}  // namespace tenter::rig_test
