// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit_roles.h"
#include "tenter/core/measurement.h"

namespace tenter {

/// Secant membrane stiffness of a measurement: largest force over width and strain there [N/m]; 0
/// without forces.
double secantStiffness_N_per_m(const Measurement& measurement);

/// Bending rigidity at which a strip of the measurement's length bends visibly: areal weight *
/// length^3 / Gamma, Gamma = 10 [N m].
double visibleRigidity_N_m(const Measurement& measurement);

/// Sets every group to one constant from the data alone, good to a decade or two.
void setInitialGuesses(FitState& state, const std::vector<const Measurement*>& measurements,
                       const std::vector<TestRole>& roles);

}  // namespace tenter
