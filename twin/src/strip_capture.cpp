// SPDX-License-Identifier: GPL-3.0-or-later
// Strips in a tensile machine and strips that hang from a clamp.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "random_numbers.h"
#include "tenter/twin/capture.h"
#include "virtual_cloth.h"

namespace tenter {
namespace {

constexpr double kCell_N = 3e-3;
constexpr double kTip_m = 0.2e-3;
constexpr int kNodesAcross = 9;
constexpr std::int64_t kRowInterval_ns = 1'000'000'000;
constexpr int kSearches = 40;

std::vector<double> evenLines(double length, double mesh_m) {
  return linesThrough(0.0, length,
                      std::clamp(static_cast<int>(std::lround(length / mesh_m)) + 1, 5, 400), {});
}

SheetMesh strip(double length, double width, double angle_rad) {
  const double mesh_m = width / (kNodesAcross - 1);
  SheetMesh sheet = gridSheet(
      {evenLines(length, mesh_m), evenLines(width, mesh_m), DiagonalPattern::kAlternating});
  turnMaterial(sheet, angle_rad);
  return sheet;
}

std::vector<int> nodesFrom(const SheetMesh& sheet, double low, double high) {
  std::vector<int> ids;
  for (int n = 0; n < sheet.nodeCount(); ++n) {
    const double x = sheet.rest.positions(0, n);
    if (x >= low - 1e-9 && x <= high + 1e-9) ids.push_back(n);
  }
  return ids;
}

struct StripSpecimen {
  Fabric fabric;
  ClothSource cloth;
  std::uint64_t number;
};

Result<StripSpecimen> stripSpecimen(const std::string& id, std::uint64_t seed,
                                    std::uint64_t specimen, bool scatter) {
  const auto fabric = findFabric(id);
  if (!fabric) return fabric.error();
  StripSpecimen out;
  out.number = specimen != 0 ? specimen : seed;
  out.fabric = specimenOf(**fabric, scatter ? out.number : 0);
  auto cloth = makeClothSource(out.fabric, std::nullopt);
  if (!cloth) return cloth.error();
  out.cloth = *cloth;
  return out;
}

Measurement stripMeasurement(const StripSpecimen& specimen, const char* protocol,
                             double angle_rad) {
  Measurement m;
  m.fabric = specimen.fabric.id;
  m.specimen = m.fabric + "/" + std::to_string(specimen.number);
  m.protocol = protocol;
  m.name = m.fabric + "-" + protocol + "-" +
           std::to_string(std::lround(angle_rad * 180.0 / std::numbers::pi));
  m.areal_density_kg_per_m2 = specimen.fabric.areal_density_kg_per_m2;
  m.thickness_m = specimen.fabric.thickness_m;
  return m;
}

/// A flat strip between a still clamp and one that moves.
class PulledStrip {
 public:
  static Result<PulledStrip> create(const ClothSource& cloth, const TensileOptions& o,
                                    double areal_density) {
    SheetMesh sheet = strip(o.length_m, o.width_m, o.angle_rad);
    SystemSetup setup;
    setup.areal_density_kg_per_m2 = areal_density;
    setup.gravity_m_per_s2 = Vec3::Zero();
    setup.planar = true;
    setup.clips.resize(2);
    setup.clips[0].id = "still";
    setup.clips[0].nodes = nodesFrom(sheet, 0.0, 0.0);
    setup.clips[1].id = "moving";
    setup.clips[1].nodes = nodesFrom(sheet, o.length_m, o.length_m);
    auto system =
        ClothSystem::create(std::move(sheet), *cloth.model, {cloth.membrane, cloth.bending}, setup);
    if (!system) return system.error();
    return PulledStrip(std::move(*system), o.length_m);
  }

  /// Force [N] at a travel of the clamp; every solve starts from the rest shape stretched evenly,
  /// so that rows do not depend on their order.
  Result<double> force(double travel_m) {
    ClothState state = system_->restState();
    for (int n = 0; n < system_->sheet().nodeCount(); ++n)
      state.q[3 * n] *= 1.0 + travel_m / length_m_;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation().x() = travel_m;
    system_->setClipPose(state, 1, pose);
    CaptureStatistics unused;
    EquilibriumSolver solver(*system_);
    if (!findStableShape(solver, state, unused)) {
      return notConverged("the virtual strip found no equilibrium at a travel of " +
                          std::to_string(travel_m) + " m");
    }
    return -system_->clipWrench(state, 1).force_N.x();
  }

