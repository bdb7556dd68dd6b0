// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tenter/core/files.h"
#include "tenter/inversion/resimulation.h"

namespace tenter {

inline constexpr int kResimulationSchemaVersion = 1;

/// Where the parts of NAME.pvd go: the folder NAME-frames, and NAME.pc2 beside it.
struct ResimulationPlaces {
  std::filesystem::path pvd, pc2, frames;
  std::string first_frame;  ///< As the PVD names it.
};
/// Usage error unless it ends in .pvd.
Result<ResimulationPlaces> resimulationPlaces(const std::filesystem::path& pvd);
/// The folder of frames.
const FolderKind& framesFolder();

/// resimulation.json (docs/formats/resimulation.md).
nlohmann::json resimulationToJson(const ResimulationSummary& summary,
                                  const nlohmann::json& provenance);

/// Runs resimulate() and writes what it hands over: frames as VTP with velocity, contact force and
/// mode, then PC2 and PVD. Frames are complete or absent; a run that was stopped keeps those that
/// it reached. `watch`, if not null, sees each frame as well.
Result<ResimulationSummary> resimulateToFiles(StoredInversion inversion,
                                              const ResimulationOptions& options,
                                              const ResimulationPlaces& places,
                                              const nlohmann::json& provenance,
                                              const FrameSink& watch);

/// PC2 (Blender's and 3ds Max' point cache): `samples` of all vertices, one after the other.
std::string pointCache2(int vertex_count, const std::vector<Eigen::Matrix3Xf>& samples);

}  // namespace tenter
