// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/measured_sheet.h"

#include <gtest/gtest.h>

#include <random>

#include "cloth_fixture.h"

namespace tenter::kinds {
namespace {

constexpr double kNoise_m = 5e-5;

class MeasuredSheetTest : public testing::Test {
 protected:
  MeasuredSheetTest()
      : measurement_(syntheticCloth("bend-weft", clothParameters(modelNamed("stvk")), options())) {}

  static FitTestOptions options() {
    FitTestOptions options;
    options.nodes = 13;
    return options;
  }

  /// Root mean square of the vector distance of tracked vertices from the sheet.
  double distance_m(const MeasuredSheet& sheet, const Points3& tracked) const {
    const SheetFrame frame = sheetFrame(*measurement_.rest).value();
    const std::vector<ClipOutline> outlines{
        clipOutline(measurement_.frames[0].clips[0], frame).value()};
    const Interpolation p =
        interpolation(replicaLines(frame, outlines, options()), frame.vertices_m);
    const Points3 seen = (p * sheet.mesh.positions.transpose()).transpose();
    return std::sqrt((seen - tracked).squaredNorm() / static_cast<double>(tracked.cols()));
  }

  Measurement measurement_;
};

TEST_F(MeasuredSheetTest, LiesThroughTheTrackedVertices) {
  const auto sheet = measuredSheet(measurement_, 1, options());
  ASSERT_TRUE(sheet.ok()) << sheet.error().message();
  EXPECT_TRUE(validateMesh(sheet->mesh).ok());
  EXPECT_TRUE(sheet->mesh.hasUv());
  EXPECT_EQ(sheet->unseen, 0);
  EXPECT_LE(distance_m(*sheet, measurement_.frames[1].positions), 1e-6);
}

TEST_F(MeasuredSheetTest, AveragesTheVerticesNoise) {
  const Points3 truth = measurement_.frames[1].positions;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, kNoise_m);
  for (double& coordinate : measurement_.frames[1].positions.reshaped())
    coordinate += noise(random);
  const auto sheet = measuredSheet(measurement_, 1, options());
  ASSERT_TRUE(sheet.ok()) << sheet.error().message();
  // 1,600 vertices for fewer than 100 free nodes: a quarter of each vertex' error is left.
  EXPECT_LE(distance_m(*sheet, truth), 0.35 * std::sqrt(3.0) * kNoise_m);
}

TEST_F(MeasuredSheetTest, HoldsWhatTheTableCarries) {
  const auto sheet = measuredSheet(measurement_, 1, options());
  ASSERT_TRUE(sheet.ok()) << sheet.error().message();
  ASSERT_FALSE(sheet->held.empty());
  for (const int vertex : sheet->held) {
    EXPECT_LE(sheet->mesh.uv(0, vertex), 0.06 + 1e-9);
    EXPECT_NEAR(sheet->mesh.positions(2, vertex), 0.0, 1e-12);
  }
}

TEST_F(MeasuredSheetTest, CountsWhatNoVertexShows) {
  MeasurementFrame& frame = measurement_.frames[0];
  for (int v = 0; v < measurement_.rest->vertexCount(); ++v)
    if (measurement_.rest->uv(0, v) > 0.08) frame.valid[static_cast<std::size_t>(v)] = 0;
  const auto sheet = measuredSheet(measurement_, 0, options());
  ASSERT_TRUE(sheet.ok()) << sheet.error().message();
  EXPECT_GT(sheet->unseen, 0);
  EXPECT_TRUE(sheet->mesh.positions.allFinite());
}

TEST_F(MeasuredSheetTest, SaysWhatItCannotShow) {
  EXPECT_EQ(measuredSheet(measurement_, 2, options()).error().kind, ErrorKind::kBadInput);
  measurement_.frames[0].valid.assign(measurement_.frames[0].valid.size(), 0);
  EXPECT_NE(measuredSheet(measurement_, 0, options()).error().message().find("no vertex"),
            std::string::npos);
  measurement_.rest.reset();
  EXPECT_NE(measuredSheet(measurement_, 1, options()).error().message().find("tracks no cloth"),
            std::string::npos);
}

}  // namespace
}  // namespace tenter::kinds
