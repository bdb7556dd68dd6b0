// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/mounted_specimen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cord_friction.h"
#include "tenter/core/files.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using Positions = MountedSpecimen::Positions;

std::unique_ptr<MountedSpecimen> hung(const std::string& protocol) {
  MountOptions options;
  options.protocol = protocol;
  options.nodes = 15;
  auto specimen = MountedSpecimen::hang(options);
  if (!specimen) throw std::runtime_error(specimen.error().message());
  return *std::move(specimen);
}

Positions drawn(int first, int last, double way_m) {
  Positions positions{};
  for (int i = first; i <= last; ++i) positions[static_cast<std::size_t>(i)] = way_m;
  return positions;
}

TEST(MountedSpecimenTest, DrawingInStretchesTheClothAndItsFrictionStays) {
  const auto specimen = hung("stretch-weft");
  const auto home_N = specimen->moment().tension_N;
  ASSERT_TRUE(specimen->follow(drawn(0, 3, 0.008)));
  const auto out_N = specimen->moment().tension_N;
  ASSERT_TRUE(specimen->follow(drawn(0, 3, 0.016)));
  EXPECT_GT(specimen->moment().tension_N[0], 1.5 * out_N[0]);
  ASSERT_TRUE(specimen->follow(drawn(0, 3, 0.008)));
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(out_N[i], home_N[i]);
    EXPECT_LT(specimen->moment().tension_N[i], 0.9 * out_N[i]) << "no hysteresis on cord " << i;
  }
  for (std::size_t i = 4; i < 8; ++i) EXPECT_EQ(specimen->moment().tension_N[i], 0.0);
}

TEST(MountedSpecimenTest, TheTangentForetellsSmallMovesOfEveryActuator) {
  // Second order in the way: at 20 micrometres some micronewtons, at 200 a hundred times that.
  constexpr double kNear_m = 2e-5, kFar_m = 2e-4, kNear_N = 2e-5, kFar_N = 2e-3;
  for (const char* protocol : {"stretch-weft", "shear", "complex-shear", "corner-pull"}) {
    const auto specimen = hung(protocol);
    Positions at = drawn(0, 7, 0.012);
    ASSERT_TRUE(specimen->follow(at)) << protocol;
    for (int axis = 0; axis < MountedSpecimen::kAxes; ++axis) {
      if (!specimen->hasCord(axis)) continue;
      for (const double way_m : {kNear_m, kFar_m}) {
        const MountedSpecimen::Moment before = specimen->moment();
        at[static_cast<std::size_t>(axis)] += way_m;
        ASSERT_TRUE(specimen->follow(at));
        for (int felt = 0; felt < MountedSpecimen::kAxes; ++felt) {
          EXPECT_NEAR(before.tensionNear_N(felt, at),
                      specimen->moment().tension_N[static_cast<std::size_t>(felt)],
                      way_m == kNear_m ? kNear_N : kFar_N)
              << protocol << ", axis " << axis + 1 << " felt by " << felt + 1;
        }
        EXPECT_GT(before.stiffness_N_per_m.col(axis).cwiseAbs().maxCoeff(), 1.0);
      }
    }
  }
}

TEST(MountedSpecimenTest, TheSamePathGivesTheSameTensions) {
  const auto one = hung("corner-pull"), other = hung("corner-pull");
  for (const double way_m : {0.004, 0.009, 0.005}) {
    ASSERT_TRUE(one->follow(drawn(0, 1, way_m)));
    ASSERT_TRUE(other->follow(drawn(0, 1, way_m)));
  }
  EXPECT_EQ(one->moment().tension_N, other->moment().tension_N);
}

TEST(MountedSpecimenTest, UnusedCordsAreHookedAndTheTableHasNone) {
  const auto specimen = hung("stretch-weft");
  EXPECT_EQ(specimen->cordName(0), "near/a");
  EXPECT_FALSE(specimen->hasCord(4));
  EXPECT_EQ(specimen->hookTension_N(4, MountedSpecimen::kHookSlack_m), 0.0);
  EXPECT_NEAR(specimen->hookTension_N(4, MountedSpecimen::kHookSlack_m + 0.01),
              0.01 * MountedSpecimen::kHook_N_per_m, 1e-12);
  EXPECT_EQ(specimen->hookTension_N(0, 0.05), 0.0);
  const auto table = hung("bend-weft");
  EXPECT_FALSE(table->hasCords());
  EXPECT_TRUE(table->follow(drawn(0, 0, 0.07)));
  EXPECT_EQ(table->hookTension_N(0, 0.07), 0.0);
  EXPECT_GT(table->hookTension_N(1, 0.07), 0.0);
}

TEST(MountedSpecimenTest, RefusesWhatThereIsNot) {
  MountOptions options;
  options.protocol = "tear";
  EXPECT_THAT(MountedSpecimen::hang(options).error().message(), testing::HasSubstr("stretch-weft"));
  options = {};
  options.fabric = "felt";
  EXPECT_THAT(MountedSpecimen::hang(options).error().message(), testing::HasSubstr("knit-12"));
  options = {};
  options.nodes = 14;
  EXPECT_FALSE(MountedSpecimen::hang(options).ok());
}

TEST(MountedSpecimenTest, AMountSurvivesItsFile) {
  const test_support::TemporaryFolder folder;
  const std::filesystem::path file(folder / "mount.json");
  const MountOptions options{"satin-4", "shear", 5521, 3, 31};
  ASSERT_TRUE(writeFileAtomically(file, mountToJson(options).dump()).ok());
  const auto read = readMount(file);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(mountToJson(*read), mountToJson(options));
  nlohmann::json broken = mountToJson(options);
  broken["nodes"] = 1e6;
  ASSERT_TRUE(writeFileAtomically(file, broken.dump()).ok());
  EXPECT_THAT(readMount(file).error().message(), testing::HasSubstr("nodes"));
}

TEST(CordFrictionTest, TurnsRoundOverItsPresliding) {
  constexpr double kLevel_N = 0.05;
  CordFriction friction(kLevel_N);
  friction.follow(0.12);
  EXPECT_EQ(friction.force_N(), 0.0);
  friction.follow(0.119);
  EXPECT_EQ(friction.force_N(), kLevel_N);
  friction.follow(0.119 + 0.5 * CordFriction::kPresliding_m);
  EXPECT_NEAR(friction.force_N(), 0.0, 1e-9);
  friction.follow(0.125);
  EXPECT_EQ(friction.force_N(), -kLevel_N);
}

}  // namespace
}  // namespace tenter
