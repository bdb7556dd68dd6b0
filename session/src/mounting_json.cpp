// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <functional>

#include "mounting_format.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/session/mounting.h"

namespace tenter {

namespace format = mounting_format;
using Json = nlohmann::ordered_json;

namespace {

/// kMigrations[i] turns a file of version i + 1 into one of version i + 2.
const std::array<std::function<void(nlohmann::json&)>, kMountingSchemaVersion - 1> kMigrations{};

template <class Vector>
Json listOf(const Vector& vector) {
  Json list = Json::array();
  for (const double value : vector) list.push_back(value);
  return list;
}

Json outlineJson(const std::vector<Vec2>& outline) {
  Json points = Json::array();
  for (const Vec2& point : outline) points.push_back(listOf(point));
  return points;
}

Json tagJson(const ClipTag& tag) {
  Json rotation = Json::array();
  for (int row = 0; row < 3; ++row) {
    rotation.push_back(listOf(Vec3(tag.clip_from_tag.linear().row(row))));
  }
  return {
      {"family", tag.family},
      {"id", tag.id},
      {"size_m", tag.size_m},
      {"clip_from_tag",
       {{"rotation", rotation}, {"translation_m", listOf(Vec3(tag.clip_from_tag.translation()))}}}};
}

Json clipJson(const MountedClip& clip) {
  Json tags = Json::array(), bodies = Json::array();
  for (const ClipTag& tag : clip.tags) tags.push_back(tagJson(tag));
  for (const ClipBox& body : clip.bodies) {
    bodies.push_back({{"min_m", listOf(body.min_m)}, {"max_m", listOf(body.max_m)}});
  }
  return {{"id", clip.id},
          {"shape", clip.shape},
          {"mass_kg", clip.mass_kg},
          {"centre_of_mass_m", listOf(clip.centre_of_mass_m)},
          {"outline_uv_m", outlineJson(clip.outline_uv_m)},
          {"tags", tags},
          {"bodies", bodies}};
}

Json cordJson(const MountedCord& cord) {
  Json json = {
      {"cord", cord.cord}, {"clip", cord.clip},         {"attachment_m", listOf(cord.attachment_m)},
      {"cell", cord.cell}, {"actuator", cord.actuator}, {"diameter_m", cord.diameter_m}};
  if (cord.pulley_m) json["pulley_m"] = listOf(*cord.pulley_m);
  return json;
}

Json tableJson(const MountedTable& table) {
  Json json = {
      {"clip", table.clip}, {"edge_m", listOf(table.edge_m)}, {"push", listOf(table.push)}};
  if (table.push_actuator) json["push_actuator"] = *table.push_actuator;
  return json;
}

int channelOf(JsonReader& in, const std::string& key) {
  return static_cast<int>(in.integer(key, 0, format::kMaxChannel));
}

ClipTag readTag(JsonReader in) {
  ClipTag tag;
  tag.family = in.text("family", format::kMaxName);
  tag.id = static_cast<int>(in.integer("id", 0, format::kMaxTagId));
  tag.size_m = in.number("size_m");
  JsonReader pose = in.object("clip_from_tag");
  tag.clip_from_tag.linear() = pose.matrix("rotation", 3, 3);
  tag.clip_from_tag.translation() = pose.vector("translation_m", 3);
  return tag;
}

MountedClip readClip(JsonReader in) {
  MountedClip clip;
  clip.id = in.text("id", format::kMaxName);
  clip.shape = in.text("shape", format::kMaxName);
  clip.mass_kg = in.number("mass_kg");
  clip.centre_of_mass_m = in.vector("centre_of_mass_m", 3);
  const Eigen::MatrixXd outline = in.matrix("outline_uv_m", -1, 2);
  for (Eigen::Index i = 0; i < outline.rows(); ++i) clip.outline_uv_m.emplace_back(outline.row(i));
  for (std::size_t i = 0; i < in.arraySize("tags") && in.ok(); ++i) {
    clip.tags.push_back(readTag(in.element("tags", i)));
  }
  for (std::size_t i = 0; i < in.arraySize("bodies") && in.ok(); ++i) {
    JsonReader body = in.element("bodies", i);
    clip.bodies.push_back({body.vector("min_m", 3), body.vector("max_m", 3)});
  }
  return clip;
}

MountedCord readCord(JsonReader in) {
  MountedCord cord;
  cord.cord = in.text("cord", format::kMaxName);
  cord.clip = in.text("clip", format::kMaxName);
  cord.attachment_m = in.vector("attachment_m", 3);
  cord.cell = channelOf(in, "cell");
  cord.actuator = channelOf(in, "actuator");
  cord.diameter_m = in.number("diameter_m");
  if (in.has("pulley_m")) cord.pulley_m = in.vector("pulley_m", 3);
  return cord;
}

MountedTable readTable(JsonReader in) {
  MountedTable table;
  table.clip = in.text("clip", format::kMaxName);
  table.edge_m = in.vector("edge_m", 3);
  table.push = in.vector("push", 3);
  if (in.has("push_actuator")) table.push_actuator = channelOf(in, "push_actuator");
  return table;
}

Result<int> versionOf(const nlohmann::json& document, const std::string& file) {
  JsonReader in(document, file);
  const std::string name = in.text("format", format::kMaxName);
  const auto version = in.integer("schema_version", 1, 1'000'000);
  const std::string units = in.text("units", format::kMaxName);
  if (in.ok() && name != format::kFormat) {
    in.fail("format", "is \"" + name + "\" instead of \"" + format::kFormat + "\"");
  }
  if (in.ok() && version > kMountingSchemaVersion) {
    in.fail("schema_version",
            "is " + std::to_string(version) + ", newer than " +
                std::to_string(kMountingSchemaVersion) + ", the newest this program knows",
            "use a newer version of tenter");
  }
  if (in.ok() && units != format::kUnits) in.fail("units", "must be \"SI\"");
  if (!in.ok()) return in.error();
  return static_cast<int>(version);
}

Result<Mounting> mountingFrom(const nlohmann::json& document, const std::string& file) {
  JsonReader in(document, file);
  Mounting m;
  m.sample_size_m = in.vector("sample_size_m", 2);
  m.sample_corner_m = in.vector("sample_corner_m", 2);
  m.thread_angle_rad = in.number("thread_angle_rad");
  m.thickness_m = in.number("thickness_m");
  m.areal_density_kg_per_m2 = in.number("areal_density_kg_per_m2");
  m.gravity_m_per_s2 = in.vector("gravity_m_per_s2", 3);
  if (in.has("rest_frame")) m.rest_frame = in.integer("rest_frame", 0, format::kMaxFrame);
  for (std::size_t i = 0; i < in.arraySize("clips") && in.ok(); ++i) {
    m.clips.push_back(readClip(in.element("clips", i)));
  }
  for (std::size_t i = 0; i < in.arraySize("cords") && in.ok(); ++i) {
    m.cords.push_back(readCord(in.element("cords", i)));
  }
  if (in.has("table")) m.table = readTable(in.object("table"));
  if (!in.ok()) return in.error();
  if (auto valid = validateMounting(m, file); !valid) return valid.error();
  return m;
}

}  // namespace

Result<std::string> mountingJson(const Mounting& m) {
  if (auto valid = validateMounting(m, kMountingFile); !valid) return valid.error();
  Json json = {{"format", format::kFormat},
               {"schema_version", kMountingSchemaVersion},
               {"units", format::kUnits},
               {"sample_size_m", listOf(m.sample_size_m)},
               {"sample_corner_m", listOf(m.sample_corner_m)},
               {"thread_angle_rad", m.thread_angle_rad},
               {"thickness_m", m.thickness_m},
               {"areal_density_kg_per_m2", m.areal_density_kg_per_m2},
               {"gravity_m_per_s2", listOf(m.gravity_m_per_s2)}};
  if (m.rest_frame) json["rest_frame"] = *m.rest_frame;
  json["clips"] = Json::array();
  for (const MountedClip& clip : m.clips) json["clips"].push_back(clipJson(clip));
  json["cords"] = Json::array();
  for (const MountedCord& cord : m.cords) json["cords"].push_back(cordJson(cord));
  if (m.table) json["table"] = tableJson(*m.table);
  try {
    return json.dump(1) + "\n";
  } catch (const Json::exception&) {
    return badInput(kMountingFile, "", "a name is not UTF-8");
  }
}

Result<Mounting> readMounting(const std::filesystem::path& file) {
  auto document = readJsonFile(file);
  if (!document) return document.error();
  const auto version = versionOf(*document, file.string());
  if (!version) return version.error();
  for (std::size_t i = static_cast<std::size_t>(*version) - 1; i < kMigrations.size(); ++i) {
    kMigrations[i](*document);
  }
  return mountingFrom(*document, file.string());
}

}  // namespace tenter
