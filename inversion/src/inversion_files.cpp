// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inversion_files.h"

#include <algorithm>
#include <cmath>

#include "metric_file.h"
#include "tenter/core/files.h"
#include "tenter/core/mesh_io.h"
#include "tenter/inversion/material_directions.h"
#include "tenter/inversion/problem_file.h"
#include "vtp_cells.h"

namespace tenter {
namespace {

constexpr int kHistogramBins = 10;

nlohmann::json vectorJson(const Vec3& v) { return {v[0], v[1], v[2]}; }

nlohmann::json numberOrNull(bool known, double value) {
  return known && std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

nlohmann::json proofJson(const InversionResult& result) {
  if (result.softness_proof) {
    const SoftnessProof& p = *result.softness_proof;
    const bool by_modes = !p.modes.empty();
    return {{"kind", "softness"},
            {"modes", p.modes.size()},
            {"lambda_bound_per_s2", numberOrNull(by_modes, p.bound)},
            {"work_bound_J", numberOrNull(!by_modes, p.bound)},
            {"stretch_limit", kStretchLimit},
            {"weight_change", p.weight_change},
            {"stiffness_factor_proved_below", result.stiffness_factor_proved_below},
            {"stiffness_factor_min", result.stiffness_factor_min
                                         ? nlohmann::json(*result.stiffness_factor_min)
                                         : nlohmann::json()}};
  }
  if (!result.proof) return nullptr;
  const SlidingProof& p = *result.proof;
  return {{"kind", "sliding"},
          {"direction", vectorJson(p.direction)},
          {"work_per_mass_m_per_s2", p.work_per_mass},
          {"friction_factor_min", numberOrNull(true, p.friction_factor_min)}};
}

nlohmann::json contactsJson(const InversionProblem& problem, const InversionResult& result) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const Contact& c = problem.contacts[i];
    list.push_back(
        {{"vertex", c.vertex},
         {"normal", vectorJson(c.normal)},
         {"friction", c.friction},
         {"distance_m", c.distance_m},
         {"obstacle", c.obstacle},
         {"force_N", vectorJson(result.contact_forces.col(static_cast<Eigen::Index>(i)))},
         {"margin", result.certificate.cone_margins[i]},
         {"holds", static_cast<bool>(result.certificate.contact_holds[i])}});
  }
  return list;
}

/// Counts of margins in tenths from 0 to 1; those outside their cones come first.
nlohmann::json histogram(const std::vector<double>& margins) {
  std::vector<int> bins(kHistogramBins, 0);
  int outside = 0;
  for (const double m : margins) {
    if (m < 0.0) {
      ++outside;
    } else {
      ++bins[static_cast<std::size_t>(
          std::min<int>(kHistogramBins - 1, static_cast<int>(m * kHistogramBins)))];
    }
  }
  return {{"outside", outside}, {"tenths", bins}};
}

/// Mean over the edges at each vertex.
Eigen::MatrixXd vertexMeans(const MeshTopology& topology, const Eigen::VectorXd& of_edges, int n) {
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(1, n), count = mean;
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    for (const int v : topology.edges[e].vertices) {
      mean(0, v) += of_edges[static_cast<Eigen::Index>(e)];
      count(0, v) += 1.0;
    }
  }
  return mean.cwiseQuotient(count.cwiseMax(1.0));
}

constexpr const char* kProofFile = "proof.vtp";

Result<void> writeProof(const std::filesystem::path& file, const TriangleMesh& target,
                        const SoftnessProof& proof) {
  MeshData data;
  data.point["motion"] = proof.motion;
  for (std::size_t k = 0; k < proof.modes.size(); ++k)
    data.point["mode_" + std::to_string(k)] = proof.modes[k];
  return writeVtp(file, target, data);
}

