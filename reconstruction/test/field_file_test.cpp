// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/field_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

TEST(FieldFile, HasOneRowAPointAndNanWithoutAMatch) {
  CorrelationField field;
  field.points.resize(2);
  CorrelatedPoint& good = field.points[0];
  good.position = {15.0, 20.5};
  good.state = PointState::kValid;
  good.match.warp = SubsetWarp::translation({0.25, -1.5});
  good.match.covariance_px2 << 0.0001, 0.0, 0.0, 0.0007;
  good.match.zncc = 0.987654321;
  field.points[1].position = {16.0, 20.5};
  field.points[1].match.zncc = 0.5;
  EXPECT_EQ(formatField(field),
            "x,y,u,v,sigma,zncc,valid\n"
            "15,20.5,0.250000,-1.500000,0.020000,0.987654,1\n"
            "16,20.5,nan,nan,nan,0.500000,0\n");
}

TEST(FieldFile, PointsAreTwoColumns) {
  const test_support::TemporaryFolder folder;
  const auto points = readPoints(folder.write("p.csv", "x,y\n1.5,2\n3,4\n"));
  ASSERT_TRUE(points.ok());
  EXPECT_THAT(*points, testing::ElementsAre(Vec2(1.5, 2.0), Vec2(3.0, 4.0)));
  EXPECT_THAT(readPoints(folder.write("q.csv", "1,2\n3\n")).error().place,
              testing::HasSubstr("line 2"));
}

}  // namespace
}  // namespace tenter