 private:
  PulledStrip(ClothSystem system, double length_m)
      : system_(std::make_unique<ClothSystem>(std::move(system))), length_m_(length_m) {}
  std::unique_ptr<ClothSystem> system_;
  double length_m_;
};

/// Travel at which the force or the strain limit is met.
Result<double> longestTravel(PulledStrip& strip, const TensileOptions& o) {
  double low = 0.0, high = 1e-4 * o.length_m;
  const double limit = o.max_strain * o.length_m;
  for (;;) {
    high = std::min(high, limit);
    const auto force = strip.force(high);
    if (!force) return force;
    if (*force >= o.max_force_N) break;
    if (high >= limit) return limit;
    low = high;
    high *= 2.0;
  }
  for (int k = 0; k < kSearches && high - low > 1e-3 * high; ++k) {
    const double middle = 0.5 * (low + high);
    const auto force = strip.force(middle);
    if (!force) return force;
    (*force < o.max_force_N ? low : high) = middle;
  }
  return low;
}

}  // namespace

Result<Measurement> captureTensile(const TensileOptions& o) {
  if (!(o.length_m >= 0.02 && o.length_m <= 1.0 && o.width_m >= 0.002 && o.width_m <= o.length_m)) {
    return usageError(
        "a tensile strip is 20 mm to 1 m long, at least 2 mm wide and not wider than long");
  }
  if (o.rows < 3 || o.rows > 10'000 || !(o.max_force_N > 0.0) ||
      !(o.max_strain > 0.0 && o.max_strain < 1.0)) {
    return usageError("a tensile test has 3 to 10000 rows and positive limits, the strain below 1");
  }
  const auto specimen = stripSpecimen(o.fabric, o.seed, o.specimen, o.scatter);
  if (!specimen) return specimen.error();
  auto strip = PulledStrip::create(specimen->cloth, o, specimen->fabric.areal_density_kg_per_m2);
  if (!strip) return strip.error();
  const auto longest = longestTravel(*strip, o);
  if (!longest) return longest.error();

  Measurement m = stripMeasurement(*specimen, "tensile", o.angle_rad);
  m.tensile.emplace();
  m.tensile->length_m = o.length_m;
  m.tensile->width_m = o.width_m;
  m.tensile->angle_rad = o.angle_rad;
  m.tensile->zero_strain_rule = "given";
  RandomNumbers random(o.seed, "tensile " + m.name);
  for (int row = 0; row < o.rows; ++row) {
    MeasurementFrame frame;
    frame.time_ns = row * kRowInterval_ns;
    frame.branch = Branch::kLoading;
    frame.displacement_m = *longest * row / (o.rows - 1);
    const auto force = strip->force(frame.displacement_m);
    if (!force) return force.error();
    frame.force_N = *force + (o.noise ? kCell_N * random.normal() : 0.0);
    frame.force_sigma_N = kCell_N;
    m.frames.push_back(std::move(frame));
  }
  return m;
}

Result<Measurement> captureCantilever(const CantileverOptions& o) {
  if (!(o.length_m >= 0.01 && o.length_m <= 0.5 && o.width_m >= 0.002 && o.width_m <= o.length_m)) {
    return usageError(
        "a cantilever strip is 10 mm to 0.5 m long, at least 2 mm wide and not wider than long");
  }
  const auto specimen = stripSpecimen(o.fabric, o.seed, o.specimen, o.scatter);
  if (!specimen) return specimen.error();
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = specimen->fabric.areal_density_kg_per_m2;
  setup.clips.resize(1);
  setup.clips[0].id = "clamp";
  // One column of quads inside the clamp: it holds the slope there at zero.
  const double mesh_m = o.width_m / (kNodesAcross - 1);
  SheetMesh sheet =
      gridSheet({linesThrough(-mesh_m, o.length_m,
                              static_cast<int>(std::lround(o.length_m / mesh_m)) + 2, {0.0}),
                 evenLines(o.width_m, mesh_m), DiagonalPattern::kAlternating});
  turnMaterial(sheet, o.angle_rad);
  setup.clips[0].nodes = nodesFrom(sheet, -mesh_m, 0.0);
  const std::vector<int> tip = nodesFrom(sheet, o.length_m, o.length_m);
  const ClothSource& cloth = specimen->cloth;
  auto system =
      ClothSystem::create(std::move(sheet), *cloth.model, {cloth.membrane, cloth.bending}, setup);
  if (!system) return system.error();
  ClothState state = system->restState();
  for (int n = 0; n < system->sheet().nodeCount(); ++n) {
    const double x = std::max(0.0, state.q[3 * n]);
    state.q[3 * n + 2] = -x * x;
  }
  system->setClipPose(state, 0, Eigen::Isometry3d::Identity());
  CaptureStatistics unused;
  EquilibriumSolver solver(*system);
  if (!findStableShape(solver, state, unused))
    return notConverged("the virtual cantilever found no stable equilibrium");

  Measurement m = stripMeasurement(*specimen, "cantilever", o.angle_rad);
  m.cantilever = CantileverSetup{o.length_m, o.width_m, o.angle_rad};
  Vec3 mean = Vec3::Zero();
  for (const int n : tip) mean += state.q.segment<3>(3 * n) / static_cast<double>(tip.size());
  RandomNumbers random(o.seed, "cantilever " + m.name);
  MeasurementFrame frame;
  frame.branch = Branch::kLoading;
  frame.reach_m = mean.x() + (o.noise ? kTip_m * random.normal() : 0.0);
  frame.drop_m = -mean.z() + (o.noise ? kTip_m * random.normal() : 0.0);
  frame.tip_sigma_m = kTip_m;
  m.frames.push_back(std::move(frame));
  return m;
}

}  // namespace tenter
