// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/session_export.h"

#include <algorithm>
#include <array>
#include <string>

namespace tenter {

std::span<const SessionExport> sessionExports() {
  static constexpr std::array kRows = {
      SessionExport{"hdf5", "HDF5 file in NeXus layout", "\x89HDF\r\n\x1a\n", exportSessionToHdf5}};
  return kRows;
}

Result<const SessionExport*> findSessionExport(std::string_view id) {
  std::string known;
  for (const SessionExport& row : sessionExports()) {
    if (row.id == id) return &row;
    known += (known.empty() ? "" : ", ") + std::string(row.id);
  }
  return usageError("'" + std::string(id) + "' is no format to export a session to",
                    "there is: " + known);
}

}  // namespace tenter
