// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/resimulation_files.h"

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

#include "tenter/core/mesh_io.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "PC2 is little-endian");

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string frameName(std::size_t index) {
  char name[24];
  std::snprintf(name, sizeof name, "%06zu.vtp", index);
  return name;
}

MeshData frameData(const ResimulationFrame& frame) {
  const Eigen::Index n = frame.positions.cols();
  MeshData data;
  data.point["velocity_m_per_s"] = frame.velocities;
  Eigen::MatrixXd force = Eigen::MatrixXd::Zero(3, n), mode = Eigen::MatrixXd::Zero(1, n);
  for (Eigen::Index v = 0; v < n; ++v) {
    const VertexContact& contact = (*frame.contacts)[static_cast<std::size_t>(v)];
    force.col(v) = contact.force_N;
    mode(0, v) = static_cast<double>(contact.mode);
  }
  data.point["contact_force_N"] = force;
  data.point["contact_mode"] = mode;
  return data;
}

nlohmann::json linearJson(const std::optional<LinearResponse>& linear) {
  if (!linear) return nullptr;
  return {{"displacement_rel", linear->displacement_rel}, {"ratio", linear->ratio}};
}

}  // namespace

std::string pointCache2(int vertex_count, const std::vector<Eigen::Matrix3Xf>& samples) {
  constexpr std::string_view kMagic("POINTCACHE2\0", 12);
  constexpr std::int32_t kVersion = 1;
  constexpr float kStartFrame = 0.0F, kFramesPerSample = 1.0F;
  std::string bytes(kMagic);
  append(bytes, kVersion);
  append(bytes, static_cast<std::int32_t>(vertex_count));
  append(bytes, kStartFrame);
  append(bytes, kFramesPerSample);
  append(bytes, static_cast<std::int32_t>(samples.size()));
  for (const Eigen::Matrix3Xf& sample : samples)
    bytes.append(reinterpret_cast<const char*>(sample.data()),
                 static_cast<std::size_t>(sample.size()) * sizeof(float));
  return bytes;
}

Result<ResimulationPlaces> resimulationPlaces(const fs::path& pvd) {
  if (pvd.extension() != ".pvd" || pvd.stem().empty())
    return usageError("'" + pvd.string() + "' is not the name of a PVD file", "let it end in .pvd");
  ResimulationPlaces places;
  const std::string stem = pvd.stem().string();
  places.pvd = pvd;
  places.pc2 = pvd.parent_path() / (stem + ".pc2");
  places.frames = pvd.parent_path() / (stem + "-frames");
  places.first_frame = stem + "-frames/" + frameName(0);
  return places;
}

const FolderKind& framesFolder() {
  static const FolderKind kKind{"resimulation.json", "\"end_displacement_rel\"", {"*.vtp"}};
  return kKind;
}

nlohmann::json resimulationToJson(const ResimulationSummary& s, const nlohmann::json& provenance) {
  return {{"schema_version", kResimulationSchemaVersion},
          {"end_displacement_rel", s.end_displacement_rel},
          {"max_displacement_rel", s.max_displacement_rel},
          {"status", name(s.end)},
          {"simulated_s", s.simulated_s},
          {"frames", s.frames},
          {"size_m", s.size_m},
          {"weight_N", s.weight_N},
          {"stuck", s.stuck},
          {"sliding", s.sliding},
          {"off", s.off},
          {"landed", s.landed},
          {"linear_response", linearJson(s.linear)},
          {"energy_start_J", s.energy_start_J},
          {"energy_end_J", s.energy_end_J},
          {"kinetic_end_J", s.kinetic_end_J},
          {"steps", s.counts.steps},
          {"rejected_steps", s.counts.rejected},
          {"iterations", s.counts.iterations},
          {"factorizations", s.counts.factorizations},
          {"shortest_step_s", s.counts.shortest_step_s},
          {"worst_residual_N", s.counts.worst_residual_N},
          {"tolerance_N", s.tolerance_N},
          {"deepest_m", s.counts.deepest_m},
          {"seconds", s.seconds},
          {"provenance", provenance}};
}

Result<ResimulationSummary> resimulateToFiles(StoredInversion inversion,
                                              const ResimulationOptions& options,
                                              const ResimulationPlaces& places,
                                              const nlohmann::json& provenance,
                                              const FrameSink& watch) {
  TriangleMesh mesh = inversion.problem.target;
  std::vector<Eigen::Matrix3Xf> samples;
  std::vector<std::pair<double, std::string>> steps;
  Result<ResimulationSummary> summary = notConverged("not run");
  const auto build = [&](const fs::path& folder) -> Result<void> {
    const FrameSink sink = [&](const ResimulationFrame& frame) -> Result<void> {
      mesh.positions = frame.positions;
      const std::string file = frameName(steps.size());
      if (auto done = writeVtp(folder / file, mesh, frameData(frame)); !done) return done;
      steps.emplace_back(frame.time_s, places.frames.filename().string() + "/" + file);
      samples.emplace_back(frame.positions.cast<float>());
      return watch ? watch(frame) : Result<void>();
    };
    summary = resimulate(std::move(inversion), options, sink);
    if (!summary) return summary.error();
    return writeFileAtomically(folder / framesFolder().marker,
                               resimulationToJson(*summary, provenance).dump(2) + "\n");
  };
  if (auto done = writeFolderAtomically(places.frames, framesFolder(), build); !done)
    return done.error();
  if (auto done = writeFileAtomically(places.pc2, pointCache2(mesh.vertexCount(), samples)); !done)
    return done.error();
  if (auto done = writePvd(places.pvd, steps); !done) return done.error();
  return summary;
}

}  // namespace tenter
