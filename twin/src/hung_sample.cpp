// SPDX-License-Identifier: GPL-3.0-or-later
#include "hung_sample.h"

#include <algorithm>

#include "random_numbers.h"

namespace tenter {
namespace {

constexpr double kDisturbance_m = 1e-6;  // far below any noise; breaks the symmetry of flat sheets
constexpr double kSameLine_m = 1e-9;
constexpr double kShortestCord_m = 1e-3;

}  // namespace

std::vector<int> heldBy(const Eigen::AlignedBox2d& area, const Points3& rest) {
  const Eigen::AlignedBox2d reach(area.min() - Vec2::Constant(kSameLine_m),
                                  area.max() + Vec2::Constant(kSameLine_m));
  std::vector<int> ids;
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    if (reach.contains(Vec2(rest.col(i).head<2>()))) ids.push_back(static_cast<int>(i));
  }
  return ids;
}

HungSample::HungSample(const CaptureOptions& options, const Fabric& specimen,
                       const ClothSource& cloth)
    : rig_(makeRig(options.protocol, specimen, options.frames)),
      cloth_(cloth),
      seed_(options.seed),
      protocol_(options.protocol),
      areal_density_(specimen.areal_density_kg_per_m2) {
  for (int axis = 0; axis < 2; ++axis) {
    for (const RigClip& clip : rig_.clips) {
      stops_[axis].push_back(clip.area_m.min()[axis]);
      stops_[axis].push_back(clip.area_m.max()[axis]);
    }
  }
  lines_ = {linesThrough(0.0, kSampleSide_m, options.nodes, stops_[0]),
            linesThrough(0.0, kSampleSide_m, options.nodes, stops_[1]), options.diagonals};
  if (options.friction && !cloth.own) {
    friction_ = std::make_shared<FrictionalLaw>(cloth.membrane, specimen.friction,
                                                2 * (options.nodes + 8) * (options.nodes + 8));
  }
}

Result<void> HungSample::build() {
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = areal_density_;
  SheetMesh sheet = sampleSheet(lines_, false);
  for (const RigClip& clip : rig_.clips) {
    ClipSetup held;
    held.id = clip.id;
    held.nodes = heldBy(clip.area_m, sheet.rest.positions);
    held.free = true;
    held.mass_kg = clip.mass_kg;
    const Vec2 centre = clip.area_m.center();
    held.centre_of_mass_m = {centre.x(), centre.y(), 0.0};
    for (const RigCord& cord : clip.cords) held.cords.push_back(cord.cord);
    setup.clips.push_back(held);
  }
  const ClothLaws laws{friction_ ? friction_ : cloth_.membrane, cloth_.bending};
  auto system = ClothSystem::create(std::move(sheet), *cloth_.model, laws, std::move(setup));
  if (!system) return system.error();
  system_.emplace(std::move(*system));
  solver_.emplace(*system_);
  state_ = system_->restState();
  disturb();
  return {};
}

void HungSample::disturb() {
  RandomNumbers random(seed_, "disturbance " + protocol_);
  std::vector<bool> held(static_cast<std::size_t>(system_->sheet().nodeCount()), false);
  for (const ClipSetup& clip : system_->setup().clips) {
    for (const int n : clip.nodes) held[n] = true;
  }
  for (int n = 0; n < system_->sheet().nodeCount(); ++n) {
    const double z = kDisturbance_m * random.normal();
    if (!held[n]) state_.q[3 * n + 2] += z;
  }
}

void HungSample::draw(int clip, int cord, double drawn_m) {
  const double length_m = rig_.clips[clip].cords[cord].cord.rest_length_m - drawn_m;
  system_->setCordRestLength(clip, cord, std::max(length_m, kShortestCord_m));
}

bool HungSample::solve(CaptureStatistics& statistics, const std::function<bool()>& cancelled) {
  return findStableShape(*solver_, state_, statistics, cancelled);
}

void HungSample::commit() {
  if (!friction_) return;
  const Eigen::Matrix3Xd strains =
      greenStrains(system_->sheet(), state_.positions(system_->sheet().nodeCount()));
  for (Eigen::Index t = 0; t < strains.cols(); ++t)
    friction_->commit(strains.col(t), static_cast<int>(t));
}

}  // namespace tenter
