// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/protocol.h"

#include <array>
#include <string>

namespace tenter {

std::span<const ProtocolInfo> protocols() {
  static constexpr std::array kProtocols{
      ProtocolInfo{"stretch-weft",
                   "two bar clips pull along the weft, three cycles to a force limit"},
      ProtocolInfo{"stretch-warp",
                   "two bar clips pull along the warp, three cycles to a force limit"},
      ProtocolInfo{
          "shear",
          "picture frame: four long clips, cords pull towards opposite corners, two cycles"},
      ProtocolInfo{"bend-weft", "pushed over a table edge along the weft", true, false},
      ProtocolInfo{"bend-warp", "pushed over a table edge along the warp", true, false},
      ProtocolInfo{"bend-bias",
                   "a sample cut on the bias, pushed over a table edge at 45 degrees to the weft",
                   true, false},
      ProtocolInfo{"complex-shear",
                   "two opposite edges pulled in opposite directions: shearing and buckling",
                   false},
      ProtocolInfo{"corner-pull", "four small corner clips, opposite pairs pulled in alternation",
                   false},
  };
  return kProtocols;
}

Result<const ProtocolInfo*> findProtocol(std::string_view id) {
  std::string known;
  for (const ProtocolInfo& protocol : protocols()) {
    if (protocol.id == id) return &protocol;
    known += (known.empty() ? "" : ", ") + std::string(protocol.id);
  }
  return usageError("there is no protocol \"" + std::string(id) + "\"", "protocols: " + known);
}

}  // namespace tenter
