// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tenter/core/files.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

struct GoodTable {
  const char* text;
  int rows;
};

class GoodTableTest : public testing::TestWithParam<GoodTable> {};

TEST_P(GoodTableTest, IsRead) {
  const TemporaryFolder folder;
  const auto table = readNumericTable(folder.write("t.csv", GetParam().text), 2);
  ASSERT_TRUE(table.ok()) << table.error().message();
  ASSERT_EQ(table->rows(), GetParam().rows);
  EXPECT_EQ((*table)(0, 0), 1.5);
  EXPECT_EQ((*table)(0, 1), -2e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Separators, GoodTableTest,
    testing::Values(GoodTable{"1.5,-2e-3\n3,4\n", 2}, GoodTable{"1.5;-2e-3", 1},
                    GoodTable{"mm,N\r\n1.5, -2e-3\r\n", 1}, GoodTable{" 1.5\t-2e-3\n", 1},
                    GoodTable{"# note\n\n+1.5   -2e-3 \n", 1},
                    GoodTable{"\xEF\xBB\xBF"
                              "1.5,-2e-3\n",
                              1},
                    GoodTable{"displacement force\n1.5 -2e-3\n", 1},
                    GoodTable{"Weg [mm];Kraft [N]\r\n1,5;-2e-3\r\n\r\n", 1},
                    GoodTable{"1,5\t-0,002\n2,5\t3\n", 2}, GoodTable{"1.5,\t-2e-3\n", 1},
                    GoodTable{"\"mm\",\"N\"\n\"1.5\",\"-2e-3\"\n", 1}));

struct BadTable {
  const char* text;
  const char* place;
  const char* reason;
};

class BadTableTest : public testing::TestWithParam<BadTable> {};

TEST_P(BadTableTest, IsRefusedWithItsPlace) {
  const TemporaryFolder folder;
  const auto table = readNumericTable(folder.write("t.csv", GetParam().text), 2);
  ASSERT_FALSE(table.ok());
  EXPECT_EQ(table.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(table.error().file, HasSubstr("t.csv"));
  EXPECT_EQ(table.error().place, GetParam().place);
  EXPECT_THAT(table.error().reason, HasSubstr(GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(
    Broken, BadTableTest,
    testing::Values(BadTable{"", "", "no rows"}, BadTable{"mm,N\n", "", "no rows"},
                    BadTable{"1,2\n3\n", "line 2", "1 columns instead of 2"},
                    BadTable{"1,2\n3,4,5\n", "line 2", "3 columns"},
                    BadTable{"1,2,\n", "line 1", "3 columns"},
                    BadTable{"a,b\nc,d\n1,2\n", "line 2, column 1", "\"c\" is not a number"},
                    BadTable{"1,2\n3,x\n", "line 2, column 2", "\"x\" is not a number"},
                    BadTable{"1,2\n3,\n", "line 2, column 2", "not a number"},
                    BadTable{"1,nan\n", "line 1, column 2", "not finite"},
                    BadTable{"1,inf\n", "line 1, column 2", "not finite"},
                    BadTable{"1,1e999\n", "line 1, column 2", "not a number"},
                    BadTable{"1,5;2.5\n", "line 1, column 2", "mixed"},
                    BadTable{"0,5;2\n1;1.234,5\n", "line 2, column 2", "not a number"},
                    BadTable{"0,5;1,234,567\n", "line 1, column 2", "not a number"},
                    BadTable{"0.5;1\n1.5;1,234\n", "line 2, column 2", "mixed"}));

TEST(NumericTableTest, ReadsRealTensileData) {
  const auto file = test_support::findData("nylon-offaxis/angle-00.csv");
  if (!file) GTEST_SKIP() << test_support::noData();
  const auto table = readNumericTable(*file, 2);
  ASSERT_TRUE(table.ok()) << table.error().message();
  EXPECT_GT(table->rows(), 10);
  EXPECT_NEAR(table->col(0).maxCoeff(), 4.0, 0.5);  // "to about 4 mm", says its README
}

}  // namespace
}  // namespace tenter
