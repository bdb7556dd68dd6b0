// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "tenter/fitting/fit.h"

namespace tenter {

/// A material as a parameter set: its curves, with the bases behind them where it holds their
/// coefficients. Nothing for laws that are no curves (imported tables). Error when a component is
/// missing or does not fit its law.
Result<std::optional<ParameterSet>> parametersOf(const Material& material, const ClothModel& model);

/// The file's covariance over all coefficients of a parameter set, tied components (isotropic
/// variants, assumptions) included; empty when the material has none.
Eigen::MatrixXd coefficientCovariance(const Material& material, const ParameterSet& parameters);

/// The laws that met the fit's data about as well: material.fit["law_uncertainty"].
Result<std::vector<Material>> alternativeLaws(const Material& material);

/// Residual that the fit left on tests of the same protocol, of their largest force; 0 if there was
/// none.
double comparableResidual(const Material& material, const std::string& protocol);

}  // namespace tenter
