// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>

#include "tenter/reconstruction/reconstruct_images.h"

namespace tenter {
namespace {

TEST(MeasuredFrame, AVertexOfUnknownUncertaintyIsNotValid) {
  constexpr int kVertices = 4;
  ClothFrame cloth;
  cloth.positions_m = Points3::Zero(3, kVertices);
  cloth.states.assign(kVertices, PointState::kValid);
  cloth.covariances_m2.assign(kVertices, 4e-12 * Mat3::Identity());
  cloth.covariances_m2[1](2, 2) = std::numeric_limits<double>::quiet_NaN();
  cloth.covariances_m2[2](0, 0) = -1e-12;
  cloth.states[3] = PointState::kNotFound;
  const MeasurementFrame frame = measuredFrame(cloth, 7);
  EXPECT_EQ(frame.time_ns, 7);
  EXPECT_EQ(frame.valid, (std::vector<std::uint8_t>{1, 0, 0, 0}));
  EXPECT_TRUE(frame.position_sigma_m.allFinite());
  EXPECT_TRUE(frame.position_sigma_axes_m.allFinite());
  EXPECT_DOUBLE_EQ(frame.position_sigma_axes_m(0, 0), 2e-6);
}

}  // namespace
}  // namespace tenter
