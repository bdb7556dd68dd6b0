// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/median.h"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

namespace tenter {
namespace {

TEST(Median, IsTheMiddleOrTheUpperOfTwo) {
  EXPECT_EQ(medianOf(std::vector<double>{3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(medianOf(std::deque<double>{4.0, 1.0, 2.0, 3.0}), 3.0);
  EXPECT_EQ(medianOf(std::vector<float>{5.0F}), 5.0);
  EXPECT_EQ(medianOf(std::vector<double>{}), 0.0);
}

}  // namespace
}  // namespace tenter
