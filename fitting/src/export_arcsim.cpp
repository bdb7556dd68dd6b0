// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>

#include "arcsim_law.h"
#include "export_loss.h"
#include "export_targets.h"

namespace tenter {

namespace {

using arcsim::RowWeights;
using arcsim::Tables;

constexpr int kUnknowns = arcsim::kStretchRows * arcsim::kStretchColumns;
constexpr double kRidge = 1e-8;      // keeps rows that no sample reaches at the stiffness at rest
constexpr double kSideWeight = 0.1;  // of strains that are not those of one component alone
constexpr int kSweeps = 20000;
constexpr double kSettled = 1e-14;
constexpr int kDirections = 5, kDirectionSamples = 16;

/// Squares of relative stress errors as a function of the 24 entries of the stretching table.
struct Squares {
  Eigen::Matrix<double, kUnknowns, kUnknowns> matrix =
      Eigen::Matrix<double, kUnknowns, kUnknowns>::Zero();
  Eigen::Matrix<double, kUnknowns, 1> right = Eigen::Matrix<double, kUnknowns, 1>::Zero();

  void add(const Vec3& green, const Vec3& stress, double weight) {
    const double size = stress.norm();
    if (size <= 0.0) return;
    const RowWeights rows = arcsim::stretchWeights(green);
    // Stress components by table column: k11 E_uu + k12 E_vv, k22 E_vv + k12 E_uu, k33 E_uv.
    const double by_column[3][arcsim::kStretchColumns] = {{green[0], green[1], 0.0, 0.0},
                                                          {0.0, green[0], green[1], 0.0},
                                                          {0.0, 0.0, 0.0, 0.5 * green[2]}};
    for (int i = 0; i < 3; ++i) {
      Eigen::Matrix<double, kUnknowns, 1> row;
      for (int n = 0; n < kUnknowns; ++n) {
        row[n] = rows[static_cast<std::size_t>(n / arcsim::kStretchColumns)] *
                 by_column[i][n % arcsim::kStretchColumns] / size;
      }
      matrix += weight * row * row.transpose();
      right += weight * row * (stress[i] / size);
    }
  }
};

/// Minimum over entries >= 0, which the program would cut off otherwise, by cyclic descent; scaled
/// so that all entries near `start` weigh alike.
Eigen::Matrix<double, kUnknowns, 1> nonNegativeMinimum(Squares squares,
                                                       Eigen::Matrix<double, kUnknowns, 1> start) {
  const double scale = std::max(start.maxCoeff(), 1e-300);
  for (int n = 0; n < kUnknowns; ++n) {
    const double ridge = kRidge / (scale * scale);
    squares.matrix(n, n) += ridge;
    squares.right[n] += ridge * start[n];
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double moved = 0.0;
    for (int n = 0; n < kUnknowns; ++n) {
      const double slope = squares.right[n] - squares.matrix.row(n).dot(start);
      const double next = std::max(start[n] + slope / squares.matrix(n, n), 0.0);
      moved = std::max(moved, std::abs(next - start[n]));
      start[n] = next;
    }
    if (moved < kSettled * scale) break;
  }
  return start;
}

/// Stretch along one direction, sides held, as far as every component stays measured.
void addDirections(const SheetResponse& response, Squares& squares) {
  for (int d = 0; d < kDirections; ++d) {
    const double angle = d * std::numbers::pi / 8.0;
    const double c = std::cos(angle), s = std::sin(angle);
    const Vec3 direction(c * c, s * s, 2.0 * c * s);
    double limit = 1e300;
    for (int component = 0; component < 3; ++component) {
      const double end =
          response.greenOf(component, response.window(kMembraneNames[component]).max)[component];
      if (direction[component] > 1e-9) limit = std::min(limit, end / direction[component]);
    }
    for (int i = 1; i <= kDirectionSamples; ++i) {
      const Vec3 green = limit * i / kDirectionSamples * direction;
      squares.add(green, response.stress_N_per_m(green), kSideWeight);
    }
  }
}

/// Entries for the stiffness at rest in every row.
Eigen::Matrix<double, kUnknowns, 1> atRest(const SheetResponse& response) {
  constexpr double kSmall = 1e-6;
  const auto stiffness = [&](int strained, int stressed) {
    Vec3 green = Vec3::Zero();
    green[strained] = kSmall;
    return std::max(response.stress_N_per_m(green)[stressed] / kSmall, 0.0);
  };
  // The program doubles; its shear stress is k33 E_uv = k33 (2 E_uv) / 2.
  const Eigen::Vector4d row(0.5 * stiffness(0, 0), 0.5 * stiffness(1, 0), 0.5 * stiffness(1, 1),
                            stiffness(2, 2));
  return row.replicate<arcsim::kStretchRows, 1>();
}

Tables tablesOf(const SheetResponse& response) {
  Squares squares;
  for (const auto& sample : response.membraneSamples()) {
    squares.add(sample.green, sample.stress, 1.0);
  }
  addDirections(response, squares);
  const auto entries = nonNegativeMinimum(squares, atRest(response));
  Tables tables;
  tables.density_kg_per_m2 = response.material().areal_density_kg_per_m2;
  for (int n = 0; n < kUnknowns; ++n) {
    tables.stretching(n / arcsim::kStretchColumns, n % arcsim::kStretchColumns) = entries[n];
  }
  for (int row = 0; row < arcsim::kBendRows; ++row) {
    // An edge resists the curvature across it.
    const double fibres = std::numbers::pi / 4.0 * row + 0.5 * std::numbers::pi;
    for (int column = 0; column < arcsim::kBendColumns; ++column) {
      const double kappa = std::max(2.0 * arcsim::kCurvatureStep_per_m * column, 1e-3);
      tables.bending(row, column) =
          response.moment_N(fibres, kappa) / kappa / arcsim::kRigidityPerEntry;
    }
  }
  return tables;
}

nlohmann::json fileOf(const Tables& tables, const Material& material) {
  nlohmann::json json = arcsim::tablesToJson(tables);
  json["generator"] = kGenerator;
  json["fabric"] = material.fabric;
  return json;
}

void noteLosses(ExportedMaterial& exported, const Material& material) {
  auto& lost = exported.lost;
  lost.emplace_back(
      "stretching stiffness is linear in the principal stretch up to 1/6, constant beyond");
  lost.emplace_back(
      "the program tabulates it on a grid of 1/30 in Green strain and interpolates between");
  lost.emplace_back(
      "its force is not the gradient of an energy where stiffness varies with strain");
  lost.emplace_back(
      "bending is cut at a curvature of 40 1/m, and softer by up to a quarter on "
      "irregular meshes");
  const MaterialComponent* poisson = material.find("poisson");
  if (poisson != nullptr && poisson->curve.evaluate(0.0).stiffness < 0.0) {
    lost.emplace_back("the negative coupling of weft and warp, which the program cuts to zero");
  }
}

/// A material that came from there goes back digit for digit.
Result<ExportedMaterial> sameTables(const Material& material) {
  const auto tables = arcsim::tablesFromJson(material.tables, "", "tables");
  if (!tables) return tables.error();
  ExportedMaterial exported;
  nlohmann::json json = material.tables;
  json["generator"] = kGenerator;
  exported.content = json.dump(2) + "\n";
  return exported;
}

Result<ExportedMaterial> make(const Material& material, const ExportOptions& options) {
  if (material.law == "arcsim") return sameTables(material);
  const auto response = SheetResponse::create(material, options.edge_m);
  if (!response) return response.error();
  if (!response->bends()) {
    return usageError("springs of the second ring bend by the mesh they are on",
                      "give its mean edge with --edge-mm");
  }
  if (material.areal_density_kg_per_m2 <= 0.0) {
    return badInput("", "areal_density_kg_per_m2", "is missing, and ARCSim needs it");
  }
  const Tables tables = tablesOf(*response);
  ExportedMaterial exported;
  exported.content = fileOf(tables, material).dump(2) + "\n";
  setErrors(
      exported, *response, [&](const Vec3& green) { return arcsim::stress(tables, green); },
      [&](double angle, double kappa) {
        return arcsim::moment_N(tables, angle + 0.5 * std::numbers::pi, kappa);
      });
  noteLosses(exported, material);
  noteWindow(exported, *response);
  return exported;
}

}  // namespace

ExportTarget arcsimExport() {
  return {.id = "arcsim",
          .description = "material file of ARCSim 0.2 and 0.3 (JSON)",
          .file_extension = ".json",
          .marker = "\"generator\": \"tenter\"",
          .make = make};
}

}  // namespace tenter
