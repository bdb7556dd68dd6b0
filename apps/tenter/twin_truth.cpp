// SPDX-License-Identifier: GPL-3.0-or-later
#include "interrupt.h"
#include "progress.h"
#include "tenter/core/files.h"
#include "tenter/twin/session_truth.h"
#include "verbs.h"

namespace tenter::app {

namespace {

constexpr double kMilli = 1e3;

struct Options {
  std::string session, mount, output, cords;
  int nodes = 0;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("session", o.session, "Session of a served rig")->required();
  command.add_option("--mount", o.mount, "mount.json of the rig's state folder")->required();
  command.add_option("--nodes", o.nodes, "Nodes a side of the sheet; 0: as in the rig")
      ->capture_default_str();
  command.add_option("--cords", o.cords, "Take friction off by this calibration of the cords, too");
  command.add_option("-o,--output", o.output, "CSV of all samples beside the truth");
}

std::string csvOf(const SessionTruth& truth) {
  std::string text = "time_s,axis,position_m,measured_N,friction_N,truth_N\n";
  char line[160];
  for (const TruthRow& row : truth.rows) {
    std::snprintf(line, sizeof line, "%.6f,%d,%.9g,%.9g,%.9g,%.9g\n", row.time_s, row.axis + 1,
                  row.position_m, row.measured_N, row.friction_N, row.truth_N);
    text += line;
  }
  return text;
}

std::string millinewtons(double force_N) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f mN", kMilli * force_N);
  return text;
}

Result<int> run(const Options& o, Console& console) {
  const auto mount = readMount(o.mount);
  if (!mount) return mount.error();
  Progress progress(console);
  SessionTruthOptions options{
      o.session, *mount, std::nullopt, interrupted, [&](double time_s) {
        progress.show(-1.0, std::to_string(static_cast<int>(time_s)) + " s of the session");
      }};
  if (o.nodes != 0) options.mount.nodes = o.nodes;
  if (!o.cords.empty()) {
    auto cords = readCordCalibration(o.cords);
    if (!cords) return cords.error();
    options.cords = *std::move(cords);
  }
  const auto truth = truthOfSession(options);
  if (!truth) return truth.error();
  if (!o.output.empty()) {
    if (auto done = writeFileAtomically(o.output, csvOf(*truth)); !done) return done.error();
  }
  console.answer = {{"rms_N", truth->rms_N},
                    {"rms_by_travel_N", truth->rms_by_travel_N},
                    {"nodes", options.mount.nodes},
                    {"solves", truth->solves},
                    {"cords", nlohmann::json::array()}};
  if (truth->rms_by_cords_N) console.answer["rms_by_cords_N"] = *truth->rms_by_cords_N;
  for (const CordAgreement& cord : truth->cords) {
    console.answer["cords"].push_back({{"axis", cord.axis},
                                       {"cord", cord.cord},
                                       {"samples", cord.samples},
                                       {"rms_N", cord.rms_N},
                                       {"rms_by_travel_N", cord.rms_by_travel_N},
                                       {"bias_N", cord.bias_N},
                                       {"largest_N", cord.largest_N},
                                       {"highest_N", cord.highest_N},
                                       {"way_m", cord.way_m}});
    if (cord.rms_by_cords_N) {
      console.answer["cords"].back()["rms_by_cords_N"] = *cord.rms_by_cords_N;
    }
    console.say(cord.axis + " (" + (cord.cord.empty() ? "no cord" : cord.cord) +
                "): " + millinewtons(cord.rms_N) + " RMS, bias " + millinewtons(cord.bias_N));
  }
  console.say("all: " + millinewtons(truth->rms_N) + " RMS of measured less friction, against " +
              "the specimen's truth");
  return kDone;
}

}  // namespace

Verb twinTruth() {
  return {"truth", "Compare a served rig's session with the specimen that hung in it",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
