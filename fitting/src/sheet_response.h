// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tenter/mechanics/cloth_models.h"

namespace tenter {

/// What a material answers to homogeneous strain and to cylindrical bending, whichever way its law
/// measures strain. Stress is second Piola-Kirchhoff, conjugate to Green strain (E_uu, E_vv, 2
/// E_uv).
class SheetResponse {
 public:
  /// Error for laws whose constants belong to one mesh; springs bend only at a known edge length.
  static Result<SheetResponse> create(const Material& material, std::optional<double> edge_m);

  Vec3 membraneStress(const Vec3& green) const;  ///< [N/m].
  /// Moment per width [N] of a cylinder of this curvature, its bent fibres at an angle from weft.
  double cylinderMoment(double angle_rad, double curvature_per_m) const;
  bool bends() const { return bends_; }

  /// Green strain of one component alone, at a strain as the law measures it.
  Vec3 greenOf(int component, double strain) const;
  /// Measured strains of a component of the material, or a stated default.
  struct Window {
    double min = 0.0, max = 0.0;
    bool measured = false;
  };
  Window window(const std::string& component) const;

  /// Sample strains of the three membrane components: points of each window without zero.
  struct Sample {
    int component;
    double strain;
    Vec3 green, stress;
  };
  std::vector<Sample> membraneSamples() const;
  /// Curvatures of a bending component's window, zero left out.
  std::vector<double> curvatures(const std::string& component) const;

  const Material& material() const { return material_; }

 private:
  explicit SheetResponse(Material material) : material_(std::move(material)) {}
  Vec3 lawStrain(const Vec3& green, Mat3* by_green) const;
  Vec3 springStress(const Vec3& green) const;

  Material material_;
  MembraneElement membrane_ = MembraneElement::kStvk;
  ClothLaws laws_;
  double edge_m_ = 0.0;
  bool springs_ = false, bends_ = false;
};

/// Names of the components that every exportable law has.
inline constexpr const char* kMembraneNames[] = {"stretch_weft", "stretch_warp", "shear"};
inline constexpr const char* kBendNames[] = {"bend_weft", "bend_warp"};

}  // namespace tenter