Result<void> writeMeshes(const std::filesystem::path& folder, const InversionProblem& problem,
                         const InversionResult& result) {
  const auto topology = buildTopology(problem.target);
  if (!topology) return topology.error();
  TriangleMesh rest = problem.target;
  rest.positions = result.rest;
  if (auto done = writeObj(folder / "rest.obj", rest); !done) return done;
  const int n = problem.target.vertexCount();
  const Certificate& c = result.certificate;
  MeshData data;
  data.point["rest_m"] = result.rest;
  data.point["stretch"] = vertexMeans(*topology, c.stretch, n);
  data.point["bend_rad"] = vertexMeans(*topology, c.bend_rad, n);
  Eigen::MatrixXd force = Eigen::MatrixXd::Zero(3, n), role = Eigen::MatrixXd::Zero(1, n);
  for (const int v : problem.fixed) role(0, v) = 1.0;
  Points3 places(3, static_cast<Eigen::Index>(problem.contacts.size()));
  Points3 normals = places;
  Eigen::MatrixXd vertices(1, places.cols()), friction = vertices, margins = vertices,
                                              holds = vertices;
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const Contact& contact = problem.contacts[static_cast<std::size_t>(i)];
    role(0, contact.vertex) = 2.0;
    force.col(contact.vertex) = result.contact_forces.col(i);
    places.col(i) = problem.target.positions.col(contact.vertex);
    normals.col(i) = contact.normal;
    vertices(0, i) = contact.vertex;
    friction(0, i) = contact.friction;
    margins(0, i) = c.cone_margins[static_cast<std::size_t>(i)];
    holds(0, i) = c.contact_holds[static_cast<std::size_t>(i)] ? 1.0 : 0.0;
  }
  if (!problem.frames.empty()) data.cell["warp"] = warpOf(problem.target, problem.frames);
  data.point["contact_force_N"] = force;
  data.point["support"] = role;
  if (auto done = writeVtp(folder / "pose.vtp", problem.target, data); !done) return done;
  if (auto done = writeVtpPoints(folder / "contacts.vtp", places,
                                 {{"vertex", vertices},
                                  {"normal", normals},
                                  {"force_N", result.contact_forces},
                                  {"friction", friction},
                                  {"margin", margins},
                                  {"holds", holds}});
      !done)
    return done;
  if (result.element_rest) {
    if (auto done = writeElementRest(folder / kMetricFile, *topology, *result.element_rest); !done)
      return done;
  }
  if (result.softness_proof) {
    if (auto done = writeProof(folder / kProofFile, problem.target, *result.softness_proof); !done)
      return done;
  }
  std::vector<std::array<int, 2>> lines;
  for (const MeshEdge& e : topology->edges) lines.push_back(e.vertices);
  return writeVtpLines(folder / "strains.vtp", problem.target.positions, lines,
                       {{"stretch", c.stretch.transpose()}, {"bend_rad", c.bend_rad.transpose()}});
}

nlohmann::json preferenceJson(const RestPreference& preference) {
  if (preference.kind == RestShapeKind::kNearTarget) return nullptr;
  return {{"kind", preference.kind == RestShapeKind::kFlat ? "flat" : "smooth"},
          {"share", preference.share}};
}

nlohmann::json shapeJson(const ShapeMeasures& shape) {
  return {{"bend_rms_rad", shape.bend_rms_rad},
          {"fold_rms_rad", shape.fold_rms_rad},
          {"defect_rms_rad", shape.defect_rms_rad}};
}

}  // namespace

