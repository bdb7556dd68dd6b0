// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/measurement.h"
#include "tenter/mechanics/material.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {};

void declare(CLI::App& /*command*/, Options& /*options*/) {}

Result<int> run(const Options& /*options*/, Console& console) {
  console.answer = {{"version", TENTER_VERSION},
                    {"measurement_schema_version", kMeasurementSchemaVersion},
                    {"material_schema_version", kMaterialSchemaVersion}};
  console.say("tenter " TENTER_VERSION);
  return kDone;
}

}  // namespace

Verb versionVerb() {
  return {"version", "Version of the program and of its file formats",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
