// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "running_rig.h"
#include "tenter/session/session_reader.h"
#include "tenter/twin/session_truth.h"

namespace tenter::rig_system_test {
namespace {

/// The shipped protocol, but fast and short.
constexpr const char* kStretch = R"(schema_version = 1
name = "stretch-weft"
description = "one cycle"
axes = ["axis-1", "axis-2", "axis-3", "axis-4"]
speed_m_per_s = 0.0009
capture_interval_s = 0.5
[[phase]]
name = "cycle"
[[phase.step]]
end = "force"
force_N = 0.6
limit_m = 0.05
[[phase.step]]
end = "force"
force_N = 0.25
limit_m = 0.05
)";

TEST(SpecimenTest, ASessionsForcesAreTheSpecimensAndThePulleys) {
  // 3 mN are the cells' noise; the rest is for rounding, lag and what happens between two readings.
  constexpr double kAgreement_N = 4e-3, kNoise_N = 2e-3, kBias_N = 1e-3, kPulled_N = 0.5;
  constexpr double kOtherFabric_N = 20e-3;
  RunningRig running;
  const std::string session = running.path("session");
  // A check of the mapping rubs the cords to and fro first: by travel alone nobody knows then which
  // way their friction points.
  ASSERT_EQ(running.tenterRig(
                {"run", running.write("p.toml", kStretch), "--skip-mapping-check", "-o", session}),
            0)
      << test_support::slurp(running.path("out"));
  ASSERT_TRUE(verifySession(session)->ok());
  const auto mount = readMount(running.path("mount.json"));
  ASSERT_TRUE(mount.ok());
  EXPECT_EQ(mountToJson(*mount), mountToJson(MountOptions{}));
  const auto truth = truthOfSession({session, *mount, {}, {}, {}});
  ASSERT_TRUE(truth.ok()) << truth.error().message();
  ASSERT_EQ(truth->cords.size(), 4U);
  EXPECT_LT(truth->rms_N, kAgreement_N);
  EXPECT_LT(truth->rms_by_travel_N, kAgreement_N);
  EXPECT_GT(truth->rms_N, kNoise_N);
  for (const CordAgreement& cord : truth->cords) {
    EXPECT_LT(std::abs(cord.bias_N), kBias_N) << cord.axis;
    EXPECT_GT(cord.highest_N, kPulled_N) << cord.axis;
  }

  MountOptions other;  // a check that could not fail would say nothing
  other.fabric = "satin-4";
  const auto wrong = truthOfSession({session, other, {}, {}, {}});
  ASSERT_TRUE(wrong.ok());
  EXPECT_GT(wrong->rms_N, kOtherFabric_N);
}

}  // namespace
}  // namespace tenter::rig_system_test
