// SPDX-License-Identifier: GPL-3.0-or-later
#include <sys/resource.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/inversion/resimulation_files.h"
#include "verbs.h"
#include "vertex_selection.h"

namespace tenter::app {

namespace {

struct Options {
  std::string folder, output, wind, rest = "inverted";
  double seconds = 5.0, gravity_scale = 1.0, perturb = 0.0, time_budget_s = 0.0;
  unsigned seed = 20260109;
  double step_ms = 10.0, frames_per_second = 25.0, halt_s = 0.0;
  double mass_damping = DynamicsOptions{}.mass_damping_per_s;
  double stiffness_damping = DynamicsOptions{}.stiffness_damping_s;
  std::string integrator = "bdf2";
  std::vector<std::string> move, turn;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("folder", o.folder, "Folder that tenter invert wrote")->required();
  command.add_option("--seconds", o.seconds, "Time to simulate")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  command.add_option("--wind", o.wind, "Velocity of the air, x,y,z [m/s]; without: no air");
  command.add_option("--gravity-scale", o.gravity_scale, "Factor on gravity")
      ->check(CLI::Range(-1e3, 1e3))
      ->capture_default_str();
  command
      .add_option("--perturb", o.perturb,
                  "Start with every free vertex displaced at random by this, of the size")
      ->check(CLI::Range(0.0, 1.0));
  command.add_option("--seed", o.seed, "Of --perturb")->capture_default_str();
  command.add_option("--rest", o.rest, "Rest shape: inverted, or target: without inversion")
      ->check(CLI::IsMember({"inverted", "target"}))
      ->capture_default_str();
  command
      .add_option("--move", o.move,
                  "K:x,y,z: obstacle K (from 0) moves with this velocity [m/s]; may be repeated")
      ->allow_extra_args(false);
  command
      .add_option("--turn", o.turn,
                  "K:wx,wy,wz,px,py,pz: obstacle K turns with this angular velocity [rad/s] about "
                  "the point [m]; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--halt", o.halt_s, "When obstacles stop [s]; 0: never")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--step-ms", o.step_ms, "Longest time step")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  command.add_option("--frames-per-second", o.frames_per_second, "Frames written a second")
      ->check(CLI::Range(1e-3, 1e5))
      ->capture_default_str();
  command.add_option("--integrator", o.integrator, "bdf2, or euler: first order, more damping")
      ->check(CLI::IsMember({"bdf2", "euler"}))
      ->capture_default_str();
  command.add_option("--mass-damping", o.mass_damping, "Rayleigh damping, share of mass [1/s]")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      .add_option("--stiffness-damping", o.stiffness_damping,
                  "Rayleigh damping, share of stiffness [s]")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  command.add_option("--time-budget", o.time_budget_s, "Most seconds; 0: no limit")
      ->check(CLI::NonNegativeNumber);
  command.add_option("-o,--output", o.output, "NAME.pvd; frames go to NAME-frames and NAME.pc2")
      ->required();
}

/// "K:numbers" of --move and --turn, K an obstacle.
Result<std::vector<double>> parseMotion(const std::string& text, const std::string& option,
                                        std::size_t count, std::size_t obstacles,
                                        std::size_t& index) {
  const std::size_t colon = text.find(':');
  const char* end = text.data() + (colon == std::string::npos ? 0 : colon);
  const auto [next, code] = std::from_chars(text.data(), end, index);
  if (end == text.data() || code != std::errc() || next != end)
    return usageError(option + ": cannot read '" + text + "'", "K:numbers with commas between");
  if (index >= obstacles) {
    return usageError(option + ": there is no obstacle " + std::to_string(index) + " among " +
                      std::to_string(obstacles));
  }
  return parseNumbers(text.substr(colon + 1), count, option);
}

Result<std::vector<ObstacleMotion>> motionsOf(const Options& o, std::size_t obstacles) {
  std::vector<ObstacleMotion> motions(obstacles);
  std::size_t k = 0;
  for (const std::string& text : o.move) {
    const auto v = parseMotion(text, "--move", 3, obstacles, k);
    if (!v) return v.error();
    motions[k].velocity_m_per_s = Vec3((*v)[0], (*v)[1], (*v)[2]);
  }
  for (const std::string& text : o.turn) {
    const auto v = parseMotion(text, "--turn", 6, obstacles, k);
    if (!v) return v.error();
    motions[k].angular_velocity_rad_per_s = Vec3((*v)[0], (*v)[1], (*v)[2]);
    motions[k].pivot_m = Vec3((*v)[3], (*v)[4], (*v)[5]);
  }
  if (o.halt_s > 0.0)
    for (ObstacleMotion& motion : motions) motion.halt_s = o.halt_s;
  return motions;
}

Result<ResimulationOptions> optionsOf(const Options& o, std::size_t obstacles) {
  ResimulationOptions options;
  options.seconds = o.seconds;
  options.frame_s = 1.0 / o.frames_per_second;
  options.gravity_scale = o.gravity_scale;
  options.rest_is_target = o.rest == "target";
  options.perturbation_rel = o.perturb;
  options.seed = o.seed;
  options.time_budget_s = o.time_budget_s;
  options.dynamics.step_s = 1e-3 * o.step_ms;
  options.dynamics.mass_damping_per_s = o.mass_damping;
  options.dynamics.stiffness_damping_s = o.stiffness_damping;
  options.dynamics.second_order = o.integrator == "bdf2";
  options.dynamics.stop = interrupted;
  if (!o.wind.empty()) {
    const auto wind = parseNumbers(o.wind, 3, "--wind");
    if (!wind) return wind.error();
    options.dynamics.air.emplace();
    options.dynamics.air->wind_m_per_s = Vec3((*wind)[0], (*wind)[1], (*wind)[2]);
  }
  auto motions = motionsOf(o, obstacles);
  if (!motions) return motions.error();
  options.motions = std::move(motions).value();
  return options;
}

nlohmann::json provenanceOf(const Options& o) {
  return {{"program", std::string("tenter ") + TENTER_VERSION},
          {"folder", o.folder},
          {"seconds", o.seconds},
          {"wind", o.wind},
          {"gravity_scale", o.gravity_scale},
          {"perturb", o.perturb},
          {"seed", o.seed},
          {"rest", o.rest},
          {"move", o.move},
          {"turn", o.turn},
          {"halt_s", o.halt_s},
          {"step_ms", o.step_ms},
          {"frames_per_second", o.frames_per_second},
          {"integrator", o.integrator},
          {"mass_damping", o.mass_damping},
          {"stiffness_damping", o.stiffness_damping}};
}

/// A PVD of ours names its frames; the PC2 beside it is ours if the PVD is.
Result<void> checkOutputs(const ResimulationPlaces& places) {
  if (auto free = checkOutputFile(places.pvd, places.first_frame); !free) return free;
  std::error_code error;
  const bool ours = std::filesystem::exists(places.pvd, error);
  constexpr std::string_view kMagic = "POINTCACHE2", kNever = "\n\n no point cache \n\n";
  if (auto free = checkOutputFile(places.pc2, ours ? kMagic : kNever); !free) return free;
  return checkOutputFolder(places.frames, framesFolder());
}

double peakMemory_MB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void tell(const Options& o, const ResimulationSummary& s, Console& console) {
  console.answer = resimulationToJson(s, nullptr);
  console.answer.erase("schema_version");
  console.answer.erase("provenance");
  console.answer["file"] = o.output;
  console.answer["peak_memory_MB"] = peakMemory_MB();
  console.answer["seconds_per_simulated_second"] =
      s.simulated_s > 0.0 ? nlohmann::json(s.seconds / s.simulated_s) : nlohmann::json();
  char text[400];
  std::snprintf(text, sizeof text,
                "%s: %.4g s in %d frames and %d steps, moved by up to %.3g of its size; at the end "
                "%d contacts stick, %d slide, %d are off; %.3g s, %.0f MB",
                o.output.c_str(), s.simulated_s, s.frames, s.counts.steps, s.max_displacement_rel,
                s.stuck, s.sliding, s.off, s.seconds, peakMemory_MB());
  console.say(text);
  if (!s.linear) return;
  std::snprintf(text, sizeof text,
                "linear prediction with contacts held: %.3g of its size; it moved %.3g times that",
                s.linear->displacement_rel, s.linear->ratio);
  console.say(text);
}

Result<int> run(const Options& o, Console& console) {
  const auto places = resimulationPlaces(o.output);
  if (!places) return places.error();
  if (auto free = checkOutputs(*places); !free) return free.error();
  auto inversion = readInversion(o.folder);
  if (!inversion) return inversion.error();
  const auto options = optionsOf(o, inversion->obstacles.size());
  if (!options) return options.error();
  Result<ResimulationSummary> summary = notConverged("not run");
  {
    Progress progress(console);
    const FrameSink watch = [&](const ResimulationFrame& frame) -> Result<void> {
      char text[60];
      std::snprintf(text, sizeof text, "%.2f of %.4g s", frame.time_s, o.seconds);
      progress.show(frame.time_s / o.seconds, text);
      return {};
    };
    summary =
        resimulateToFiles(std::move(inversion).value(), *options, *places, provenanceOf(o), watch);
  }
  if (!summary) return summary.error();
  tell(o, *summary, console);
  if (summary->end == ResimulationEnd::kComplete) return kDone;
  console.warn(name(summary->end) + " after " + std::to_string(summary->simulated_s) +
               " s; the frames up to there are in " + o.output);
  return static_cast<int>(ErrorKind::kNotConverged);
}

}  // namespace

Verb resimulateVerb() {
  return {"resimulate", "Let the shell of an inversion move in time",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
