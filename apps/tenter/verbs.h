// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

// One file each, verb_<name>.cpp.
Verb importVerb();
Verb fitVerb();
Verb evaluateVerb();
Verb materialVerb();
Verb exportVerb();
Verb drapeVerb();
Verb calibrateVerb();
Verb patternVerb();
Verb invertVerb();
Verb resimulateVerb();
Verb twinVerb();
Verb protocolVerb();
Verb sessionVerb();
Verb rigVerb();
Verb camerasVerb();
Verb correlateVerb();
Verb reconstructVerb();
Verb demoVerb();
Verb versionVerb();

// Rows of `tenter session` that are more than a line, session_<name>.cpp.
Verb sessionReplay();

// Rows of `tenter twin` that need devices, twin_<name>.cpp.
Verb twinServe();
Verb twinCameras();
Verb twinTruth();

// Rows of `tenter calibrate`, calibrate_<name>.cpp.
Verb camerasCalibration();
Verb importedCalibration();

// Kinds of import, one file each, import_<name>.cpp.
Verb tensileImport();
Verb cantileverImport();
Verb arcsimImport();
Verb kesImport();

}  // namespace tenter::app
