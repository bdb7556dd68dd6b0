// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/fitting/export.h"

namespace tenter {

/// One a file; the table in export.cpp lists them.
ExportTarget arcsimExport();
ExportTarget blenderExport();
ExportTarget newtonExport();
ExportTarget csvExport();

/// Every text file that an export writes says so with this.
inline constexpr std::string_view kGenerator = "tenter";

}  // namespace tenter
