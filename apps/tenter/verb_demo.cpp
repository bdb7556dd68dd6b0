// SPDX-License-Identifier: GPL-3.0-or-later
// The whole way on one fabric of real measurements and one of the virtual rig, ending in a report.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <thread>

#include "demo_images.h"
#include "interrupt.h"
#include "output_guard.h"
#include "report.h"
#include "tenter/core/files.h"
#include "tenter/fitting/export.h"
#include "tenter/fitting/import.h"
#include "tenter/twin/capture.h"
#include "verbs.h"

namespace tenter::app {

namespace {

namespace fs = std::filesystem;
constexpr double kDegree = 0.017453292519943295;
constexpr const char* kReport = "report.html";
/// Written first, so that a demo that was stopped can be started again into the same folder.
constexpr const char* kMarker = "demo.json";

struct Options {
  std::string output = "tenter-demo", data, fabric = "knit-12";
  int frames = 0, nodes = 31, threads = 2;
  std::uint64_t seed = 7;
  bool full = false, no_images = false;

  /// A few frames and smaller images, unless all is asked for.
  int frameCount() const { return frames > 0 ? frames : full || no_images ? 18 : 8; }
};

void declare(CLI::App& command, Options& o) {
  command.add_option("--out", o.output, "Folder for measurements, materials and report.html")
      ->capture_default_str();
  command.add_option("--data", o.data,
                     "Folder with nylon-offaxis/ (default: $TENTER_DATA, ../shared/data)");
  command.add_option("--fabric", o.fabric, "Virtual fabric")->capture_default_str();
  command
      .add_option("--frames", o.frames,
                  "Frames of each virtual capture; default: 8, with --full or --no-images 18")
      ->check(CLI::Range(4, 200));
  command.add_flag("--full", o.full, "18 frames a protocol, 20 boards, and images of full size");
  command.add_flag("--no-images", o.no_images,
                   "Measurements as cameras would make them, without rendering and reconstruction");
  command.add_option("--nodes", o.nodes, "Nodes a side of the virtual specimen")
      ->check(CLI::Range(25, 100))
      ->capture_default_str();
  command.add_option("--seed", o.seed, "Seed of the virtual rig")->capture_default_str();
  command.add_option("--threads", o.threads, "Threads")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
}

/// One fabric's way through fit, evaluation and report.
struct Course {
  std::vector<Measurement> fitted, held_out;
  FitOptions options;
  std::string name;
};

std::optional<fs::path> nylonFolder(const Options& o) {
  const char* environment = std::getenv("TENTER_DATA");
  for (const std::string& root :
       {o.data, std::string(environment ? environment : ""), std::string("../shared/data")}) {
    const fs::path folder = fs::path(root) / "nylon-offaxis";
    if (!root.empty() && fs::exists(folder / "angle-00.csv")) return folder;
  }
  return std::nullopt;
}

Result<std::vector<Measurement>> nylonMeasurements(const fs::path& folder) {
  std::vector<Measurement> all;
  for (const int angle : {0, 45, 90}) {
    char name[16];
    std::snprintf(name, sizeof name, "angle-%02d", angle);
    TensileImportOptions import;
    import.info = {"coated nylon", name, 0.0616, 0.0};
    import.length_m = 0.097;
    import.width_m = 2.25e-3;
    import.strips = 12;
    import.angle_rad = angle * kDegree;
    auto m = importTensile(folder / (std::string(name) + ".csv"), import);
    if (!m) return m.error();
    m->name = name;
    all.push_back(std::move(*m));
  }
  CantileverImportOptions hang;
  hang.info = {"coated nylon", "cantilever", 0.0616, 0.0};
  hang.length_m = 0.075;
  auto m = importCantilever(0.0381, 0.0635, hang);
  if (!m) return m.error();
  m->name = "cantilever";
  all.push_back(std::move(*m));
  return all;
}

Result<std::vector<Measurement>> virtualStrips(const Options& o) {
  std::vector<Measurement> all;
  for (const int angle : {0, 45, 90}) {
    TensileOptions strip;
    strip.angle_rad = angle * kDegree;
    strip.seed = o.seed;
    auto m = captureTensile(strip);
    if (!m) return m.error();
    m->name = "virtual strip at " + std::to_string(angle) + " degrees";
    all.push_back(std::move(*m));
  }
  CantileverOptions hang;
  hang.seed = o.seed;
  auto m = captureCantilever(hang);
  if (!m) return m.error();
  m->name = "virtual cantilever";
  all.push_back(std::move(*m));
  return all;
}

/// The protocols of a fit and the two held out.
std::vector<const ProtocolInfo*> demoProtocols() {
  std::vector<const ProtocolInfo*> chosen;
  for (const ProtocolInfo& p : protocols()) {
    if (p.id != "bend-bias") chosen.push_back(&p);
  }
  return chosen;
}

/// Captures protocols without images, two at a time.
Result<void> captureAll(const Options& o, const std::vector<const ProtocolInfo*>& chosen,
                        Course& course) {
  std::vector<std::optional<Result<CaptureResult>>> results(chosen.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < chosen.size(); i = next++) {
      CaptureOptions capture;
      capture.fabric = o.fabric;
      capture.protocol = chosen[i]->id;
      capture.seed = o.seed;
      capture.nodes = o.nodes;
      capture.frames = o.frameCount();
      capture.cancelled = interrupted;
      results[i] = captureMeasurement(capture);
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int t = 1; t < o.threads; ++t) helpers.emplace_back(work);
    work();
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!results[i]->ok()) return results[i]->error();
    Measurement m = std::move((**results[i]).measurement);
    m.name = chosen[i]->id;
    (chosen[i]->for_fitting ? course.fitted : course.held_out).push_back(std::move(m));
  }
  return {};
}

