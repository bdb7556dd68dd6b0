// SPDX-License-Identifier: GPL-3.0-or-later
#include "metric_file.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"

namespace tenter {
namespace {

constexpr int kVersion = 1;
constexpr double kMostStretch = 100.0;

nlohmann::json listOf(const Eigen::VectorXd& values) {
  return std::vector<double>(values.begin(), values.end());
}

}  // namespace

Result<void> writeElementRest(const std::filesystem::path& file, const MeshTopology& topology,
                              const ElementRest& rest) {
  nlohmann::json edges = nlohmann::json::array();
  for (const MeshEdge& e : topology.edges) edges.push_back(e.vertices);
  const nlohmann::json json = {{"schema_version", kVersion},
                               {"edges", std::move(edges)},
                               {"rest_length_m", listOf(rest.length_m)},
                               {"rest_angle_rad", listOf(rest.angle_rad)}};
  return writeFileAtomically(file, json.dump() + "\n");
}

Result<ElementRest> readElementRest(const std::filesystem::path& file, const Points3& pose,
                                    const MeshTopology& topology) {
  const auto json = readJsonFile(file);
  if (!json) return json.error();
  JsonReader in(*json, file.string());
  if (in.integer("schema_version", 1, std::numeric_limits<int>::max()) != kVersion)
    in.fail("schema_version", "is of another version");
  const int count = static_cast<int>(topology.edges.size());
  const Eigen::MatrixXd edges = in.matrix("edges", count, 2);
  ElementRest rest{in.vector("rest_length_m", count), in.vector("rest_angle_rad", count)};
  if (!in.ok()) return in.error();
  for (int e = 0; e < count && in.ok(); ++e) {
    const std::string place = "[" + std::to_string(e) + "]";
    const auto& ends = topology.edges[static_cast<std::size_t>(e)].vertices;
    if (edges(e, 0) != ends[0] || edges(e, 1) != ends[1])
      in.fail("edges" + place, "is another edge than that of pose.vtp");
    const double length = (pose.col(ends[1]) - pose.col(ends[0])).norm();
    if (!(rest.length_m[e] * kMostStretch >= length && rest.length_m[e] <= kMostStretch * length))
      in.fail("rest_length_m" + place, "is not within a factor of 100 of the edge's length");
    if (!(std::abs(rest.angle_rad[e]) <= std::numbers::pi))
      in.fail("rest_angle_rad" + place, "lies beyond pi");
  }
  if (!in.ok()) return in.error();
  return rest;
}

}  // namespace tenter
