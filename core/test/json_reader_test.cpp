// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/json_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

TEST(ParseJsonTest, NamesLineAndColumn) {
  const auto error = parseJson("{\n \"a\": 1,\n \"b\": nan\n}", "f.json").error();
  EXPECT_THAT(error.place, StartsWith("line 3, column"));
  EXPECT_EQ(error.file, "f.json");
  EXPECT_THAT(parseJson("{\"a\": [1, 2", "f").error().reason, HasSubstr("ends too early"));
  EXPECT_THAT(parseJson("", "f").error().reason, HasSubstr("ends too early"));
  EXPECT_THAT(parseJson("{x}", "f", "line 7").error().place, StartsWith("line 7, column"));
}

TEST(ParseJsonTest, RefusesWhatParsersDisagreeOn) {
  EXPECT_THAT(parseJson(R"({"a":1,"a":2})", "f").error().reason, HasSubstr("twice"));
  EXPECT_FALSE(parseJson(R"({"a":1e999})", "f").ok());
  EXPECT_FALSE(parseJson("{\"a\":\"\xff\"}", "f").ok());
  EXPECT_TRUE(parseJson(R"({"a":{"b":1},"c":{"b":2}})", "f").ok());
}

TEST(ParseJsonTest, RefusesDepthThatWouldOverflowTheStack) {
  EXPECT_THAT(parseJson(std::string(1'000'000, '['), "f").error().reason, HasSubstr("deep"));
  EXPECT_TRUE(
      parseJson(R"(["[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["])", "f"));
}

TEST(JsonReaderTest, ReadsEveryKind) {
  const auto json = parseJson(R"({"n":1.5,"i":-3,"t":"x","b":true,"ns":[1,2],"is":[3,4],
      "ts":["p","q"],"m":[[1,2],[3,4],[5,6]],"o":{"k":2},"l":[{"k":5}]})",
                              "f");
  ASSERT_TRUE(json.ok());
  JsonReader in(*json, "f");
  EXPECT_EQ(in.number("n", Range::positive()), 1.5);
  EXPECT_EQ(in.numberOr("absent", 7.0), 7.0);
  EXPECT_EQ(in.integer("i", -5, 5), -3);
  EXPECT_EQ(in.text("t"), "x");
  EXPECT_EQ(in.textOr("absent", "y"), "y");
  EXPECT_TRUE(in.boolean("b"));
  EXPECT_THAT(in.numbers("ns"), ElementsAre(1.0, 2.0));
  EXPECT_THAT(in.integers("is", 0, 9), ElementsAre(3, 4));
  EXPECT_THAT(in.texts("ts"), ElementsAre("p", "q"));
  EXPECT_EQ(in.vector("ns", 2), Eigen::Vector2d(1, 2));
  EXPECT_EQ(in.matrix("m", -1, 2)(2, 0), 5.0);
  EXPECT_EQ(in.object("o").number("k"), 2.0);
  EXPECT_EQ(in.arraySize("l"), 1U);
  EXPECT_EQ(in.element("l", 0).integer("k", 0, 9), 5);
  EXPECT_TRUE(in.ok());
}

struct Complaint {
  const char* json;
  std::function<void(JsonReader&)> read;
  const char* place;
  const char* reason;
};

class ComplaintTest : public testing::TestWithParam<Complaint> {};

TEST_P(ComplaintTest, NamesThePath) {
  const auto json = parseJson(GetParam().json, "f");
  ASSERT_TRUE(json.ok());
  JsonReader in(*json, "f.json");
  GetParam().read(in);
  ASSERT_FALSE(in.ok());
  EXPECT_EQ(in.error().place, GetParam().place);
  EXPECT_THAT(in.error().reason, HasSubstr(GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(
    Fields, ComplaintTest,
    testing::Values(
        Complaint{"{}", [](JsonReader& in) { in.number("n"); }, "n", "is missing"},
        Complaint{R"({"n":null})", [](JsonReader& in) { in.number("n"); }, "n", "null"},
        Complaint{R"({"n":"1"})", [](JsonReader& in) { in.number("n"); }, "n", "a number"},
        Complaint{R"({"n":0})", [](JsonReader& in) { in.number("n", Range::positive()); }, "n",
                  "above 0"},
        Complaint{R"({"n":3})", [](JsonReader& in) { in.number("n", Range::between(0, 2)); }, "n",
                  "at most 2"},
        Complaint{R"({"i":1.5})", [](JsonReader& in) { in.integer("i", 0, 9); }, "i", "whole"},
        Complaint{R"({"i":18446744073709551615})",
                  [](JsonReader& in) { in.integer("i", 0, INT64_MAX); }, "i", "whole"},
        Complaint{R"({"i":[1,10]})", [](JsonReader& in) { in.integers("i", 0, 9); }, "i[1]",
                  "between 0 and 9"},
        Complaint{R"({"t":1})", [](JsonReader& in) { in.text("t"); }, "t", "a text"},
        Complaint{R"({"t":"long"})", [](JsonReader& in) { in.text("t", 3); }, "t", "longer"},
        Complaint{R"({"b":1})", [](JsonReader& in) { in.boolean("b"); }, "b", "true or false"},
        Complaint{R"({"v":[1,2]})", [](JsonReader& in) { in.vector("v", 3); }, "v", "2 numbers"},
        Complaint{R"({"m":[[1,2],[3]]})", [](JsonReader& in) { in.matrix("m", 2, 2); }, "m[1]",
                  "list of 2"},
        Complaint{R"({"m":[[1,2]]})", [](JsonReader& in) { in.matrix("m", 3, 2); }, "m", "1 rows"},
        Complaint{R"({"o":[]})", [](JsonReader& in) { in.object("o").number("k"); }, "o", "object"},
        Complaint{R"({"l":{}})", [](JsonReader& in) { in.arraySize("l"); }, "l", "a list"},
        Complaint{R"({"l":[]})", [](JsonReader& in) { in.element("l", 0).number("k"); }, "l",
                  "no element 0"},
        Complaint{R"({"l":[{"k":{"z":-1}}]})",
                  [](JsonReader& in) {
                    in.element("l", 0).object("k").number("z", Range::nonNegative());
                  },
                  "l[0].k.z", "at least 0"},
        Complaint{"[]", [](JsonReader& in) { in.number("n"); }, "", "object"}));

TEST(JsonReaderTest, TheFirstComplaintStays) {
  const auto json = parseJson("{}", "f");
  JsonReader in(*json, "f", "line 4");
  in.number("first");
  in.number("second");
  EXPECT_EQ(in.error().place, "line 4: first");
}

TEST(ReadJsonFileTest, NamesTheFile) {
  const test_support::TemporaryFolder folder;
  const auto json = readJsonFile(folder.write("broken.json", "{\"a\":"));
  ASSERT_FALSE(json.ok());
  EXPECT_THAT(json.error().file, HasSubstr("broken.json"));
}

}  // namespace
}  // namespace tenter
