// SPDX-License-Identifier: GPL-3.0-or-later
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/core/files.h"
#include "tenter/reconstruction/field_file.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  std::string reference, deformed, points, output;
  int subset_px = 31, order = 2, step_px = 5, threads = 0;
  double min_zncc = 0.75, max_sigma_px = 0.1;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("reference", o.reference, "Image before: TIFF, PNG, …, 8 or 16 bits")
      ->required();
  command.add_option("deformed", o.deformed, "Image after, of the same size")->required();
  command.add_option("--subset", o.subset_px, "Side of a square subset [px], odd")
      ->capture_default_str();
  command.add_option("--order", o.order, "Of a subset's motion: 1 affine, 2 quadratic")
      ->capture_default_str();
  const auto* step = command.add_option("--step", o.step_px, "Distance of the grid's points [px]")
                         ->capture_default_str();
  command.add_option("--points", o.points, "Rows of x,y [px] instead of a grid (CSV)")
      ->excludes(const_cast<CLI::Option*>(step));
  command.add_option("--min-zncc", o.min_zncc, "Least correlation of a valid point")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--max-sigma-px", o.max_sigma_px, "Largest sigma of a valid point [px]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--threads", o.threads, "0: one a core")->check(CLI::Range(0, 256));
  command.add_option("-o,--output", o.output, "Field to write (CSV)")->required();
}

Result<CorrelationField> correlate(const Options& o, Console& console, int threads) {
  const auto reference = readGrayImage(o.reference);
  if (!reference) return reference.error();
  const auto deformed = readGrayImage(o.deformed);
  if (!deformed) return deformed.error();
  CorrelateOptions options;
  options.match.subset_px = o.subset_px;
  options.match.order = o.order;
  options.min_zncc = o.min_zncc;
  options.max_sigma_px = o.max_sigma_px;
  options.threads = threads;
  Progress progress(console);
  options.keep_going = [&](double share) {
    progress.show(share, "matched");
    return !interrupted();
  };
  const auto run = [&]() -> Result<CorrelationField> {
    if (o.points.empty()) {
      return correlateGrid(reference->image, deformed->image, o.step_px, options);
    }
    const auto points = readPoints(o.points);
    if (!points) return points.error();
    auto field = correlatePoints(reference->image, deformed->image, *points, options);
    if (!field.ok() && !field.error().place.empty()) return field.error().in(o.points);
    return field;
  };
  auto field = run();
  if (!field.ok()) return field.error().file.empty() ? field.error().in(o.deformed) : field.error();
  const auto name = [&](const ImageFile& image, const std::string& file) {
    for (const std::string& warning : image.warnings) {
      field->warnings.push_back(file + ": " + warning);
    }
  };
  name(*reference, o.reference);
  name(*deformed, o.deformed);
  return field;
}

double medianSigma(const CorrelationField& field) {
  std::vector<double> sigmas;
  for (const CorrelatedPoint& point : field.points) {
    if (point.valid()) sigmas.push_back(point.sigma_px());
  }
  if (sigmas.empty()) return 0.0;
  const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  return *middle;
}

void summarise(const CorrelationField& field, int threads, Console& console) {
  const std::size_t valid = field.count(PointState::kValid);
  const auto points = static_cast<double>(field.points.size());
  const double rate = field.cpu_seconds > 0.0 ? points / field.cpu_seconds : 0.0;
  Vec2 mean = Vec2::Zero();
  double zncc = 0.0;
  for (const CorrelatedPoint& point : field.points) {
    if (!point.valid()) continue;
    mean += point.match.warp.displacement() / static_cast<double>(valid);
    zncc += point.match.zncc / static_cast<double>(valid);
  }
  nlohmann::json invalid = nlohmann::json::object();
  std::string reasons;
  for (int k = 0; k < kPointStates; ++k) {
    const auto state = static_cast<PointState>(k);
    const std::size_t count = field.count(state);
    if (state == PointState::kValid || count == 0) continue;
    invalid[std::string(nameOf(state))] = count;
    reasons +=
        (reasons.empty() ? ": " : ", ") + std::to_string(count) + " " + std::string(nameOf(state));
  }
  console.answer = {{"points", field.points.size()},
                    {"valid", valid},
                    {"invalid", invalid},
                    {"seconds", field.seconds},
                    {"cpu_seconds", field.cpu_seconds},
                    {"threads", threads},
                    {"points_per_second_per_core", rate},
                    {"warnings", field.warnings}};
  if (valid > 0) {
    console.answer.update({{"mean_u_px", mean.x()},
                           {"mean_v_px", mean.y()},
                           {"mean_zncc", zncc},
                           {"sigma_median_px", medianSigma(field)}});
  }
  char line[160];
  std::snprintf(line, sizeof line, "%zu of %zu points valid, %.2f s, %.0f points/s/core", valid,
                field.points.size(), field.seconds, rate);
  console.say(line);
  if (!reasons.empty()) console.say("not valid" + reasons);
  if (valid > 0) {
    std::snprintf(line, sizeof line, "mean displacement (%.4f, %.4f) px, median sigma %.4f px",
                  mean.x(), mean.y(), medianSigma(field));
    console.say(line);
  }
  for (const std::string& warning : field.warnings) console.warn(warning);
}

Result<int> run(const Options& o, Console& console) {
  MatchOptions match;
  match.subset_px = o.subset_px;
  match.order = o.order;
  if (auto ok = checkMatchOptions(match); !ok) return ok.error();
  if (auto free = checkOutputFile(o.output, kFieldHeader); !free) return free.error();
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const int threads = o.threads > 0 ? o.threads : cores;
  const auto field = correlate(o, console, threads);
  if (!field.ok()) return field.error();
  if (auto done = writeFileAtomically(o.output, formatField(*field)); !done) return done.error();
  summarise(*field, threads, console);
  if (interrupted()) return notConverged("stopped by the user", "the points so far were written");
  if (field->count(PointState::kValid) == 0) {
    return notConverged("no point could be matched",
                        "do the images show the same texture, unsaturated and in focus?");
  }
  return kDone;
}

}  // namespace

Verb correlateVerb() {
  return {"correlate", "Displacements between two images of one texture (2-D correlation)",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
