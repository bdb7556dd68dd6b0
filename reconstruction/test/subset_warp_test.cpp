// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/subset_warp.h"

#include <gtest/gtest.h>

#include "warp_algebra.h"

namespace tenter {
namespace {

SubsetWarp curved() {
  SubsetWarp warp;
  warp.u = {1.3, 0.05, -0.02, 1e-3, -4e-4, 7e-4};
  warp.v = {-0.7, 0.01, 0.08, -6e-4, 9e-4, 2e-4};
  return warp;
}

Vec2 mapped(const SubsetWarp& warp, const Vec2& offset) {
  return offset + warp.displacementAt(offset);
}

TEST(SubsetWarp, MovedByIsTheSameMotionAroundAnotherPoint) {
  const Vec2 by(5.0, -3.0), offset(2.5, 4.0);
  const Vec2 same = curved().movedBy(by).displacementAt(offset);
  EXPECT_LT((same - curved().displacementAt(by + offset)).norm(), 1e-12);
}

TEST(SubsetWarp, AffineKeepsItsMap) {
  Mat2 linear;
  linear << 1.1, -0.2, 0.3, 0.9;
  const SubsetWarp warp = SubsetWarp::affine({3.0, -2.0}, linear);
  EXPECT_EQ(warp.linear(), linear);
  EXPECT_LT((mapped(warp, {4.0, 5.0}) - (linear * Vec2(4.0, 5.0) + Vec2(3.0, -2.0))).norm(), 1e-12);
}

TEST(ComposeWithInverse, UndoesAnAffineIncrementExactly) {
  Mat2 linear, small;
  linear << 1.1, -0.2, 0.3, 0.9;
  small << 1.02, 0.01, -0.03, 0.98;
  const SubsetWarp increment = SubsetWarp::affine({0.3, -0.1}, small);
  SubsetWarp warp = SubsetWarp::affine({3.0, -2.0}, linear);
  ASSERT_TRUE(composeWithInverse(warp, increment, 1));
  const Vec2 offset(6.0, -7.0);
  const Vec2 expected = linear * offset + Vec2(3.0, -2.0);
  EXPECT_LT((mapped(warp, mapped(increment, offset)) - expected).norm(), 1e-12);
}

TEST(ComposeWithInverse, IsOfSecondOrderForCurvedWarps) {
  SubsetWarp increment;
  increment.u = {0.01, 1e-3, -5e-4, 1e-5, 2e-5, -1e-5};
  increment.v = {-0.02, 2e-4, 1e-3, -2e-5, 1e-5, 1e-5};
  SubsetWarp warp = curved();
  ASSERT_TRUE(composeWithInverse(warp, increment, 2));
  for (const Vec2& offset : {Vec2(0.0, 0.0), Vec2(10.0, -5.0), Vec2(-12.0, 12.0)}) {
    const Vec2 error = mapped(warp, mapped(increment, offset)) - mapped(curved(), offset);
    // The third degree that is left out: curvature times curvature times the cube of the offset.
    EXPECT_LT(error.norm(), 1e-3) << offset.transpose();
  }
}

TEST(ComposeWithInverse, RefusesAnIncrementWithoutInverse) {
  const SubsetWarp before = curved();
  SubsetWarp warp = before;
  EXPECT_FALSE(composeWithInverse(warp, SubsetWarp::affine({0.0, 0.0}, Mat2::Zero()), 1));
  EXPECT_EQ(warp.u, before.u);
}

}  // namespace
}  // namespace tenter
