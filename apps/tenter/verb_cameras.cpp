// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/acquisition/camera_bank.h"
#include "tenter/core/files.h"
#include "verbs.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr std::chrono::seconds kPatience{15};

struct Options {
  std::string config, output;
  int sets = 1;
};

Json identityJson(const CameraIdentity& identity) {
  return {{"vendor", identity.vendor},
          {"model", identity.model},
          {"serial", identity.serial},
          {"address", identity.address}};
}

Result<int> list(const Options& /*options*/, Console& console) {
  Json& rows = console.answer["cameras"] = Json::array();
  for (const FoundCamera& camera : discoverCameras()) {
    Json row = identityJson(camera.identity);
    row["protocol"] = camera.protocol;
    rows.push_back(row);
    console.say(camera.protocol + "  " + camera.identity.address + "  " + camera.identity.serial +
                "  " + camera.identity.vendor + " " + camera.identity.model);
  }
  if (rows.empty()) console.say("no camera answers");
  return kDone;
}

Result<CameraSection> sectionOf(const std::string& file) {
  constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 20;
  const auto text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  auto section = parseCameraSection(*text, file);
  if (section && section->cameras.empty()) {
    return badInput(file, "cameras", "is not there", "see docs/formats/rig.md");
  }
  return section;
}

/// What sets of a bank amount to.
class Tally {
 public:
  void add(const FrameSet& set, const CameraBank& bank) {
    ++sets_;
    retakes_ += set.retakes;
    if (set.complete()) ++complete_;
    if (set.skew_ns) {
      skew_sum_ns_ += static_cast<double>(*set.skew_ns);
      worst_skew_ns_ = std::max(worst_skew_ns_, *set.skew_ns);
    }
    for (const SetEvent& event : set.events) {
      const auto camera = static_cast<std::size_t>(event.camera);
      ++faults_[bank.section().cameras[camera].name][std::string(frameFaultName(event.fault))];
    }
  }

  Json json(const CameraBank& bank) const {
    Json cameras = Json::array();
    for (const CameraStatus& camera : bank.status()) {
      Json row = identityJson(camera.identity);
      row["name"] = camera.name;
      row["connected"] = camera.connected;
      row["fault"] = camera.fault;
      row["packet_bytes"] = camera.identity.packet_bytes;
      row["completed"] = camera.counters.completed;
      row["failed"] = camera.counters.failed;
      row["underrun"] = camera.counters.underrun;
      row["resent"] = camera.counters.resent;
      row["missing"] = camera.counters.missing;
      row["faults"] =
          faults_.contains(camera.name) ? Json(faults_.at(camera.name)) : Json::object();
      cameras.push_back(row);
    }
    return {{"sets", sets_},
            {"complete", complete_},
            {"retakes", retakes_},
            {"skew_mean_ms", sets_ > 0 ? 1e-6 * skew_sum_ns_ / sets_ : 0.0},
            {"skew_max_ms", 1e-6 * static_cast<double>(worst_skew_ns_)},
            {"cameras", cameras}};
  }

  bool allComplete() const { return complete_ == sets_; }

 private:
  int sets_ = 0, complete_ = 0, retakes_ = 0;
  double skew_sum_ns_ = 0.0;
  std::int64_t worst_skew_ns_ = 0;
  std::map<std::string, std::map<std::string, int>> faults_;
};

void say(const Json& answer, Console& console) {
  char text[160];
  std::snprintf(
      text, sizeof text, "%d of %d sets complete, %d retakes, skew %.2f ms, at most %.2f ms",
      answer["complete"].get<int>(), answer["sets"].get<int>(), answer["retakes"].get<int>(),
      answer["skew_mean_ms"].get<double>(), answer["skew_max_ms"].get<double>());
  console.say(text);
  for (const Json& camera : answer["cameras"]) {
    std::snprintf(text, sizeof text, "  %-12s %8d completed %5d failed %3d underrun %4d resent  ",
                  camera["name"].get<std::string>().c_str(), camera["completed"].get<int>(),
                  camera["failed"].get<int>(), camera["underrun"].get<int>(),
                  camera["resent"].get<int>());
    console.say(text + camera["fault"].get<std::string>());
  }
}

/// Takes sets and gives each to `keep`.
Result<int> takeSets(const Options& o, Console& console,
                     const std::function<Result<void>(const FrameSet&, const CameraBank&)>& keep) {
  auto section = sectionOf(o.config);
  if (!section) return section.error();
  CameraBank bank(*std::move(section));
  bank.awaitAll(kPatience);
  Tally tally;
  Progress progress(console);
  for (int i = 0; i < o.sets && !interrupted(); ++i) {
    const FrameSet set = bank.takeSet();
    tally.add(set, bank);
    if (auto kept = keep(set, bank); !kept) return kept.error();
    progress.show(static_cast<double>(i + 1) / o.sets,
                  counted(static_cast<std::size_t>(i) + 1, "set"));
  }
  const Json answer = tally.json(bank);
  console.answer.update(answer);
  say(answer, console);
  if (tally.allComplete()) return kDone;
  return Error{ErrorKind::kHardware, o.config, "", "not every set is complete",
               "the cameras' faults are in the answer"};
}

Result<int> check(const Options& o, Console& console) {
  return takeSets(o, console, [](const FrameSet&, const CameraBank&) { return Result<void>(); });
}

Result<int> snap(const Options& o, Console& console) {
  if (auto free = checkNewFolder(o.output); !free) return free.error();
  std::error_code failed;
  fs::create_directories(o.output, failed);
  if (failed) return badInput(o.output, "", failed.message());
  Json& files = console.answer["files"] = Json::array();
  return takeSets(o, console, [&](const FrameSet& set, const CameraBank& bank) -> Result<void> {
    for (std::size_t i = 0; i < set.frames.size(); ++i) {
      if (isLost(set.frames[i].fault)) continue;
      const auto png = encodePng(set.frames[i].image);
      if (!png) return png.error();
      char number[16];
      std::snprintf(number, sizeof number, "%06d-", static_cast<int>(set.number));
      const fs::path file = fs::path(o.output) / (number + bank.section().cameras[i].name + ".png");
      if (auto done = writeFileAtomically(file, *png); !done) return done;
      files.push_back(file.string());
    }
    return {};
  });
}

void declareNothing(CLI::App& /*command*/, Options& /*options*/) {}

void declareSets(CLI::App& command, Options& o) {
  command.add_option("--config", o.config, "File with the table `cameras` (docs/formats/rig.md)")
      ->required();
  command.add_option("--sets", o.sets, "How many")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
}

void declareSnap(CLI::App& command, Options& o) {
  declareSets(command, o);
  command.add_option("-o,--output", o.output, "Folder to be made for the images")->required();
}

}  // namespace

Verb camerasVerb() {
  static constexpr std::array kRows = {
      Verb{"list", "Cameras that answer on the networks and buses of this machine",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareNothing, list); }},
      Verb{"check", "Take sets of images and tell what was lost; nothing is written",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSets, check); }},
      Verb{"snap", "Take sets of images into a folder",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSnap, snap); }}};
  return {"cameras", "The cameras of a rig, without tenterd",
          [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
