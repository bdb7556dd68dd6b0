// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/fitting/import.h"

namespace tenter::import {

/// Whether a specimen's numbers are those of cloth.
Result<void> checkSpecimen(const SpecimenInfo& info);

/// A measurement with what a person said of its specimen.
Measurement measurementOf(const SpecimenInfo& info, const std::string& protocol);

}  // namespace tenter::import
