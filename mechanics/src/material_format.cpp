// SPDX-License-Identifier: GPL-3.0-or-later
#include "material_format.h"

#include <algorithm>

namespace tenter {

bool isTabulatedLaw(std::string_view law) {
  return std::find(kTabulatedLaws.begin(), kTabulatedLaws.end(), law) != kTabulatedLaws.end();
}

std::string knownLaws() {
  std::string names;
  for (const ClothModel& model : clothModels()) names.append(model.id).append(" ");
  for (const std::string_view law : kTabulatedLaws) names.append(law).append(" ");
  names.pop_back();
  return names;
}

ComponentInfo componentFormat(const std::string& law, const std::string& name) {
  const Result<const ClothModel*> model = findClothModel(law);
  const int index = model.ok() ? (*model)->componentIndex(name) : -1;
  if (index >= 0) return (*model)->component(index);
  const bool bending = name.starts_with("bend");
  return {.name = name,
          .strain_measure = "as the tables of the law say",
          .strain_unit = bending ? "1/m" : "1",
          .stiffness_unit = bending ? "N m" : "N/m"};
}

const MaterialComponent* Material::find(const std::string& name) const {
  const auto found = std::find_if(components.begin(), components.end(),
                                  [&](const MaterialComponent& c) { return c.name == name; });
  return found == components.end() ? nullptr : &*found;
}

MaterialComponent* Material::find(const std::string& name) {
  const Material& self = *this;
  return const_cast<MaterialComponent*>(self.find(name));
}

}  // namespace tenter
