// SPDX-License-Identifier: GPL-3.0-or-later
#include "verbs.h"

#include <array>

namespace tenter::app {

std::span<const Verb> verbs() {
  static const std::array kVerbs = {
      importVerb(),  fitVerb(),       evaluateVerb(),   materialVerb(),  exportVerb(),
      drapeVerb(),   invertVerb(),    resimulateVerb(), twinVerb(),      protocolVerb(),
      sessionVerb(), calibrateVerb(), patternVerb(),    correlateVerb(), reconstructVerb(),
      demoVerb(),    versionVerb(),
#ifdef TENTER_HARDWARE
      rigVerb(),     camerasVerb(),
#endif
  };
  return kVerbs;
}

}  // namespace tenter::app
