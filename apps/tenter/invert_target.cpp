// SPDX-License-Identifier: GPL-3.0-or-later
#include "invert_target.h"

#include <filesystem>

#include "tenter/core/measurement.h"
#include "tenter/core/mesh_io.h"
#include "tenter/fitting/measured_sheet.h"

namespace tenter::app {
namespace {

Result<InvertTarget> ofMeasurement(const std::string& path, const MeasuredTargetOptions& options,
                                   const Console& console) {
  const auto measurement = readMeasurement(path);
  if (!measurement) return measurement.error();
  const std::size_t count = measurement->frames.size();
  const std::size_t frame = options.frame ? static_cast<std::size_t>(*options.frame)
                                          : std::max<std::size_t>(count, 1) - 1;
  FitTestOptions sheet;
  sheet.nodes = options.nodes;
  auto measured = measuredSheet(*measurement, frame, sheet);
  if (!measured) return measured.error().in(path);
  console.say(path + ": frame " + std::to_string(frame) + " of " + std::to_string(count) + ", " +
              std::to_string(measured->mesh.vertexCount()) + " vertices laid through it, " +
              std::to_string(measured->held.size()) + " of them held");
  if (measured->unseen > 0) {
    console.warn(path + ": frame " + std::to_string(frame) + " shows nothing at " +
                 std::to_string(measured->unseen) +
                 " vertices; their place is filled in smoothly from those around");
  }
  return InvertTarget{std::move(measured->mesh), std::move(measured->held),
                      measurement->gravity_m_per_s2};
}

}  // namespace

Result<InvertTarget> readTarget(const std::string& path, const MeasuredTargetOptions& options,
                                const Console& console) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return ofMeasurement(path, options, console);
  if (options.frame) return usageError("--frame is of a measurement, and " + path + " is a file");
  auto file = readMesh(path);
  if (!file) return file.error();
  return InvertTarget{std::move(file->mesh), {}, kDefaultGravity};
}

}  // namespace tenter::app
