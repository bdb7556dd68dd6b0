// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <functional>

#include "measurement_checks.h"
#include "measurement_format.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/mesh_io.h"
#include "text_scan.h"

namespace tenter {

namespace format = measurement_format;
namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

constexpr std::size_t kMaxFramesFile_bytes = std::size_t{1} << 29;
constexpr std::size_t kMaxName = 200;

/// kMigrations[i] turns a header and frame lines of version i + 1 into version i + 2.
struct Migration {
  std::function<void(Json& header)> header;
  std::function<void(Json& frame)> frame;
};
const std::array<Migration, kMeasurementSchemaVersion - 1> kMigrations{};

Result<int> versionOf(const Json& header, const std::string& file) {
  JsonReader in(header, file);
  const std::string name = in.text("format", kMaxName);
  const auto version = in.integer("schema_version", 1, 1'000'000);
  const std::string units = in.text("units", kMaxName);
  if (in.ok() && name != format::kFormat) {
    in.fail("format", "is \"" + name + "\" instead of \"" + format::kFormat + "\"");
  }
  if (in.ok() && version > kMeasurementSchemaVersion) {
    in.fail("schema_version",
            "is " + std::to_string(version) + ", newer than " +
                std::to_string(kMeasurementSchemaVersion) + ", the newest this program knows",
            "use a newer version of tenter");
  }
  if (in.ok() && units != format::kUnits) {
    in.fail("units", "must be \"SI\"", "convert to m, kg, s, N and rad");
  }
  if (!in.ok()) return in.error();
  return static_cast<int>(version);
}

TensileSetup readTensile(JsonReader in) {
  TensileSetup setup;
  setup.length_m = in.number("length_m");
  setup.width_m = in.number("width_m");
  setup.strips = static_cast<int>(in.integer("strips", 1, 10'000));
  setup.angle_rad = in.number("angle_rad");
  setup.zero_offset_m = in.number("zero_offset_m");
  setup.zero_strain_rule = in.text("zero_strain_rule", kMaxName);
  return setup;
}

CantileverSetup readCantilever(JsonReader in) {
  CantileverSetup setup;
  setup.length_m = in.number("length_m");
  setup.width_m = in.number("width_m");
  setup.angle_rad = in.number("angle_rad");
  return setup;
}

/// Fills all but meshes and frames; whether there is a rest mesh is returned.
Result<bool> readHeader(const Json& header, const std::string& file, Measurement& m) {
  JsonReader in(header, file);
  m.fabric = in.text("fabric", kMaxName);
  m.specimen = in.text("specimen", kMaxName);
  m.protocol = in.text("protocol", kMaxName);
  m.areal_density_kg_per_m2 = in.number("areal_density_kg_per_m2");
  m.thickness_m = in.number("thickness_m");
  m.sample_size_m = in.vector("sample_size_m", 2);
  m.gravity_m_per_s2 = in.vector("gravity_m_per_s2", 3);
  for (std::size_t i = 0; i < in.arraySize("clips") && in.ok(); ++i) {
    JsonReader clip = in.element("clips", i);
    m.clips.push_back(
        {clip.text("id", kMaxName), clip.number("mass_kg"), clip.text("shape", kMaxName)});
  }
  m.clip_position_sigma_m = in.number("clip_position_sigma_m");
  m.clip_rotation_sigma_rad = in.number("clip_rotation_sigma_rad");
  const bool has_rest = in.has("rest_mesh");
  if (has_rest && in.text("rest_mesh") != format::kRestFile) {
    in.fail("rest_mesh", "must be \"rest.vtp\"");
  }
  if (in.has("tensile")) m.tensile = readTensile(in.object("tensile"));
  if (in.has("cantilever")) m.cantilever = readCantilever(in.object("cantilever"));
  const auto frames = in.integer("frame_count", 1, format::kMaxFrames);
  if (!in.ok()) return in.error();
  m.frames.resize(static_cast<std::size_t>(frames));
  return has_rest;
}

ClipReading readClip(JsonReader in) {
  ClipReading clip;
  clip.clip = in.text("clip", kMaxName);
  clip.rig_from_clip.linear() = in.matrix("rotation", 3, 3);
  clip.rig_from_clip.translation() = in.vector("translation_m", 3);
  clip.clamped_vertices = in.integers("clamped_vertices", 0, INT32_MAX);
  const Eigen::MatrixXd outline = in.matrix("outline_uv_m", -1, 2);
  for (Eigen::Index i = 0; i < outline.rows(); ++i) clip.outline_uv_m.emplace_back(outline.row(i));
  return clip;
}

CordReading readCord(JsonReader in) {
  CordReading cord;
  cord.cord = in.text("cord", kMaxName);
  cord.clip = in.text("clip", kMaxName);
  cord.attachment_m = in.vector("attachment_m", 3);
  cord.direction = in.vector("direction", 3);
  cord.tension_N = in.number("tension_N");
  cord.tension_sigma_N = in.number("tension_sigma_N");
  return cord;
}

void readBranch(JsonReader& in, MeasurementFrame& frame) {
  const std::string text = in.text("branch", kMaxName);
  for (const auto& [branch, name] : format::kBranches) {
    if (name == text) {
      frame.branch = branch;
      return;
    }
  }
  in.fail("branch", "must be \"loading\", \"unloading\" or \"unknown\"");
}

void readClothFrame(JsonReader& in, MeasurementFrame& frame) {
  for (std::size_t i = 0; i < in.arraySize("clips") && in.ok(); ++i) {
    frame.clips.push_back(readClip(in.element("clips", i)));
  }
  for (std::size_t i = 0; i < in.arraySize("cords") && in.ok(); ++i) {
    frame.cords.push_back(readCord(in.element("cords", i)));
  }
}

/// One line; whether the frame has a mesh file is returned.
Result<bool> readFrameLine(const Json& line, std::size_t index, const std::string& file,
                           Measurement& m) {
  MeasurementFrame& frame = m.frames[index];
  JsonReader in(line, file, format::lineOfFrame(index));
  frame.time_ns = in.integer("time_ns", 0, INT64_MAX);
  readBranch(in, frame);
  if (m.rest) readClothFrame(in, frame);
  if (m.tensile) {
    JsonReader tensile = in.object("tensile");
    frame.displacement_m = tensile.number("displacement_m");
    frame.force_N = tensile.number("force_N");
    frame.force_sigma_N = tensile.number("force_sigma_N");
  }
  if (m.cantilever) {
    JsonReader cantilever = in.object("cantilever");
    frame.reach_m = cantilever.number("reach_m");
    frame.drop_m = cantilever.number("drop_m");
    frame.tip_sigma_m = cantilever.number("tip_sigma_m");
  }
  const bool has_mesh = in.has("mesh");
  if (has_mesh && in.text("mesh") != format::meshFileOfFrame(index)) {
    in.fail("mesh", "must be \"" + format::meshFileOfFrame(index) + "\"");
  }
  if (has_mesh && !m.rest) in.fail("mesh", "a frame with a mesh needs rest.vtp");
  if (!in.ok()) return in.error();
  return has_mesh;
}

Result<void> readFrameMesh(const fs::path& file, const TriangleMesh& rest,
                           MeasurementFrame& frame) {
  auto read = readMesh(file);
  if (!read) return read.error();
  const std::string name = file.string();
  if (read->mesh.positions.cols() != rest.positions.cols()) {
    return badInput(name, "Points",
                    "has " + std::to_string(read->mesh.positions.cols()) +
                        " vertices but the rest mesh has " + std::to_string(rest.positions.cols()));
  }
  if (read->mesh.triangles != rest.triangles) {
    return badInput(name, "Polys", "has other triangles than the rest mesh");
  }
  for (const char* array : {format::kSigmaArray, format::kValidArray}) {
    const auto found = read->data.point.find(array);
    if (found == read->data.point.end() || found->second.rows() != 1) {
      return badInput(name, std::string("point array \"") + array + "\"",
                      "is missing or has more than one component");
    }
  }
  frame.positions = std::move(read->mesh.positions);
  frame.position_sigma_m = read->data.point[format::kSigmaArray].transpose();
  if (const auto axes = read->data.point.find(format::kSigmaAxesArray);
      axes != read->data.point.end()) {
    if (axes->second.rows() != 3) {
      return badInput(name, std::string("point array \"") + format::kSigmaAxesArray + "\"",
                      "has " + std::to_string(axes->second.rows()) + " components instead of 3");
    }
    frame.position_sigma_axes_m = axes->second;
  }
  const Eigen::MatrixXd& valid = read->data.point[format::kValidArray];
  for (Eigen::Index v = 0; v < valid.cols(); ++v) {
    if (valid(0, v) != 0.0 && valid(0, v) != 1.0) {
      return badInput(name, "vertex " + std::to_string(v), "valid must be 0 or 1");
    }
    frame.valid.push_back(valid(0, v) != 0.0 ? 1 : 0);
  }
  return {};
}

Result<Json> parseFrame(std::string_view line, std::size_t index, int version,
                        const std::string& file) {
  auto json = parseJson(line, file, format::lineOfFrame(index));
  if (!json) return json;
  for (auto i = static_cast<std::size_t>(version - 1); i < kMigrations.size(); ++i) {
    kMigrations[i].frame(*json);
  }
  return json;
}

Result<void> readFrames(const fs::path& folder, int version, Measurement& m) {
  const std::string file = (folder / format::kFramesFile).string();
  const auto content = readFile(file, kMaxFramesFile_bytes);
  if (!content) return content.error();
  std::string_view rest = *content;
  for (std::size_t i = 0; i < m.frames.size(); ++i) {
    if (rest.empty()) {
      return badInput(
          file, format::lineOfFrame(i),
          "is missing: measurement.json announces " + std::to_string(m.frames.size()) + " frames",
          "the file may have been cut off");
    }
    const auto json = parseFrame(nextLine(rest), i, version, file);
    if (!json) return json.error();
    const auto has_mesh = readFrameLine(*json, i, file, m);
    if (!has_mesh) return has_mesh.error();
    if (!*has_mesh) continue;
    const fs::path mesh_file = folder / format::meshFileOfFrame(i);
    if (auto done = readFrameMesh(mesh_file, *m.rest, m.frames[i]); !done) return done;
  }
  if (rest.empty()) return {};
  return badInput(file, format::lineOfFrame(m.frames.size()),
                  "is more than the " + std::to_string(m.frames.size()) +
                      " frames that measurement.json announces");
}

}  // namespace

Result<Measurement> readMeasurement(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    const std::string reason =
        error ? "cannot be read: " + error.message() : std::string("is not a folder");
    return badInput(folder.string(), "", reason, "name a measurement folder");
  }
  const std::string header_file = (folder / format::kHeaderFile).string();
  auto header = readJsonFile(header_file);
  if (!header) return header.error();
  const auto version = versionOf(*header, header_file);
  if (!version) return version.error();
  for (auto i = static_cast<std::size_t>(*version - 1); i < kMigrations.size(); ++i) {
    kMigrations[i].header(*header);
  }

  Measurement m;
  const auto has_rest = readHeader(*header, header_file, m);
  if (!has_rest) return has_rest.error();
  if (auto done = checkHeader(m, header_file, *has_rest); !done) return done.error();
  if (*has_rest) {
    auto rest = readMesh(folder / format::kRestFile);
    if (!rest) return rest.error();
    m.rest = std::move(rest->mesh);
  }
  if (auto done = checkRest(m, (folder / format::kRestFile).string()); !done) return done.error();
  if (auto done = readFrames(folder, *version, m); !done) return done.error();
  if (auto done = checkFrames(m, (folder / "").string()); !done) return done.error();

  m.name = fs::weakly_canonical(folder, error).filename().string();
  auto hash = sha256OfPath(folder);
  if (!hash) return hash.error();
  m.content_sha256 = std::move(*hash);
  return m;
}

}  // namespace tenter
