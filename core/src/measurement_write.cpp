// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "measurement_format.h"
#include "tenter/core/files.h"
#include "tenter/core/measurement_folder.h"
#include "tenter/core/mesh_io.h"

namespace tenter {

namespace format = measurement_format;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

template <class Vector>
Json listOf(const Vector& values) {
  Json list = Json::array();
  for (const auto value : values) list.push_back(value);
  return list;
}

Json rowsOf(const Mat3& matrix) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) rows.push_back(listOf(Vec3(matrix.row(row).transpose())));
  return rows;
}

Json jsonOf(const TensileSetup& setup) {
  return {{"length_m", setup.length_m},
          {"width_m", setup.width_m},
          {"strips", setup.strips},
          {"angle_rad", setup.angle_rad},
          {"zero_offset_m", setup.zero_offset_m},
          {"zero_strain_rule", setup.zero_strain_rule}};
}

Json jsonOf(const CantileverSetup& setup) {
  return {{"length_m", setup.length_m}, {"width_m", setup.width_m}, {"angle_rad", setup.angle_rad}};
}

Json headerOf(const Measurement& m) {
  Json clips = Json::array();
  for (const ClipInfo& clip : m.clips) {
    clips.push_back({{"id", clip.id}, {"mass_kg", clip.mass_kg}, {"shape", clip.shape}});
  }
  Json header = {{"format", format::kFormat},
                 {"schema_version", kMeasurementSchemaVersion},
                 {"units", format::kUnits},
                 {"fabric", m.fabric},
                 {"specimen", m.specimen},
                 {"protocol", m.protocol},
                 {"areal_density_kg_per_m2", m.areal_density_kg_per_m2},
                 {"thickness_m", m.thickness_m},
                 {"sample_size_m", listOf(m.sample_size_m)},
                 {"gravity_m_per_s2", listOf(m.gravity_m_per_s2)},
                 {"clips", clips},
                 {"clip_position_sigma_m", m.clip_position_sigma_m},
                 {"clip_rotation_sigma_rad", m.clip_rotation_sigma_rad}};
  if (m.rest) header["rest_mesh"] = format::kRestFile;
  if (m.tensile) header["tensile"] = jsonOf(*m.tensile);
  if (m.cantilever) header["cantilever"] = jsonOf(*m.cantilever);
  header["frame_count"] = m.frames.size();
  return header;
}

Json jsonOf(const ClipReading& clip) {
  Json outline = Json::array();
  for (const Vec2& corner : clip.outline_uv_m) outline.push_back(listOf(corner));
  return {{"clip", clip.clip},
          {"rotation", rowsOf(clip.rig_from_clip.linear())},
          {"translation_m", listOf(Vec3(clip.rig_from_clip.translation()))},
          {"clamped_vertices", listOf(clip.clamped_vertices)},
          {"outline_uv_m", outline}};
}

Json jsonOf(const CordReading& cord) {
  return {{"cord", cord.cord},
          {"clip", cord.clip},
          {"attachment_m", listOf(cord.attachment_m)},
          {"direction", listOf(cord.direction)},
          {"tension_N", cord.tension_N},
          {"tension_sigma_N", cord.tension_sigma_N}};
}

std::string branchName(Branch branch) {
  for (const auto& [known, name] : format::kBranches) {
    if (known == branch) return std::string(name);
  }
  return "unknown";
}

Json jsonOf(const Measurement& m, std::size_t index) {
  const MeasurementFrame& frame = m.frames[index];
  Json line = {{"time_ns", frame.time_ns}, {"branch", branchName(frame.branch)}};
  if (m.rest) {
    line["clips"] = Json::array();
    for (const ClipReading& clip : frame.clips) line["clips"].push_back(jsonOf(clip));
    line["cords"] = Json::array();
    for (const CordReading& cord : frame.cords) line["cords"].push_back(jsonOf(cord));
    if (frame.positions.cols() > 0) line["mesh"] = format::meshFileOfFrame(index);
  }
  if (m.tensile) {
    line["tensile"] = {{"displacement_m", frame.displacement_m},
                       {"force_N", frame.force_N},
                       {"force_sigma_N", frame.force_sigma_N}};
  }
  if (m.cantilever) {
    line["cantilever"] = {
        {"reach_m", frame.reach_m}, {"drop_m", frame.drop_m}, {"tip_sigma_m", frame.tip_sigma_m}};
  }
  return line;
}

Result<void> writeFrameMesh(const fs::path& folder, const Measurement& m, std::size_t index) {
  const MeasurementFrame& frame = m.frames[index];
  const TriangleMesh mesh{frame.positions, m.rest->triangles, {}};
  MeshData data;
  data.point[format::kSigmaArray] = frame.position_sigma_m.transpose();
  if (frame.position_sigma_axes_m.cols() > 0)
    data.point[format::kSigmaAxesArray] = frame.position_sigma_axes_m;
  data.point[format::kValidArray] =
      Eigen::Map<const Eigen::Matrix<std::uint8_t, 1, Eigen::Dynamic>>(
          frame.valid.data(), static_cast<Eigen::Index>(frame.valid.size()))
          .cast<double>();
  return writeVtp(folder / format::meshFileOfFrame(index), mesh, data);
}

Result<void> writeMeshes(const fs::path& folder, const Measurement& m) {
  if (!m.rest) return {};
  if (auto done = writeVtp(folder / format::kRestFile, *m.rest); !done) return done;
  constexpr double kSecondsPerNanosecond = 1e-9;
  std::vector<std::pair<double, std::string>> steps;
  for (std::size_t i = 0; i < m.frames.size(); ++i) {
    if (m.frames[i].positions.cols() == 0) continue;
    if (auto done = writeFrameMesh(folder, m, i); !done) return done;
    steps.emplace_back(static_cast<double>(m.frames[i].time_ns) * kSecondsPerNanosecond,
                       format::meshFileOfFrame(i));
  }
  return steps.empty() ? Result<void>() : writePvd(folder / format::kPvdFile, steps);
}

Result<void> buildFolder(const fs::path& folder, const Measurement& m) {
  std::string header, frames;
  try {
    header = headerOf(m).dump(2) + "\n";
    for (std::size_t i = 0; i < m.frames.size(); ++i) frames += jsonOf(m, i).dump() + "\n";
  } catch (const nlohmann::json::exception&) {
    return badInput("", "", "holds a name that is not UTF-8 text");
  }
  if (auto done = writeMeshes(folder, m); !done) return done;
  if (auto done = writeFileAtomically(folder / format::kFramesFile, frames); !done) return done;
  return writeFileAtomically(folder / format::kHeaderFile, header);
}

}  // namespace

const FolderKind& measurementFolder() {
  static const FolderKind kKind{
      format::kHeaderFile,
      format::kFormat,
      {format::kFramesFile, format::kRestFile, format::kPvdFile, format::kFramesFolder}};
  return kKind;
}

Result<void> writeMeasurement(const fs::path& folder, const Measurement& measurement) {
  if (auto done = validateMeasurement(measurement, folder.string()); !done) return done;
  const auto build = [&measurement, &folder](const fs::path& scratch) -> Result<void> {
    auto done = buildFolder(scratch, measurement);
    // The scratch name means nothing to the user.
    return done ? done : Result<void>(done.error().in(folder.string()));
  };
  return writeFolderAtomically(folder, measurementFolder(), build);
}

}  // namespace tenter
