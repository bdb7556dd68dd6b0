// SPDX-License-Identifier: GPL-3.0-or-later
#include "neighbour_lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tenter {
namespace {

TEST(NeighbourLists, AreTheNearestInOrder) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.0, 100.0);
  std::vector<Vec2> points(300);
  for (Vec2& point : points) point = Vec2(place(random), place(random));
  const auto lists = neighbourLists(points, 5);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<int> others;
    for (int k = 0; k < 300; ++k) {
      if (k != static_cast<int>(i)) others.push_back(k);
    }
    std::partial_sort(others.begin(), others.begin() + 5, others.end(), [&](int a, int b) {
      return (points[a] - points[i]).norm() < (points[b] - points[i]).norm();
    });
    others.resize(5);
    ASSERT_EQ(lists[i], others) << i;
  }
}

TEST(NeighbourLists, PointsMayCoincideOrLieOnALine) {
  EXPECT_TRUE(neighbourLists({}, 3).empty());
  EXPECT_TRUE(neighbourLists({Vec2(1.0, 1.0)}, 3)[0].empty());
  const auto same = neighbourLists(std::vector<Vec2>(4, Vec2(1.0, 1.0)), 3);
  EXPECT_EQ(same[0].size(), 3U);
  std::vector<Vec2> line;
  for (int i = 0; i < 50; ++i) line.emplace_back(i, 2.0);
  EXPECT_THAT(neighbourLists(line, 2)[10], testing::ElementsAre(9, 11));
}

}  // namespace
}  // namespace tenter
