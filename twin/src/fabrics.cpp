// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/fabrics.h"

#include <algorithm>
#include <array>
#include <string>

#include "random_numbers.h"

namespace tenter {
namespace {

constexpr double kScatter = 0.03;
constexpr double kLargestDeviation = 2.5;

// Ratios after [Est12] sec. 6, masses after its Table 1; the absolute numbers are ours
// (docs/twin.md).
Fabric satin() {
  Fabric f{.id = "satin-4", .description = "cotton satin: very stiff in stretch, soft in bending"};
  f.areal_density_kg_per_m2 = 0.12;
  f.thickness_m = 0.25e-3;
  f.membrane = {.base_N_per_m = {9000.0, 9000.0, 36.0},
                .poisson = 0.20,
                .fung_N_per_m = 0.26,
                .fung_exponent = {11400.0, 11400.0, 8.0},
                .fung_cross = 4500.0};
  f.bending = {
      .rigidity_N_m = {5.0e-6, 5.0e-6, 2.5e-6}, .floor = 0.6, .knee_per_m = 120.0, .poisson = 0.15};
  f.friction = {.yield_N_per_m = {9.0, 9.0, 1.2}, .slip_strain = {5e-4, 5e-4, 0.03}};
  f.limits = {.stretch_weft_N = 10.0,
              .stretch_warp_N = 10.0,
              .shear_N = 1.0,
              .complex_shear_N = 1.2,
              .corner_N = 1.5};
  return f;
}

Fabric knit() {
  Fabric f{.id = "knit-12",
           .description = "rayon and spandex knit: nearly linear, isotropic, compliant"};
  f.areal_density_kg_per_m2 = 0.31;
  f.thickness_m = 0.60e-3;
  f.membrane = {.base_N_per_m = {68.0, 68.0, 20.0},
                .poisson = 0.25,
                .fung_N_per_m = 1.0,
                .fung_exponent = {2.5, 2.5, 1.5},
                .fung_cross = 0.8};
  f.bending = {
      .rigidity_N_m = {2.0e-6, 2.0e-6, 0.9e-6}, .floor = 0.8, .knee_per_m = 150.0, .poisson = 0.15};
  f.friction = {.yield_N_per_m = {2.3, 2.3, 0.5}, .slip_strain = {0.02, 0.02, 0.03}};
  f.limits = {.stretch_weft_N = 2.6,
              .stretch_warp_N = 2.6,
              .shear_N = 0.7,
              .complex_shear_N = 0.9,
              .corner_N = 0.8};
  return f;
}

Fabric denim() {
  Fabric f{.id = "denim-14",
           .description =
               "cotton denim: stiff, above all in shear; bending 33 times stiffer along the weft"};
  f.areal_density_kg_per_m2 = 0.46;
  f.thickness_m = 0.90e-3;
  f.membrane = {.base_N_per_m = {4800.0, 5400.0, 360.0},
                .poisson = 0.15,
                .fung_N_per_m = 0.5,
                .fung_exponent = {4000.0, 5000.0, 60.0},
                .fung_cross = 1500.0};
  f.bending = {.rigidity_N_m = {1.32e-4, 4.0e-6, 1.2e-5},
               .floor = 0.55,
               .knee_per_m = 60.0,
               .poisson = 0.10};
  f.friction = {.yield_N_per_m = {9.0, 9.0, 5.0}, .slip_strain = {1e-3, 1e-3, 0.008}};
  f.limits = {.stretch_weft_N = 10.0,
              .stretch_warp_N = 10.0,
              .shear_N = 4.0,
              .complex_shear_N = 3.0,
              .corner_N = 3.0};
  return f;
}

Fabric wool() {
  Fabric f{.id = "wool-18",
           .description = "wool and cotton: 10 times stiffer along the warp, 13 times in bending"};
  f.areal_density_kg_per_m2 = 0.24;
  f.thickness_m = 0.50e-3;
  f.membrane = {.base_N_per_m = {270.0, 5700.0, 14.0},
                .poisson = 0.15,
                .fung_N_per_m = 8.0,
                .fung_exponent = {12.0, 190.0, 2.5},
                .fung_cross = 15.0};
  f.bending = {
      .rigidity_N_m = {2.0e-6, 2.6e-5, 3.6e-6}, .floor = 0.6, .knee_per_m = 90.0, .poisson = 0.10};
  f.friction = {.yield_N_per_m = {8.0, 10.5, 1.2}, .slip_strain = {0.01, 1.5e-3, 0.03}};
  f.limits = {.stretch_weft_N = 10.0,
              .stretch_warp_N = 10.0,
              .shear_N = 1.0,
              .complex_shear_N = 1.2,
              .corner_N = 1.5};
  return f;
}

/// Every constant that a specimen may have its own value of, by name, in the order of the random
/// draws.
template <class FabricType, class Visitor>
void forEachConstant(FabricType& f, Visitor visit) {
  constexpr std::array kStrains{"weft", "warp", "shear"};
  for (int i = 0; i < 3; ++i)
    visit(std::string("membrane.base_N_per_m.") + kStrains[i], f.membrane.base_N_per_m[i]);
  visit("membrane.poisson", f.membrane.poisson);
  visit("membrane.fung_N_per_m", f.membrane.fung_N_per_m);
  for (int i = 0; i < 3; ++i)
    visit(std::string("membrane.fung_exponent.") + kStrains[i], f.membrane.fung_exponent[i]);
  visit("membrane.fung_cross", f.membrane.fung_cross);
  for (int i = 0; i < 3; ++i)
    visit(std::string("bending.rigidity_N_m.") + kStrains[i], f.bending.rigidity_N_m[i]);
  visit("bending.floor", f.bending.floor);
  visit("bending.knee_per_m", f.bending.knee_per_m);
  visit("bending.poisson", f.bending.poisson);
  for (int i = 0; i < 3; ++i)
    visit(std::string("friction.yield_N_per_m.") + kStrains[i], f.friction.yield_N_per_m[i]);
  for (int i = 0; i < 3; ++i)
    visit(std::string("friction.slip_strain.") + kStrains[i], f.friction.slip_strain[i]);
}

}  // namespace

std::span<const Fabric> fabrics() {
  static const std::array kFabrics{satin(), knit(), denim(), wool()};
  return kFabrics;
}

Result<const Fabric*> findFabric(std::string_view id) {
  std::string known;
  for (const Fabric& fabric : fabrics()) {
    if (fabric.id == id) return &fabric;
    known += (known.empty() ? "" : ", ") + std::string(fabric.id);
  }
  return usageError("there is no fabric \"" + std::string(id) + "\"", "fabrics: " + known);
}

Fabric specimenOf(const Fabric& fabric, std::uint64_t specimen) {
  Fabric out = fabric;
  if (specimen == 0) return out;
  RandomNumbers random(specimen, "specimen of " + std::string(fabric.id));
  forEachConstant(out, [&random](const std::string& /*name*/, double& value) {
    value *= 1.0 + kScatter * std::clamp(random.normal(), -kLargestDeviation, kLargestDeviation);
  });
  return out;
}

nlohmann::json fabricToJson(const Fabric& fabric) {
  nlohmann::json json{{"id", fabric.id},
                      {"areal_density_kg_per_m2", fabric.areal_density_kg_per_m2},
                      {"thickness_m", fabric.thickness_m}};
  forEachConstant(fabric,
                  [&json](const std::string& name, const double& value) { json[name] = value; });
  return json;
}

}  // namespace tenter
