// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/fitting/fit.h"

namespace tenter {

Result<FitVariant> parseVariant(const std::string& name) {
  for (const bool linear : {false, true})
    for (const bool isotropic : {false, true}) {
      const FitVariant variant{.linear = linear, .isotropic = isotropic};
      if (variantName(variant) == name) return variant;
    }
  return usageError(std::string("no variant is called '").append(name).append("'"),
                    "there are: linear isotropic linear-isotropic orthotropic");
}

std::string variantName(FitVariant variant) {
  if (variant.linear && variant.isotropic) return "linear-isotropic";
  if (variant.linear) return "linear";
  return variant.isotropic ? "isotropic" : "orthotropic";
}

}  // namespace tenter
