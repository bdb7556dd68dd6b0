// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/cloth_models.h"

#include <algorithm>
#include <array>
#include <utility>

#include "model_rows.h"

namespace tenter {
namespace {

constexpr std::size_t kDiagonalComponents = 3;

constexpr ComponentInfo kHingeBending[] = {
    {.name = "bend_weft",
     .strain_measure = "curvature kappa_uu of the weft",
     .strain_unit = "1/m",
     .stiffness_unit = "N m",
     .even = true},
    {.name = "bend_warp",
     .strain_measure = "curvature kappa_vv of the warp",
     .strain_unit = "1/m",
     .stiffness_unit = "N m",
     .even = true},
    {.name = "bend_diagonal",
     .strain_measure = "twice the twist, 2 kappa_uv",
     .strain_unit = "1/m",
     .stiffness_unit = "N m",
     .even = true},
};

DiagonalLaw diagonalLaw(std::span<const ComponentCurve> components) {
  std::array<StiffnessCurve, kDiagonalComponents> curves{
      StiffnessCurve::constant(0.0), StiffnessCurve::constant(0.0), StiffnessCurve::constant(0.0)};
  std::array<std::shared_ptr<const SplineBasis>, kDiagonalComponents> bases;
  for (std::size_t i = 0; i < std::min(components.size(), kDiagonalComponents); ++i) {
    curves[i] = components[i].curve;
    bases[i] = components[i].basis;
  }
  return {std::move(curves), std::move(bases)};
}

/// A component of the file that can stand for this row of the registry.
Result<void> checkComponent(const ComponentInfo& info, const MaterialComponent& component) {
  const StiffnessCurve& curve = component.curve;
  const std::string place = "component " + component.name;
  if (info.constant_only && curve.knotCount() > 1)
    return badInput("", place, "is a single number in this law, but has several knots");
  if (curve.knotCount() > 1 && curve.even() != info.even)
    return badInput(
        "", place,
        info.even ? "must be an even curve in this law" : "must not be an even curve in this law");
  return {};
}

}  // namespace

std::span<const ComponentInfo> hingeBendingComponents() { return kHingeBending; }

std::shared_ptr<StrainLaw> makeDiagonalLaw(std::span<const ComponentCurve> components) {
  return std::make_shared<DiagonalLaw>(diagonalLaw(components));
}

std::shared_ptr<StrainLaw> makeCoupledLaw(std::span<const ComponentCurve> components) {
  const ComponentCurve& poisson = components[kDiagonalComponents];
  const ComponentCurve& cross = components[kDiagonalComponents + 1];
  return std::make_shared<CoupledLaw>(diagonalLaw(components), poisson.curve.stiffnesses().front(),
                                      cross.curve.stiffnesses().front(), poisson.basis != nullptr,
                                      cross.basis != nullptr);
}

std::span<const ClothModel> clothModels() {
  static const std::array kModels = {
      springsModel(), softModel(), stvkModel(), coupledStvkModel(), edgeHingeModel(),
  };
  return kModels;
}

Result<const ClothModel*> findClothModel(std::string_view id) {
  std::string known;
  for (const ClothModel& model : clothModels()) {
    if (model.id == id) return &model;
    known.append(known.empty() ? "" : " ").append(model.id);
  }
  return usageError("no cloth model is called '" + std::string(id) + "'", "there are: " + known);
}

int ClothModel::componentCount() const {
  return static_cast<int>(membrane_components.size() + bending_components.size());
}

const ComponentInfo& ClothModel::component(int index) const {
  require(index >= 0 && index < componentCount(), "no such component");
  const int membrane_count = static_cast<int>(membrane_components.size());
  return index < membrane_count ? membrane_components[index]
                                : bending_components[index - membrane_count];
}

int ClothModel::componentIndex(std::string_view name) const {
  for (int i = 0; i < componentCount(); ++i)
    if (component(i).name == name) return i;
  return -1;
}

ClothLaws makeLaws(const ClothModel& model, const std::vector<ComponentCurve>& components) {
  require(static_cast<int>(components.size()) == model.componentCount(),
          "a law takes one curve for each of its components");
  const std::span all(components);
  const std::size_t membrane_count = model.membrane_components.size();
  return {model.membrane_law(all.first(membrane_count)),
          model.bending_law(all.subspan(membrane_count))};
}

Result<ClothLaws> makeLaws(const ClothModel& model, const Material& material) {
  if (material.law != model.id)
    return badInput("", "law", "is '" + material.law + "', not '" + std::string(model.id) + "'");
  std::vector<ComponentCurve> curves(model.componentCount());
  std::vector<bool> seen(model.componentCount(), false);
  for (const MaterialComponent& component : material.components) {
    const int index = model.componentIndex(component.name);
    if (index < 0)
      return badInput("", "component " + component.name, "is unknown to law " + material.law);
    if (seen[index]) return badInput("", "component " + component.name, "appears twice");
    if (const Result<void> fits = checkComponent(model.component(index), component); !fits.ok())
      return fits.error();
    seen[index] = true;
    curves[index].curve = component.curve;
  }
  for (int i = 0; i < model.componentCount(); ++i)
    if (!seen[i])
      return badInput("", "components",
                      "component " + std::string(model.component(i).name) + " of law " +
                          material.law + " is missing");
  return makeLaws(model, curves);
}

}  // namespace tenter
