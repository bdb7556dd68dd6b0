// SPDX-License-Identifier: GPL-3.0-or-later
// The ratios between fabrics of [Est12] sec. 6, as virtual tests measure them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture_support.h"

namespace tenter {
namespace {

constexpr double kWarp = 0.5 * std::numbers::pi;
/// The paper gives its ratios to one or two digits.
constexpr double kRatioTolerance = 0.15;

/// Largest slope of force per width over strain [N/m] up to 100 N/m, what 10 N on the sample's side
/// are.
double largestStretchStiffness(const char* fabric, double angle_rad) {
  TensileOptions options;
  options.fabric = fabric;
  options.angle_rad = angle_rad;
  options.max_force_N = 2.5;
  options.rows = 12;
  options.scatter = options.noise = false;
  const auto m = captureTensile(options);
  if (!m) throw std::runtime_error(m.error().message());
  double largest = 0.0;
  for (std::size_t i = 1; i < m->frames.size(); ++i) {
    const double force = m->frames[i].force_N - m->frames[i - 1].force_N;
    const double travel = m->frames[i].displacement_m - m->frames[i - 1].displacement_m;
    largest = std::max(largest, force / options.width_m / (travel / options.length_m));
  }
  return largest;
}

/// Curvature stiffness [N m] from the drop of a strip too short to bend far: drop = w L^4 / (8 B).
double shortCantileverRigidity(const char* fabric, double angle_rad, double length_m) {
  CantileverOptions options;
  options.fabric = fabric;
  options.angle_rad = angle_rad;
  options.length_m = length_m;
  options.width_m = 0.01;
  options.scatter = options.noise = false;
  const auto m = captureCantilever(options);
  if (!m) throw std::runtime_error(m.error().message());
  const double weight = m->areal_density_kg_per_m2 * kStandardGravity_m_per_s2;
  return weight * std::pow(length_m, 4) / (8.0 * m->frames[0].drop_m);
}

TEST(FabricRatioTest, SatinStretches250TimesLessThanKnit) {
  const double satin = largestStretchStiffness("satin-4", 0.0),
               knit = largestStretchStiffness("knit-12", 0.0);
  EXPECT_NEAR(satin / knit / 250.0, 1.0, kRatioTolerance);
}

TEST(FabricRatioTest, WoolIsTenTimesStifferAlongTheWarp) {
  const double ratio =
      largestStretchStiffness("wool-18", kWarp) / largestStretchStiffness("wool-18", 0.0);
  EXPECT_NEAR(ratio / 10.0, 1.0, kRatioTolerance);
}

TEST(FabricRatioTest, KnitAndSatinAreIsotropicInStretch) {
  for (const char* fabric : {"satin-4", "knit-12"}) {
    EXPECT_NEAR(largestStretchStiffness(fabric, kWarp) / largestStretchStiffness(fabric, 0.0), 1.0,
                0.05)
        << fabric;
  }
}

TEST(FabricRatioTest, DenimBends33TimesMoreAlongTheWarp) {
  const double weft = shortCantileverRigidity("denim-14", 0.0, 0.025);
  const double warp = shortCantileverRigidity("denim-14", kWarp, 0.010);
  EXPECT_NEAR(weft / warp / 33.0, 1.0, kRatioTolerance);
}

TEST(FabricRatioTest, WoolBends13TimesMoreAlongTheWeft) {
  const double weft = shortCantileverRigidity("wool-18", 0.0, 0.010);
  const double warp = shortCantileverRigidity("wool-18", kWarp, 0.020);
  EXPECT_NEAR(warp / weft / 13.0, 1.0, kRatioTolerance);
}

TEST(FabricRatioTest, DenimIsTenTimesStifferInShearThanAnyOther) {
  double denim = 0.0, other = 0.0;
  for (const Fabric& fabric : fabrics()) {
    const double shear =
        SpecimenMembraneLaw(fabric.membrane).evaluate(Vec3::Zero(), 0).tangent(2, 2);
    (fabric.id == "denim-14" ? denim : other) =
        std::max(fabric.id == "denim-14" ? denim : other, shear);
  }
  EXPECT_NEAR(denim / other / 10.0, 1.0, kRatioTolerance);
}

/// Force at half the extension of the last cycle, loading over unloading.
double hysteresisRatio(const Measurement& m) {
  std::vector<double> extension, force;
  const bool warp = m.protocol == "stretch-warp";
  for (const MeasurementFrame& frame : m.frames) {
    const Vec3 near = warp ? Vec3(0.05, 0.005, 0.0) : Vec3(0.005, 0.05, 0.0);
    const Vec3 far = warp ? Vec3(0.05, 0.095, 0.0) : Vec3(0.095, 0.05, 0.0);
    extension.push_back(
        (frame.clips[1].rig_from_clip * far - frame.clips[0].rig_from_clip * near).norm());
    force.push_back(frame.cords[0].tension_N + frame.cords[1].tension_N);
  }
  const std::size_t low = 2 * (m.frames.size() - 1) / 3, high = 5 * (m.frames.size() - 1) / 6;
  const double middle = 0.5 * (extension[low] + extension[high]);
  const auto crossing = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      if ((extension[i] - middle) * (extension[i + 1] - middle) > 0.0) continue;
      const double t = (middle - extension[i]) / (extension[i + 1] - extension[i]);
      return force[i] + t * (force[i + 1] - force[i]);
    }
    return std::nan("");
  };
  return crossing(low, high) / crossing(high, m.frames.size() - 1);
}

TEST(FabricRatioTest, WithoutFrictionTheCyclesRetraceThemselves) {
  CaptureOptions options = smallCapture("wool-18", "stretch-weft");
  options.frames = 25;
  options.noise = options.friction = false;
  EXPECT_NEAR(hysteresisRatio(captured(options).measurement), 1.0, 0.01);
}

TEST(FabricRatioTest, LoadingIsStifferThanUnloading) {
  for (const Fabric& fabric : fabrics()) {
    for (const char* protocol : {"stretch-weft", "stretch-warp"}) {
      CaptureOptions options = smallCapture(fabric.id, protocol);
      options.nodes = 15;
      options.frames = 25;
      options.scatter = options.noise = false;
      const double ratio = hysteresisRatio(captured(options).measurement);
      EXPECT_GE(ratio, 1.4) << fabric.id << ' ' << protocol;
      EXPECT_LE(ratio, 1.8) << fabric.id << ' ' << protocol;
    }
  }
}

}  // namespace
}  // namespace tenter