/// The protocols of the fit from images; what is held out is measured without.
Result<void> seeAll(const Options& o, Course& course, Report& report, Console& console) {
  DemoCameras demo;
  demo.fabric = o.fabric;
  demo.seed = o.seed;
  demo.nodes = o.nodes;
  demo.frames = o.frameCount();
  demo.threads = o.threads;
  demo.folder = fs::path(o.output) / "images";
  if (!o.full) {
    demo.width_px = 968;
    demo.boards = 12;
    demo.subset_px = 21;
  }
  std::vector<const ProtocolInfo*> unseen;
  std::vector<std::string> lines;
  for (const ProtocolInfo* protocol : demoProtocols()) {
    if (!protocol->for_fitting) {
      unseen.push_back(protocol);
      continue;
    }
    console.say("seeing " + std::string(protocol->id) + " through four virtual cameras ...");
    auto seen = measureByImages(demo, *protocol, console);
    if (!seen) return seen.error();
    console.say("  " + seen->summary);
    lines.push_back(seen->summary);
    course.fitted.push_back(std::move(seen->measurement));
  }
  if (auto done = captureAll(o, unseen, course); !done) return done;
  console.say("capturing stretch-weft through tenterd, USB, Modbus and GigE Vision ...");
  auto live = measureThroughDaemon(demo, console);
  if (live) {
    console.say("  " + live->summary);
    lines.push_back(live->summary + " (held out)");
    course.held_out.push_back(std::move(live->measurement));
  } else if (interrupted()) {
    return live.error();
  } else {
    console.warn("not captured through tenterd: " + live.error().message());
    lines.push_back("stretch-weft was not captured through tenterd: " + live.error().message());
  }
  report.heading(o.fabric + " as four cameras saw it");
  report.paragraph(
      "Cameras were calibrated from rendered images of a board, sessions rendered and "
      "reconstructed; "
      "how good each is says images/PROTOCOL/quality.html beside this page.");
  report.list(lines);
  return {};
}

Result<void> writeExports(const Material& material, const fs::path& folder, Report& report) {
  std::vector<std::string> lines;
  for (const ExportTarget& target : exportTargets()) {
    ExportOptions options;
    options.edge_m = 0.01;
    const auto made = exportMaterial(material, target, options);
    if (!made) {
      lines.push_back(std::string(target.id) + ": not possible: " + made.error().message());
      continue;
    }
    const fs::path file = folder / (material.fabric + "-" + std::string(target.id) +
                                    std::string(target.file_extension));
    if (auto done = writeFileAtomically(file, made->content); !done) return done.error();
    char text[160];
    std::snprintf(text, sizeof text,
                  ": stress differs by %.2g %% RMS, %.2g %% at most, over the measured range",
                  100.0 * made->rms_rel, 100.0 * made->max_rel);
    lines.push_back(file.filename().string() + text);
  }
  report.paragraph("Exports, each evaluated in the target's own formulae:");
  report.list(lines);
  return {};
}

Error stopped(const fs::path& folder) {
  return notConverged("stopped; what was done so far is in " + folder.string());
}

