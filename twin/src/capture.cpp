// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/capture.h"

#include <chrono>

#include "rig_noise.h"
#include "rig_setup.h"
#include "tenter/core/files.h"
#include "virtual_cloth.h"

namespace tenter {
namespace {

Result<void> checkOptions(const CaptureOptions& o) {
  if (o.nodes < 15 || o.nodes > 200)
    return usageError("the virtual sheet needs 15 to 200 nodes a side");
  if (o.frames < 2 || o.frames > 1000) return usageError("a capture has 2 to 1000 frames");
  if (o.tracked < 10 || o.tracked > 400)
    return usageError("10 to 400 vertices a side can be tracked");
  return {};
}

nlohmann::json describeSpecimen(const CaptureOptions& o, const Fabric& specimen,
                                std::uint64_t number) {
  nlohmann::json json{{"fabric", o.fabric},     {"protocol", o.protocol}, {"seed", o.seed},
                      {"specimen", number},     {"nodes", o.nodes},       {"noise", o.noise},
                      {"friction", o.friction}, {"scatter", o.scatter}};
  if (!o.own_law) {
    json["law"] = fabricToJson(specimen);
    return json;
  }
  json["own_law"] = o.own_law->model;
  for (const ComponentCurve& c : o.own_law->components) {
    json["components"].push_back({{"strains", c.curve.strains()},
                                  {"stiffnesses", c.curve.stiffnesses()},
                                  {"tangents", c.curve.tangents()}});
  }
  return json;
}

Measurement exactMeasurement(const CaptureOptions& options, const Fabric& specimen,
                             std::uint64_t number, const CaptureRun& run) {
  Measurement m;
  m.name = options.fabric + "-" + options.protocol + "-" + std::to_string(options.seed);
  m.fabric = options.fabric;
  m.specimen = options.fabric + "/" + std::to_string(number);
  m.protocol = options.protocol;
  m.areal_density_kg_per_m2 = specimen.areal_density_kg_per_m2;
  m.thickness_m = specimen.thickness_m;
  m.sample_size_m = run.rest.uv.rowwise().maxCoeff() - run.rest.uv.rowwise().minCoeff();
  m.clips = run.clips;
  m.rest = run.rest;
  for (const ExactFrame& frame : run.frames) m.frames.push_back(frame.reading);
  stateSigmas(m);
  return m;
}

}  // namespace

Result<CaptureResult> captureMeasurement(const CaptureOptions& options) {
  if (auto good = checkOptions(options); !good) return good.error();
  const auto fabric = findFabric(options.fabric);
  if (!fabric) return fabric.error();
  const auto protocol = findProtocol(options.protocol);
  if (!protocol) return protocol.error();
  const std::uint64_t number = options.specimen != 0 ? options.specimen : options.seed;
  const Fabric specimen = specimenOf(**fabric, options.scatter ? number : 0);
  auto cloth = makeClothSource(specimen, options.own_law);
  if (!cloth) return cloth.error();

  const auto begin = std::chrono::steady_clock::now();
  auto run = (*protocol)->has_cords ? runCords(options, specimen, *cloth)
                                    : runTable(options, specimen, *cloth);
  if (!run) return run.error();
  CaptureResult out;
  out.truth.exact = exactMeasurement(options, specimen, number, *run);
  out.truth.specimen = describeSpecimen(options, specimen, number);
  out.measurement = out.truth.exact;
  if (options.noise) {
    for (std::size_t i = 0; i < run->frames.size(); ++i) {
      addNoise(options, i, run->frames[i].cord_motion, out.measurement.frames[i]);
    }
  }
  if (options.keep_moments) {
    for (ExactFrame& frame : run->frames) out.moments.push_back(std::move(frame.moment));
  }
  out.statistics = run->statistics;
  out.statistics.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

const FolderKind& truthFolder() {
  static const FolderKind kKind{"truth.json", "\"protocol\"", {"exact", "cameras.json"}};
  return kKind;
}

Result<void> writeTruth(const std::filesystem::path& folder, const CaptureTruth& truth) {
  return writeFolderAtomically(
      folder, truthFolder(), [&](const std::filesystem::path& inside) -> Result<void> {
        if (auto done = writeMeasurement(inside / "exact", truth.exact); !done) return done;
        if (truth.cameras) {
          auto done = writeCalibration(inside / "cameras.json", *truth.cameras);
          if (!done) return done;
        }
        return writeFileAtomically(inside / "truth.json", truth.specimen.dump(2) + "\n");
      });
}

}  // namespace tenter