nlohmann::json certificateToJson(const InversionProblem& problem, const InversionResult& result,
                                 const nlohmann::json& provenance, const FeasibleRange* range) {
  const Certificate& c = result.certificate;
  nlohmann::json fixed = nlohmann::json::array();
  for (const int v : problem.fixed) fixed.push_back(v);
  nlohmann::json out = {
      {"schema_version", kInversionSchemaVersion},
      {"status", name(result.status)},
      {"reason", result.reason},
      {"rest", result.element_rest ? "metric" : "mesh"},
      {"vertices", problem.target.vertexCount()},
      {"size_m", c.size_m},
      {"weight_N", c.weight_N},
      {"gravity_m_per_s2", vectorJson(problem.material.gravity_m_per_s2)},
      {"law", std::string(problem.material.model->id)},
      {"areal_density_kg_per_m2", problem.material.areal_density_kg_per_m2},
      {"fixed", fixed},
      {"contacts", contactsJson(problem, result)},
      {"force_residual_rel", c.force_residual_rel},
      {"force_rounding_rel", c.force_rounding_rel},
      {"cone_violations", c.cone_violations},
      {"cone_margin_min", c.cone_margin_min},
      {"cone_margin_histogram", histogram(c.cone_margins)},
      {"lambda_min_per_s2", numberOrNull(c.measured_stability, c.lambda_min_per_s2)},
      {"lambda_min_residual_per_s2", numberOrNull(c.measured_stability, c.lambda_residual_per_s2)},
      {"negative_eigenvalues",
       c.measured_stability ? nlohmann::json(c.negative_eigenvalues) : nlohmann::json()},
      {"redrape_rel", c.complete ? nlohmann::json(c.redrape_rel) : nlohmann::json()},
      {"redrape_max_rel", numberOrNull(c.complete, c.redrape_max_rel)},
      {"stretch_min", c.stretch.minCoeff()},
      {"stretch_max", c.stretch.cwiseAbs().maxCoeff()},
      {"bend_max_rad", c.bend_rad.maxCoeff()},
      {"preference", preferenceJson(result.preference)},
      {"target_shape", shapeJson(result.target_shape)},
      {"rest_shape", shapeJson(result.rest_shape)},
      {"proof", proofJson(result)},
      {"load_balanced", result.load_balanced},
      {"seconds", result.seconds},
      {"solve_cpu_seconds", result.solve_cpu_seconds},
      {"forces_cpu_seconds", result.forces_cpu_seconds},
      {"factorizations", result.factorizations},
      {"provenance", provenance}};
  if (range != nullptr) out["range"] = rangeToJson(*range);
  return out;
}

nlohmann::json rangeToJson(const FeasibleRange& range) {
  const auto optional = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json();
  };
  nlohmann::json points = nlohmann::json::array();
  for (const RangePoint& p : range.points) {
    points.push_back({{"stiffness_factor", p.stiffness_factor},
                      {"friction_factor", p.friction_factor},
                      {"status", name(p.status)},
                      {"lambda_min_per_s2", numberOrNull(true, p.lambda_min_per_s2)}});
  }
  return {{"stiffness_factor_min", optional(range.stiffness_min)},
          {"stiffness_factor_max", optional(range.stiffness_max)},
          {"stiffness_factor_below", optional(range.stiffness_below)},
          {"friction_factor_min", optional(range.friction_min)},
          {"friction_factor_below", optional(range.friction_below)},
          {"friction_at_stiffness_factor", range.friction_at_stiffness},
          {"friction_factor_proved_below", numberOrNull(true, range.friction_proved_below)},
          {"result_stiffness_factor", range.result_stiffness},
          {"complete", range.complete},
          {"points", points}};
}

const FolderKind& inversionFolder() {
  static const FolderKind kKind{"certificate.json",
                                "\"bend_max_rad\"",
                                {"rest.obj", "pose.vtp", "contacts.vtp", "strains.vtp", kMetricFile,
                                 kProofFile, kProblemFile}};
  return kKind;
}

Result<void> writeInversion(const std::filesystem::path& folder, const InversionProblem& problem,
                            const InversionResult& result, const nlohmann::json& provenance,
                            const nlohmann::json& asked, const FeasibleRange* range) {
  return writeFolderAtomically(folder, inversionFolder(), [&](const std::filesystem::path& place) {
    if (auto done = writeMeshes(place, problem, result); !done) return done;
    if (!asked.is_null()) {
      if (auto done = writeFileAtomically(place / kProblemFile, asked.dump(2) + "\n"); !done)
        return done;
    }
    return writeFileAtomically(
        place / inversionFolder().marker,
        certificateToJson(problem, result, provenance, range).dump(2) + "\n");
  });
}

}  // namespace tenter
