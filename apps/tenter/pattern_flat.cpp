// SPDX-License-Identifier: GPL-3.0-or-later
#include "pattern_flat.h"

#include <cstdio>
#include <filesystem>

#include "output_guard.h"
#include "tenter/core/files.h"
#include "tenter/core/mesh_io.h"
#include "tenter/inversion/flat_pattern.h"

namespace tenter::app {

namespace {

constexpr std::string_view kMarker = "<desc>Tenter flat pattern</desc>";

struct Options {
  std::string surface, output;
  double distortion_percent = 1.0;
  int max_cuts = FlatPatternOptions{}.max_cuts;
};

void declare(CLI::App& command, Options& o) {
  command
      .add_option("surface", o.surface, "Folder that tenter invert wrote, or a mesh: OBJ, PLY, VTP")
      ->required();
  command
      .add_option("--distortion", o.distortion_percent,
                  "Largest change of an edge's length that is allowed [percent]")
      ->check(CLI::Range(1e-9, 50.0))
      ->capture_default_str();
  command.add_option("--max-cuts", o.max_cuts, "Most cuts besides those that join borders")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command.add_option("-o,--output", o.output, "Drawing to write (SVG, in mm at true scale)")
      ->required();
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkOutputFile(o.output, kMarker); !free) return free.error();
  const std::filesystem::path place = o.surface;
  std::error_code error;
  const bool folder = std::filesystem::is_directory(place, error);
  if (folder && std::filesystem::exists(place / "metric.json", error))
    return badInput(o.surface, "",
                    "is a metric rest state, whose lengths and angles fit no surface",
                    "invert the target with --rest mesh");
  const auto file = folder ? place / "rest.obj" : place;
  const auto mesh = readMesh(file);
  if (!mesh) return mesh.error();
  const auto pattern = unroll(mesh->mesh, {1e-2 * o.distortion_percent, o.max_cuts});
  if (!pattern) return pattern.error().in(file.string());
  char title[200];
  std::snprintf(title, sizeof title, "Edges change their length by up to %.3g %%; %d cuts",
                100.0 * pattern->distortion, pattern->cuts);
  if (auto done = writeFileAtomically(o.output, patternSvg(*pattern, title)); !done)
    return done.error();
  const Vec2 size = pattern->places.rowwise().maxCoeff() - pattern->places.rowwise().minCoeff();
  console.answer = {{"file", o.output},
                    {"distortion", pattern->distortion},
                    {"cuts", pattern->cuts},
                    {"width_m", size[0]},
                    {"height_m", size[1]}};
  console.say(o.output + ": " + title);
  return kDone;
}

}  // namespace

Verb flatPattern() {
  return {"flat", "The cut pattern of a rest shape that can be unrolled, as SVG",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
