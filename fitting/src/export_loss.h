// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "sheet_response.h"
#include "tenter/fitting/export.h"

namespace tenter {

using StressFunction = std::function<Vec3(const Vec3& green)>;
/// Moment per width [N] with bent fibres at an angle from weft.
using MomentFunction = std::function<double(double angle_rad, double curvature_per_m)>;

/// Fills the error figures of an export: the target's own stress and moment against the
/// material's, over the measured strains.
void setErrors(ExportedMaterial& exported, const SheetResponse& response,
               const StressFunction& stress, const MomentFunction& moment);

/// Constant c that minimises the sum of (c shape_i / value_i - 1)^2: the best linear stiffness in
/// the sense of the relative error. `shape` is the target's stress for c = 1.
double bestConstant(const std::vector<double>& shape, const std::vector<double>& value);

/// What every export without curves beyond the measured strains says.
void noteWindow(ExportedMaterial& exported, const SheetResponse& response);

}  // namespace tenter
