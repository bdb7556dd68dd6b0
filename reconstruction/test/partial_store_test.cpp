// SPDX-License-Identifier: GPL-3.0-or-later
#include "partial_store.h"

#include <gtest/gtest.h>

#include "tenter/core/files.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

FinishedFrame someFrame() {
  FinishedFrame f;
  f.frame.time_ns = 123;
  f.frame.branch = Branch::kUnloading;
  ClipReading clip;
  clip.clip = "near";
  clip.rig_from_clip.translation() = Vec3(0.1, 0.2, 1.0 / 3.0);
  clip.clamped_vertices = {0, 2};
  clip.outline_uv_m = {{0.0, 0.0}, {0.1, 0.0}, {0.0, 0.1}};
  f.frame.clips.push_back(clip);
  f.frame.cords.push_back({"near/a", "near", Vec3(1.0, 2.0, 3.0), Vec3::UnitY(), 1.5, 0.05});
  f.cloth.positions_m = Points3::Random(3, 3);
  f.cloth.covariances_m2.assign(3, Mat3::Identity() * 1e-10);
  f.cloth.states = {PointState::kValid, PointState::kOutlier, PointState::kOutside};
  f.cloth.views = {4, 0, 0};
  f.cloth.zncc = {0.99F, 0.5F, 0.0F};
  f.cloth.residual_px = {0.01F, 0.0F, 0.0F};
  f.cloth.warnings = {"left: dark"};
  f.seconds = 2.5;
  return f;
}

TEST(PartialStore, GivesBackWhatItKept) {
  const test_support::TemporaryFolder folder;
  const PartialStore store(folder.path() / "p", "run");
  EXPECT_FALSE(store.load(7, 3));
  const FinishedFrame frame = someFrame();
  ASSERT_TRUE(store.save(7, frame).ok());
  const auto back = store.load(7, 3);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->cloth.positions_m, frame.cloth.positions_m);
  EXPECT_EQ(back->cloth.states, frame.cloth.states);
  EXPECT_EQ(back->cloth.covariances_m2, frame.cloth.covariances_m2);
  EXPECT_EQ(back->frame.branch, Branch::kUnloading);
  EXPECT_EQ(back->frame.clips.front().clamped_vertices, frame.frame.clips.front().clamped_vertices);
  EXPECT_EQ(back->frame.clips.front().rig_from_clip.matrix(),
            frame.frame.clips.front().rig_from_clip.matrix());
  EXPECT_EQ(back->frame.cords.front().tension_N, 1.5);
  EXPECT_EQ(back->cloth.warnings, frame.cloth.warnings);
}

TEST(PartialStore, ForgetsAnotherRunAndDamage) {
  const test_support::TemporaryFolder folder;
  const PartialStore store(folder.path() / "p", "run");
  ASSERT_TRUE(store.save(7, someFrame()).ok());
  EXPECT_FALSE(PartialStore(folder.path() / "p", "another run").load(7, 3));
  EXPECT_FALSE(store.load(7, 4));
  const auto file = folder.path() / "p" / "7.frame";
  const std::string bytes = *readFile(file);
  for (const std::size_t length : {std::size_t{0}, bytes.size() / 3, bytes.size() - 1}) {
    ASSERT_TRUE(writeFileAtomically(file, bytes.substr(0, length)).ok());
    EXPECT_FALSE(store.load(7, 3)) << length;
  }
  store.clear();
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "p"));
}

}  // namespace
}  // namespace tenter
