// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/register_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tenter/core/files.h"
#include "tenter/core/toml_document.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"

namespace tenter {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

std::filesystem::path mapFolder() { return test_support::sourceFolder() / "rig/register-maps"; }

std::string laumasText() { return readFile(mapFolder() / "laumas-tlb.toml").value(); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

TEST(RegisterMapTest, EveryShippedMapIsReadAndFitsTheSchema) {
  const auto schema = test_support::sourceFolder() / "docs/formats/register-map.schema.json";
  int maps = 0;
  for (const auto& entry : std::filesystem::directory_iterator(mapFolder())) {
    ++maps;
    const Result<RegisterMap> map = readRegisterMap(entry.path());
    EXPECT_TRUE(map.ok()) << (map.ok() ? "" : map.error().message());
    const auto json = jsonOfToml(readFile(entry.path()).value(), entry.path().string());
    EXPECT_THAT(test_support::schemaErrors(json.value(), schema), IsEmpty()) << entry.path();
  }
  EXPECT_GE(maps, 3);
  nlohmann::json nameless = jsonOfToml(laumasText(), "f").value();
  nameless.erase("name");
  EXPECT_FALSE(test_support::schemaErrors(nameless, schema).empty());
}

TEST(RegisterMapTest, ReadsWhatTheLaumasFileSays) {
  const RegisterMap map = parseRegisterMap(laumasText(), "f").value();
  EXPECT_EQ(map.read_function, 3);
  EXPECT_EQ(map.write_function, 16);
  EXPECT_EQ(map.gross.address, 7);
  EXPECT_EQ(map.net.negative_bit, 8);
  EXPECT_TRUE(map.net.twos_complement);
  EXPECT_EQ(map.scale.choices.size(), 19U);
  EXPECT_EQ(map.scale.choices[18], 0.0001);
  EXPECT_EQ(map.status.bits[3], StatusMeaning::kOverRange);
  EXPECT_EQ(map.findCommand("zero")->words, std::vector<std::uint16_t>{8});
  EXPECT_EQ(map.findCommand("explode"), nullptr);
  EXPECT_EQ(map.scaleRegistersToAsk(), std::vector<int>{13});
}

struct Breach {
  const char *from, *to, *place, *reason;
};

class BrokenMapTest : public testing::TestWithParam<Breach> {};

TEST_P(BrokenMapTest, NamesFileKeyAndReason) {
  const Breach& breach = GetParam();
  const Result<RegisterMap> map =
      parseRegisterMap(replaced(laumasText(), breach.from, breach.to), "a.toml");
  ASSERT_FALSE(map.ok());
  EXPECT_EQ(map.error().file, "a.toml");
  EXPECT_THAT(map.error().place, HasSubstr(breach.place));
  EXPECT_THAT(map.error().reason, HasSubstr(breach.reason));
}

INSTANTIATE_TEST_SUITE_P(
    Breaches, BrokenMapTest,
    testing::Values(
        Breach{"schema_version = 1", "schema_version = 2", "schema_version", "between 1 and 1"},
        Breach{"name = ", "nmae = ", "nmae", "not a key"},
        Breach{"max_registers = 32", "max_registers = \"32\"", "max_registers", "whole number"},
        Breach{"max_registers = 32", "max_registers = 7", "block[0].counts[1]", "between 1 and 7"},
        Breach{"write_function = 16", "write_function = 15", "write_function", "6 or 16"},
        Breach{"counts = [5, 8, 6, 7]", "counts = [5]", "block", "same length"},
        Breach{"counts = [5, 8, 6, 7]", "counts = [5, 6, 5]", "block", "same length"},
        Breach{"counts = [5, 8, 6, 7]", "counts = []", "block[0].counts", "1 to 8"},
        Breach{"counts = [5, 8, 6, 7]", "counts = [4, 5]", "net", "not read in every scan"},
        Breach{"first = 6", "first = 65530", "block[0].counts", "beyond register 65535"},
        Breach{"cell-error = [0]", "cell-eror = [0]", "cell-eror", "no meaning"},
        Breach{"cell-error = [0]", "cell-error = [16]", "cell-error[0]", "between 0 and 15"},
        Breach{"cell-error = [0]", "cell-error = [0, 11]", "status.bits", "second meaning"},
        Breach{"type = \"u32\"", "type = \"u33\"", "gross.type", "not known"},
        Breach{"type = \"u32\"", "type = \"i32\"", "gross.negative_bit", "unsigned magnitude"},
        Breach{"type = \"u32\"", "type = \"u16\"", "gross.word_order", "one register"},
        Breach{"word_order = \"high-first\"", "word_order = \"middle\"", "gross.word_order",
               "not known"},
        Breach{"bits = [0, 7]", "bits = [7, 0]", "scale.bits", "lowest"},
        Breach{"100.0, 50.0", "0.0, 50.0", "scale.values[0]", "above 0"},
        Breach{"\"kg\", \"g\"", "\"kg\", \"stone\"", "unit.values[1]", "no unit of force"},
        Breach{"values = [7]", "values = [70000]", "command.tare.values[0]", "65535"},
        Breach{"values = [7]", "values = []", "command.tare.values", "1 to 16"},
        Breach{"register = 6", "register = -1", "status.register", "between 0 and 65535"},
        Breach{"schema_version = 1", "schema_version = 1\nsum_tolerance = nan", "sum_tolerance",
               "finite"},
        Breach{"schema_version = 1", "schema_version = 2020-01-01", "schema_version", "date"},
        Breach{"schema_version = 1", "schema_version = ", "line 4", "not valid TOML"}));

TEST(RegisterMapTest, RefusesWhatIsNoMapAtAll) {
  EXPECT_FALSE(parseRegisterMap("", "f").ok());
  EXPECT_FALSE(parseRegisterMap("block = 3", "f").ok());
  EXPECT_FALSE(parseRegisterMap(std::string("a\0b", 3), "f").ok());
  EXPECT_FALSE(parseRegisterMap("a = " + std::string(100'000, '['), "f").ok());
  EXPECT_FALSE(parseRegisterMap(std::string(2'000'000, '#'), "f").ok());
  const auto missing = readRegisterMap("nowhere/at-all.toml");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().file, "nowhere/at-all.toml");
}

TEST(RegisterMapTest, SurvivesEveryCharacterThatIsMissing) {
  const std::string text = laumasText();
  int refused = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string shorter = text;
    shorter.erase(at, 1);
    const Result<RegisterMap> map = parseRegisterMap(shorter, "a.toml");
    if (map) continue;  // a comment, a blank, a digit of a number
    ++refused;
    EXPECT_EQ(map.error().file, "a.toml");
    EXPECT_FALSE(map.error().place.empty()) << map.error().reason;
    EXPECT_FALSE(map.error().reason.empty());
  }
  EXPECT_GT(refused, 500);
}

TEST(RegisterMapTest, KnowsUnitsOfForce) {
  EXPECT_DOUBLE_EQ(*newtonsPerUnit("kg"), 9.80665);
  EXPECT_NEAR(*newtonsPerUnit("lb"), 4.4482216152605, 1e-12);
  EXPECT_EQ(newtonsPerUnit("litre"), std::nullopt);
}

}  // namespace
}  // namespace tenter
