// SPDX-License-Identifier: GPL-3.0-or-later
// The configuration of the rig and the protocols that ship.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine_bench.h"
#include "tenter/core/toml_document.h"
#include "tenter/rig/shipped_files.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"

namespace tenter::rig_test {
namespace {

using testing::HasSubstr;

struct Breach {
  const char *from, *to, *place, *reason;
};

std::string replaced(std::string text, const Breach& breach) {
  const auto at = text.find(breach.from);
  require(at != std::string::npos, std::string("not in the text: ") + breach.from);
  return text.replace(at, std::string(breach.from).size(), breach.to);
}

template <class T>
void expectError(const Result<T>& result, const Breach& breach) {
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().file, "a.toml");
  EXPECT_THAT(result.error().place, HasSubstr(breach.place));
  EXPECT_THAT(result.error().reason, HasSubstr(breach.reason));
}

class BrokenRigTest : public testing::TestWithParam<Breach> {};
TEST_P(BrokenRigTest, NamesFileKeyAndReason) {
  expectError(parseRigConfig(replaced(benchToml(), GetParam()), "a.toml"), GetParam());
}
INSTANTIATE_TEST_SUITE_P(
    Breaches, BrokenRigTest,
    testing::Values(
        Breach{"schema_version = 1", "schema_version = 2", "schema_version", "between"},
        Breach{"working_N = 5.0", "working_N = 6.0", "limits.working_N", "below absolute_N"},
        Breach{"slack_N", "slak_N", "limits.slak_N", "not a key"},
        Breach{"absolute_N = 6.0", "absolute_N = 60.0", "cell[0].capacity_N", "would not be seen"},
        Breach{"address = \"tcp", "address = \"udp", "cell[0].address", "udp"},
        Breach{"map = \"laumas-tlb\"", "map = \"none.toml\"", "cell[0].map", "none.toml"},
        Breach{"cell = \"cell-2\"", "cell = \"cell-1\"", "axis[1].cell", "has that cell"},
        Breach{"cell = \"cell-2\"", "cell = \"cell-9\"", "axis[1].cell", "no cell"},
        Breach{"name = \"axis-2\"", "name = \"axis-1\"", "axis[1].name", "another axis"},
        Breach{"travel_m = [0.0, 0.08]", "travel_m = [0.0]", "axis[0].travel_m", "largest"},
        Breach{"max_speed_m_per_s = 0.005", "max_speed_m_per_s = nan", "max_speed", "finite"}));

TEST(RigConfigTest, SpeedIsCappedByTheForceThatASampleCouldGain) {
  const RigConfig rig =
      *parseRigConfig(replaced(benchToml(), {"= 400.0", "= 40000.0", "", ""}), "f");
  EXPECT_DOUBLE_EQ(speedCap_m_per_s(rig.limits), 1.0 / (40000.0 * 0.25));
  EXPECT_DOUBLE_EQ(rig.axes[0].device.max_speed_m_per_s, speedCap_m_per_s(rig.limits));
  EXPECT_EQ(rig.axes[1].cell, 1);
}

class BrokenProtocolTest : public testing::TestWithParam<Breach> {};
TEST_P(BrokenProtocolTest, NamesFileKeyAndReason) {
  expectError(parseCaptureProtocol(replaced(benchProtocolToml(), GetParam()), "a.toml"),
              GetParam());
}
INSTANTIATE_TEST_SUITE_P(
    Breaches, BrokenProtocolTest,
    testing::Values(
        Breach{"schema_version = 1", "schema_version = 0", "schema_version", "between"},
        Breach{"axes = [\"axis-1\", \"axis-2\"]", "axes = []", "axes", "1 to 64"},
        Breach{"\"axis-2\"]", "\"axis-1\"]", "axes", "twice"},
        Breach{"cycles = 2", "cycles = 0", "phase[0].cycles", "between"},
        Breach{"end = \"hold\"", "end = \"wait\"", "phase[0].step[1].end", "not known"},
        Breach{"hold_s = 0.2", "hold_s = 0.2\nforce_N = 1.0", "phase[0].step[1].force_N",
               "not a key"},
        Breach{"limit_m = 0.05", "", "phase[0].step[0].limit_m", "missing"},
        Breach{"force_N = 3.0", "force_N = -3.0", "phase[0].step[0].force_N", "at least"},
        Breach{"cycles = 2", "cycles = 2\nspeed_m_per_s = 0.0", "phase[0].speed_m_per_s",
               "must be"},
        Breach{"capture_interval_s = 0.5", "capture_interval_s = 0.0", "capture_interval_s", ""}));

TEST(ProtocolTest, APhaseHasItsOwnSpeedUnlessAStepSaysOtherwise) {
  const auto protocol = parseCaptureProtocol(
      replaced(replaced(benchProtocolToml(),
                        {"cycles = 2", "cycles = 2\nspeed_m_per_s = 0.001", "", ""}),
               {"force_N = 3.0", "force_N = 3.0\nspeed_m_per_s = 0.002", "", ""}),
      "a.toml");
  ASSERT_TRUE(protocol.ok()) << protocol.error().message();
  const auto& steps = protocol->phases.at(0).steps;
  EXPECT_EQ(steps.at(0).speed_m_per_s, 0.002);
  EXPECT_EQ(steps.at(2).speed_m_per_s, 0.001);
}

class UnfitProtocolTest : public testing::TestWithParam<Breach> {};
TEST_P(UnfitProtocolTest, IsRefusedByTheRigBeforeAnythingMoves) {
  const auto protocol = parseCaptureProtocol(replaced(benchProtocolToml(), GetParam()), "a.toml");
  ASSERT_TRUE(protocol.ok());
  const auto fits = checkAgainstRig(*protocol, *parseRigConfig(benchToml(), "rig.toml"));
  ASSERT_FALSE(fits.ok());
  EXPECT_EQ(fits.error().kind, ErrorKind::kInterlock);
  EXPECT_THAT(fits.error().place, HasSubstr(GetParam().place));
  EXPECT_THAT(fits.error().reason, HasSubstr(GetParam().reason));
}
INSTANTIATE_TEST_SUITE_P(
    Breaches, UnfitProtocolTest,
    testing::Values(
        Breach{"force_N = 3.0", "force_N = 5.5", "step 0", "working force"},
        Breach{"axis-2", "axis-7", "step 0", "no axis"},
        Breach{"speed_m_per_s = 0.004", "speed_m_per_s = 0.0051", "step 0", "no faster"},
        Breach{"cycles = 2", "cycles = 2\nspeed_m_per_s = 0.006", "step 0", "no faster"},
        Breach{"end = \"hold\"\nhold_s = 0.2", "end = \"travel\"\ntargets_m = {axis-1 = 0.09}",
               "step 1", "travel"}));

TEST(ShippedProtocolsTest, AreAllReadableAndNamedAsTheirFiles) {
  std::vector<std::string> names;
  for (const ShippedFile& file : shippedProtocols()) {
    const auto protocol = parseCaptureProtocol(file.text, std::string(file.name));
    ASSERT_TRUE(protocol.ok()) << protocol.error().message();
    EXPECT_EQ(protocol->name, file.name);
    names.push_back(protocol->name);
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("stretch-weft", "stretch-warp", "shear",
                                                   "bend-weft", "bend-warp", "bend-bias",
                                                   "complex-shear", "corner-pull"));
}

std::vector<std::string> bySchema(std::string_view toml, const char* schema) {
  return test_support::schemaErrors(*jsonOfToml(toml, "a.toml"),
                                    test_support::sourceFolder() / "docs/formats" / schema);
}

TEST(RigSchemaTest, HoldsForWhatIsReadAndRefusesWhatIsNot) {
  EXPECT_THAT(bySchema(benchToml(), "rig.schema.json"), testing::IsEmpty());
  for (const Breach& breach :
       {Breach{"schema_version = 1", "schema_version = 2", "", ""},
        Breach{"slack_N", "slak_N", "", ""}, Breach{"travel_m = [0.0, 0.08]", "", "", ""},
        Breach{"address = \"tcp", "address = \"udp", "", ""}}) {
    EXPECT_THAT(bySchema(replaced(benchToml(), breach), "rig.schema.json"),
                testing::Not(testing::IsEmpty()))
        << breach.to;
  }
}

TEST(ProtocolSchemaTest, HoldsForWhatShipsAndRefusesWhatIsNotRead) {
  for (const ShippedFile& file : shippedProtocols()) {
    EXPECT_THAT(bySchema(file.text, "protocol.schema.json"), testing::IsEmpty()) << file.name;
  }
  EXPECT_THAT(bySchema(benchProtocolToml(), "protocol.schema.json"), testing::IsEmpty());
  for (const Breach& breach : {Breach{"limit_m = 0.05", "", "", ""},
                               Breach{"hold_s = 0.2", "hold_s = 0.2\nforce_N = 1.0", "", ""},
                               Breach{"end = \"hold\"", "end = \"rest\"", "", ""}}) {
    EXPECT_THAT(bySchema(replaced(benchProtocolToml(), breach), "protocol.schema.json"),
                testing::Not(testing::IsEmpty()))
        << breach.from;
  }
}

}  // namespace
}  // namespace tenter::rig_test