/// Fit, evaluate on everything, write the material, add to the report. True if the fit converged.
Result<bool> follow(const Course& course, const fs::path& folder, Report& report,
                    Console& console) {
  console.say("fitting " + course.name + " ...");
  const auto fit = fitMaterial(course.fitted, course.options);
  if (!fit) return fit.error();
  if (auto done = writeMaterial(folder / (course.name + ".json"), fit->material); !done)
    return done.error();
  if (interrupted()) return stopped(folder);
  std::vector<Measurement> all = course.fitted;
  all.insert(all.end(), course.held_out.begin(), course.held_out.end());
  std::vector<bool> held(all.size(), false);
  std::fill(held.begin() + static_cast<std::ptrdiff_t>(course.fitted.size()), held.end(), true);
  EvaluationOptions evaluation;
  evaluation.test = course.options.test;
  evaluation.threads = course.options.threads;
  evaluation.predictions = true;
  const auto tests = evaluateMaterial(fit->material, all, evaluation);
  if (!tests) return tests.error();
  std::vector<TestResidual> residuals;
  auto& rows = console.answer["tests"];
  for (std::size_t i = 0; i < tests->size(); ++i) {
    const TestResidual& r = (*tests)[i].residual;
    residuals.push_back(r);
    rows.push_back({{"course", course.name},
                    {"measurement", r.measurement},
                    {"held_out", static_cast<bool>(held[i])},
                    {"force_nrmse", r.force_nrmse},
                    {"force_rms_N", r.force_rms_N},
                    {"position_rms_m", r.position_rms_m}});
  }
  char cost[200];
  std::snprintf(cost, sizeof cost,
                "The fit %s after %d outer iterations, %ld factorizations and %.1f s.",
                fit->converged ? "converged" : "did NOT converge", fit->outer_iterations,
                fit->factorizations, fit->seconds);
  report.heading(course.name);
  report.paragraph(cost);
  report.residualTable(residuals, held);
  report.paragraph(
      "Stiffness curves. The band is 95 % from the parameters' covariance; red knots are not seen "
      "by "
      "any measurement.");
  report.curves(fit->material);
  report.paragraph(
      "Measurements against the fitted model. What was held out took no part in the fit.");
  report.tests(*tests, held);
  if (!fit->warnings.empty()) report.list(fit->warnings);
  if (auto done = writeExports(fit->material, folder, report); !done) return done.error();
  return fit->converged;
}

Result<int> run(const Options& o, Console& console) {
  const FolderKind kind{kMarker, "\"kind\": \"demo\"", {"*"}};  // files are only added to it
  if (auto free = checkOutputFolder(o.output, kind); !free) return free.error();
  const nlohmann::json marker = {{"kind", "demo"}, {"fabric", o.fabric}, {"seed", o.seed}};
  const fs::path marker_file = fs::path(o.output) / kMarker;
  if (auto done = writeFileAtomically(marker_file, marker.dump(2) + "\n"); !done) {
    return done.error();
  }

  Report report("Tenter: from measurements to a material");
  Course strips;
  strips.options.threads = o.threads;
  strips.options.cancelled = interrupted;
  const auto nylon = nylonFolder(o);
  strips.name = nylon ? "coated-nylon" : "virtual-strips";
  auto measured = nylon ? nylonMeasurements(*nylon) : virtualStrips(o);
  if (!measured) return measured.error();
  strips.fitted = std::move(*measured);
  console.answer["tests"] = nlohmann::json::array();
  const auto first = follow(strips, o.output, report, console);
  if (!first) return first.error();

  Course rig;
  rig.name = o.fabric;
  rig.options.threads = o.threads;
  rig.options.cancelled = interrupted;
  rig.options.law_uncertainty = false;
  console.say("capturing seven protocols of " + o.fabric + " on the virtual rig ...");
  const auto captured =
      o.no_images ? captureAll(o, demoProtocols(), rig) : seeAll(o, rig, report, console);
  if (!captured) return interrupted() ? stopped(o.output) : captured.error();
  for (const auto* group : {&rig.fitted, &rig.held_out}) {
    for (const Measurement& m : *group) {
      if (auto done = writeMeasurement(fs::path(o.output) / (o.fabric + "-" + m.name), m); !done) {
        return done.error();
      }
    }
  }
  const auto second = follow(rig, o.output, report, console);
  if (!second) return second.error();

  const fs::path page = fs::path(o.output) / kReport;
  if (auto done = writeFileAtomically(page, report.html()); !done) return done.error();
  console.answer["report"] = page.string();
  console.answer["converged"] = *first && *second;
  console.say("report: " + page.string());
  return *first && *second ? kDone : static_cast<int>(ErrorKind::kNotConverged);
}

}  // namespace

Verb demoVerb() {
  return {"demo", "The whole way: measurements, fit, evaluation, exports and a report",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
