// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/problem_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analytic_obstacles.h"
#include "metric_file.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/mesh_io.h"
#include "tenter/inversion/inversion_files.h"
#include "tenter/inversion/material_directions.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;

constexpr double kUnitNormal = 1e-6;  ///< How far from length 1 a normal may be.
constexpr double kMaxFriction = 1e3;

nlohmann::json vectorJson(const Vec3& v) { return {v[0], v[1], v[2]}; }

Vec3 vectorIn(JsonReader& in, const std::string& key) {
  const Eigen::VectorXd v = in.vector(key, 3);
  return v.size() == 3 ? Vec3(v) : Vec3(Vec3::Zero());
}

nlohmann::json meshJson(const TriangleMesh& mesh) {
  nlohmann::json vertices = nlohmann::json::array();
  for (int v = 0; v < mesh.vertexCount(); ++v)
    vertices.push_back(vectorJson(mesh.positions.col(v)));
  return {{"vertices", std::move(vertices)}, {"triangles", mesh.triangles}};
}

Result<std::unique_ptr<Obstacle>> obstacleOf(JsonReader in, const std::string& file) {
  if (in.has("body")) {
    const std::string body = in.text("body");
    if (!in.ok()) return in.error();
    auto obstacle = makeAnalyticObstacle(body);
    if (!obstacle) return badInput(file, "obstacles", obstacle.error().reason);
    if (*obstacle == nullptr) in.fail("body", "is '" + body + "', which names no body");
    if (!in.ok()) return in.error();
    return obstacle;
  }
  TriangleMesh mesh;
  mesh.positions = in.matrix("vertices", -1, 3).transpose();
  const Eigen::MatrixXd triangles = in.matrix("triangles", -1, 3);
  for (Eigen::Index t = 0; t < triangles.rows() && in.ok(); ++t) {
    Triangle ids{};
    for (int k = 0; k < 3; ++k) {
      const double id = triangles(t, k);
      if (!(id >= 0.0 && id < mesh.vertexCount()) || id != std::floor(id)) {
        in.fail("triangles[" + std::to_string(t) + "]", "names a vertex that is not there");
        break;
      }
      ids[static_cast<std::size_t>(k)] = static_cast<int>(id);
    }
    mesh.triangles.push_back(ids);
  }
  if (!in.ok()) return in.error();
  auto obstacle = makeMeshObstacle(mesh);
  if (!obstacle) return obstacle.error().in(file);
  return obstacle;
}

Result<void> readContacts(const fs::path& file, StoredInversion& out) {
  const auto json = readJsonFile(file);
  if (!json) return json.error();
  JsonReader in(*json, file.string());
  const int vertices = out.problem.target.vertexCount();
  if (in.integer("schema_version", 1, std::numeric_limits<int>::max()) != kInversionSchemaVersion)
    in.fail("schema_version", "is of another version");
  const bool metric = in.has("rest") && in.text("rest") == "metric";
  if (metric && !out.element_rest)
    return badInput(file.string(), "rest", "is metric, but there is no metric.json beside it",
                    "invert the target again");
  std::vector<char> taken(static_cast<std::size_t>(vertices), 0);
  for (const int v : out.problem.fixed) taken[static_cast<std::size_t>(v)] = 1;
  const std::size_t count = in.ok() ? in.arraySize("contacts") : 0;
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    JsonReader item = in.element("contacts", i);
    Contact c;
    c.vertex = static_cast<int>(item.integer("vertex", 0, vertices - 1));
    c.normal = vectorIn(item, "normal");
    c.friction = item.number("friction", JsonReader::Range::nonNegative(kMaxFriction));
    c.distance_m = item.number("distance_m");
    c.obstacle = static_cast<int>(
        item.integer("obstacle", 0, static_cast<std::int64_t>(out.obstacles.size()) - 1));
    if (!item.ok()) break;
    if (std::abs(c.normal.norm() - 1.0) > kUnitNormal) item.fail("normal", "is not of length 1");
    char& seen = taken[static_cast<std::size_t>(c.vertex)];
    if (seen != 0) item.fail("vertex", "is fixed, or in contact twice");
    seen = 1;
    out.problem.contacts.push_back(c);
  }
  if (!in.ok()) return in.error();
  return {};
}

