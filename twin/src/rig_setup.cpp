// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_setup.h"

#include <cmath>
#include <functional>
#include <map>

namespace tenter {
namespace {

constexpr double kSide = kSampleSide_m;
constexpr double kBarDepth_m = 0.005;  // cloth that a bar covers, across
constexpr double kFrameGap_m = 0.010;  // corner that the picture frame leaves free
constexpr double kCornerClip_m = 0.010;
constexpr double kLightBar_kg = 0.0101, kHeavyBar_kg = 0.0133, kCornerMass_kg = 0.0019;
constexpr double kReach_m = 0.12;         // clip to pulley at rest
constexpr double kPulleyHeight_m = 0.02;  // so that slack cords lift the clips' weight
constexpr double kTensionSpring_N_per_m =
    500.0;  // in every cord: forces then follow actuators smoothly
constexpr double kHomeSlack_m = 0.004, kHomeTension_N = 0.1;
constexpr double kHoldStretch_m = 0.04;  // in cords that only keep the sheet taut

struct CordPlan {
  const char* name;
  Vec2 attachment_m, direction;
  double tension_N, spring_N_per_m;
  int channel;
};

RigCord strung(const std::string& clip, const CordPlan& plan) {
  RigCord out{clip + "/" + plan.name, {}, plan.channel, 0.0};
  out.cord.attachment_m = {plan.attachment_m.x(), plan.attachment_m.y(), 0.0};
  const Vec2 reach = kReach_m * plan.direction.normalized();
  out.cord.pulley_m = out.cord.attachment_m + Vec3(reach.x(), reach.y(), kPulleyHeight_m);
  const double length = (out.cord.pulley_m - out.cord.attachment_m).norm();
  out.cord.rest_length_m = length - plan.tension_N / plan.spring_N_per_m;
  out.cord.stiffness_N = plan.spring_N_per_m * out.cord.rest_length_m;
  out.slack_m = std::max(kHomeSlack_m, (plan.tension_N - kHomeTension_N) / plan.spring_N_per_m);
  return out;
}

RigClip clipped(const std::string& id, const char* shape, double mass_kg, Vec2 low, Vec2 high,
                const std::vector<CordPlan>& cords) {
  RigClip out{id, shape, mass_kg, Eigen::AlignedBox2d(low, high), {}};
  for (const CordPlan& cord : cords) out.cords.push_back(strung(id, cord));
  return out;
}

/// 0 to 1 and back, `cycles` times, over `frames` steps.
void addCycles(RigSetup& rig, int channel, int cycles, double low_N, double high_N, int frames,
               bool with_start) {
  const int intervals = with_start ? frames - 1 : frames;
  for (int i = 0; i < frames; ++i) {
    const double position =
        intervals > 0 ? (with_start ? i : i + 1) * (2.0 * cycles) / intervals : 0.0;
    const int half = std::max(0, static_cast<int>(std::ceil(position - 1e-9)) - 1);
    const double within = position - half;
    const double level = half % 2 == 0 ? within : 1.0 - within;
    rig.steps.push_back({channel, low_N + level * (high_N - low_N),
                         half % 2 == 0 ? Branch::kLoading : Branch::kUnloading});
  }
}

RigSetup stretchRig(const Fabric& fabric, int axis, int frames) {
  const double limit = axis == 0 ? fabric.limits.stretch_weft_N : fabric.limits.stretch_warp_N;
  const double pretension = std::min(1.0, 0.15 * limit);
  // Written for the weft; the warp test has the axes exchanged.
  const auto turned = [axis](double x, double y) { return axis == 0 ? Vec2(x, y) : Vec2(y, x); };
  RigSetup rig;
  for (const bool far : {false, true}) {
    const double edge = far ? kSide : 0.0, out = far ? 1.0 : -1.0;
    const double inner = edge - out * kBarDepth_m;
    std::vector<CordPlan> cords;
    for (const bool upper : {false, true}) {
      cords.push_back({upper ? "b" : "a", turned(edge + out * 0.008, upper ? 0.08 : 0.02),
                       turned(out, 0.0), 0.5 * pretension, kTensionSpring_N_per_m, 0});
    }
    rig.clips.push_back(clipped(far ? "far" : "near", "bar", kLightBar_kg,
                                turned(std::min(edge, inner), 0.0),
                                turned(std::max(edge, inner), kSide), cords));
  }
  addCycles(rig, 0, 3, 0.5 * pretension, 0.5 * limit, frames, true);
  return rig;
}

RigSetup shearRig(const Fabric& fabric, int frames) {
  constexpr double kTilt = 0.15;  // outwards, so that pulling also keeps the sheet taut
  // More than the pull: the sheet then has no compression to buckle under.
  const double hold = 1.2 * fabric.limits.shear_N, pretension = 0.1;
  // The clip of the side y = kSide, pulled towards its end at x = kSide; `turned` makes the other
  // three.
  const auto clip = [&](const char* id, const std::function<Vec2(double, double)>& turned) {
    const Vec2 a = turned(kFrameGap_m, kSide - kBarDepth_m), b = turned(kSide - kFrameGap_m, kSide);
    const Vec2 origin = turned(0.0, 0.0);
    return clipped(id, "bar", kLightBar_kg, a.cwiseMin(b), a.cwiseMax(b),
                   {{"pull", turned(kSide - 0.005, kSide), turned(1.0, kTilt) - origin, pretension,
                     kTensionSpring_N_per_m, 0},
                    {"hold", turned(0.5 * kSide, kSide + 0.004), turned(0.0, 1.0) - origin, hold,
                     hold / kHoldStretch_m, -1}});
  };
  RigSetup rig;
  rig.clips.push_back(clip("top", [](double x, double y) { return Vec2(x, y); }));
  rig.clips.push_back(clip("right", [](double x, double y) { return Vec2(y, x); }));
  rig.clips.push_back(
      clip("bottom", [](double x, double y) { return Vec2(kSide - x, kSide - y); }));
  rig.clips.push_back(clip("left", [](double x, double y) { return Vec2(kSide - y, kSide - x); }));
  addCycles(rig, 0, 2, pretension, fabric.limits.shear_N, frames, true);
  return rig;
}

RigSetup complexShearRig(const Fabric& fabric, int frames) {
  constexpr double kTilt = 0.36;  // 20 degrees: lessens the couple that the hold cords must carry
  const double pull = fabric.limits.complex_shear_N, pretension = 0.1;
  const double hold = std::max(0.5, 0.7 * pull);
  const auto clip = [&](const char* id, const std::function<Vec2(double, double)>& turned) {
    const Vec2 a = turned(0.0, kSide - kBarDepth_m), b = turned(kSide, kSide);
    const Vec2 origin = turned(0.0, 0.0);
    const Vec2 outwards = turned(0.0, 1.0) - origin;
    return clipped(
        id, "bar", kHeavyBar_kg, a.cwiseMin(b), a.cwiseMax(b),
        {{"pull", turned(kSide + 0.004, kSide), turned(1.0, kTilt) - origin, pretension,
          kTensionSpring_N_per_m, 0},
         {"lead", turned(0.085, kSide + 0.008), outwards, hold, kTensionSpring_N_per_m, -1},
         {"trail", turned(0.015, kSide + 0.008), outwards, hold, kTensionSpring_N_per_m, -1}});
  };
  RigSetup rig;
  rig.clips.push_back(clip("top", [](double x, double y) { return Vec2(x, y); }));
  rig.clips.push_back(
      clip("bottom", [](double x, double y) { return Vec2(kSide - x, kSide - y); }));
  addCycles(rig, 0, 1, pretension, pull, frames, true);
  return rig;
}

RigSetup cornerRig(const Fabric& fabric, int frames) {
  const double limit = fabric.limits.corner_N, pretension = std::min(0.3, 0.25 * limit);
  RigSetup rig;
  for (const bool right : {false, true}) {
    for (const bool top : {false, true}) {
      const Vec2 corner(right ? kSide : 0.0, top ? kSide : 0.0),
          out(right ? 1.0 : -1.0, top ? 1.0 : -1.0);
      const Vec2 inner = corner - kCornerClip_m * out;
      const std::string id = std::string(right ? "right" : "left") + (top ? "-top" : "-bottom");
      rig.clips.push_back(clipped(id, "corner", kCornerMass_kg, corner.cwiseMin(inner),
                                  corner.cwiseMax(inner),
                                  {{"pull", corner + 0.003 * out, out, pretension,
                                    kTensionSpring_N_per_m, right == top ? 0 : 1}}));
    }
  }
  const int first = (frames + 1) / 2;
  addCycles(rig, 0, 1, pretension, limit, first, true);
  addCycles(rig, 1, 1, pretension, limit, frames - first, false);
  return rig;
}

}  // namespace

std::vector<CordPlace> actuatorOrder(const RigSetup& rig) {
  std::vector<CordPlace> order;
  for (const int channel : {0, 1, -1}) {
    for (std::size_t c = 0; c < rig.clips.size(); ++c) {
      for (std::size_t k = 0; k < rig.clips[c].cords.size(); ++k) {
        if (rig.clips[c].cords[k].channel != channel) continue;
        order.push_back({static_cast<int>(c), static_cast<int>(k)});
      }
    }
  }
  return order;
}

SheetShape flatSample() {
  const std::vector<double> ends = {0.0, 0.5 * kSampleSide_m, kSampleSide_m};
  SheetShape shape{{ends, ends}, {}, {}, {}, {}};
  shape.nodes = gridSheet(shape.lines).rest.positions;
  return shape;
}

std::string axisName(int axis) { return "axis-" + std::to_string(axis + 1); }
std::string cellName(int axis) { return "cell-" + std::to_string(axis + 1); }

RigSetup makeRig(std::string_view protocol, const Fabric& fabric, int frames) {
  using Maker = std::function<RigSetup(const Fabric&, int)>;
  static const std::map<std::string_view, Maker> kMakers{
      {"stretch-weft", [](const Fabric& f, int n) { return stretchRig(f, 0, n); }},
      {"stretch-warp", [](const Fabric& f, int n) { return stretchRig(f, 1, n); }},
      {"shear", shearRig},
      {"complex-shear", complexShearRig},
      {"corner-pull", cornerRig}};
  const auto maker = kMakers.find(protocol);
  require(maker != kMakers.end(), "makeRig: protocol without cords");
  return maker->second(fabric, frames);
}

}  // namespace tenter