Result<void> readMeshes(const fs::path& folder, StoredInversion& out) {
  const fs::path pose = folder / "pose.vtp", rest = folder / "rest.obj";
  auto target = readMesh(pose);
  if (!target) return target.error();
  if (auto valid = validateMesh(target->mesh); !valid) return valid.error().in(pose.string());
  auto shape = readMesh(rest);
  if (!shape) return shape.error();
  if (shape->mesh.vertexCount() != target->mesh.vertexCount() ||
      shape->mesh.triangles != target->mesh.triangles) {
    return badInput(rest.string(), "", "is another mesh than pose.vtp", "invert the target again");
  }
  if (const auto warp = target->data.cell.find("warp"); warp != target->data.cell.end()) {
    const auto triangles = static_cast<Eigen::Index>(target->mesh.triangles.size());
    if (warp->second.rows() != 3 || warp->second.cols() != triangles || !warp->second.allFinite())
      return badInput(pose.string(), "warp", "is no direction for each triangle",
                      "invert the target again");
    auto frames = framesFromWarp(target->mesh, warp->second);
    if (!frames) return frames.error().in(pose.string());
    out.problem.frames = *std::move(frames);
  }
  std::error_code error;
  if (fs::exists(folder / kMetricFile, error)) {
    auto metric = readElementRest(folder / kMetricFile, target->mesh.positions,
                                  buildTopology(target->mesh).value());
    if (!metric) return metric.error();
    out.element_rest = *std::move(metric);
  }
  out.problem.target = std::move(target->mesh);
  out.rest = std::move(shape->mesh.positions);
  return {};
}

Result<void> readProblem(const fs::path& file, StoredInversion& out) {
  const auto json = readJsonFile(file);
  if (!json) return json.error();
  const std::string name = file.string();
  JsonReader in(*json, name);
  if (in.integer("schema_version", 1, std::numeric_limits<int>::max()) != kProblemSchemaVersion)
    in.fail("schema_version", "is of another version");
  const Vec3 gravity = vectorIn(in, "gravity_m_per_s2");
  out.friction = in.number("friction", JsonReader::Range::nonNegative(kMaxFriction));
  out.problem.fixed = in.integers("fixed", 0, out.problem.target.vertexCount() - 1);
  if (!in.ok()) return in.error();
  std::sort(out.problem.fixed.begin(), out.problem.fixed.end());
  if (std::adjacent_find(out.problem.fixed.begin(), out.problem.fixed.end()) !=
      out.problem.fixed.end()) {
    return badInput(name, "fixed", "names a vertex twice");
  }
  const std::size_t count = in.arraySize("obstacles");
  for (std::size_t i = 0; i < count; ++i) {
    auto obstacle = obstacleOf(in.element("obstacles", i), name);
    if (!obstacle) return obstacle.error();
    out.obstacles.push_back(std::move(obstacle).value());
  }
  const JsonReader material_in = in.object("material");
  if (!in.ok()) return in.error();
  const auto material = materialFromJson(material_in.json(), name);
  if (!material) return material.error();
  if (!(material->areal_density_kg_per_m2 > 0.0))
    return badInput(name, "material.areal_density_kg_per_m2", "is missing");
  const auto model = findClothModel(material->law);
  if (!model) return model.error().in(name);
  auto laws = makeLaws(**model, *material);
  if (!laws) return laws.error().in(name);
  out.problem.material = {*model, std::move(laws).value(), material->areal_density_kg_per_m2,
                          gravity};
  if (out.element_rest && !hasElementRest(out.problem.material))
    return badInput(name, "material.law",
                    "has no rest lengths and angles as metric.json gives them");
  return {};
}

}  // namespace

Result<nlohmann::json> problemToJson(const ProblemFile& problem) {
  nlohmann::json obstacles = nlohmann::json::array();
  for (const std::string& description : problem.obstacles) {
    const auto analytic = makeAnalyticObstacle(description);
    if (!analytic) return analytic.error();
    if (*analytic != nullptr) {
      obstacles.push_back({{"body", description}});
      continue;
    }
    const auto mesh = readMesh(description);
    if (!mesh) return mesh.error();
    obstacles.push_back(meshJson(mesh->mesh));
  }
  return nlohmann::json{{"schema_version", kProblemSchemaVersion},
                        {"material", materialToJson(problem.material)},
                        {"gravity_m_per_s2", vectorJson(problem.gravity_m_per_s2)},
                        {"friction", problem.friction},
                        {"fixed", problem.fixed},
                        {"obstacles", std::move(obstacles)}};
}

Result<StoredInversion> readInversion(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(folder / inversionFolder().marker, error)) {
    return badInput(folder.string(), "", "is no result of an inversion: it has no certificate.json",
                    "give the folder that tenter invert wrote");
  }
  if (!fs::is_regular_file(folder / kProblemFile, error)) {
    return badInput(folder.string(), "",
                    std::string("has no ") + kProblemFile + ", so what holds it is not known",
                    "invert the target again with this version");
  }
  StoredInversion out;
  if (auto done = readMeshes(folder, out); !done) return done.error();
  if (auto done = readProblem(folder / kProblemFile, out); !done) return done.error();
  if (auto done = readContacts(folder / inversionFolder().marker, out); !done) return done.error();
  return out;
}

}  // namespace tenter
