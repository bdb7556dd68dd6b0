// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "arcsim_law.h"
#include "export_loss.h"
#include "export_targets.h"

namespace tenter {

namespace {

using arcsim::RowWeights;
using arcsim::Tables;

constexpr double kRidge = 1e-3;      // towards the stiffness at rest, where samples say little
constexpr double kSideWeight = 0.1;  // of strains that are not those of one component alone
constexpr double kFloor = 0.5;       // of the smallest measured stiffness: rows stay definite
constexpr int kSweeps = 2000;
constexpr double kSettled = 1e-14;
constexpr int kDirections = 5, kDirectionSamples = 16;

using Entries = Eigen::Matrix<double, arcsim::kStretchRows, 1>;

/// Squares of relative stiffness errors as a function of one column of the stretching table, in
/// units of the stiffness at rest.
struct Squares {
  Eigen::Matrix<double, arcsim::kStretchRows, arcsim::kStretchRows> matrix;
  Entries right;
  double scale, smallest;

  explicit Squares(double entry_at_rest)
      : matrix(kRidge * decltype(matrix)::Identity()),
        right(Entries::Constant(kRidge)),
        scale(entry_at_rest),
        smallest(entry_at_rest) {}

  /// `stiffness` is what the program's doubled table must give at this strain. Both of its ways
  /// count, through its grid and, as a finer one would, without.
  void add(const Vec3& green, double stiffness, double weight) {
    if (stiffness <= 0.0) return;
    smallest = std::min(smallest, 0.5 * stiffness);
    for (const RowWeights& rows :
         {arcsim::stretchWeights(green), arcsim::stretchWeightsDirect(green)}) {
      const Entries row = scale / stiffness * Eigen::Map<const Entries>(rows.data());
      matrix += weight * row * row.transpose();
      right += weight * row;
    }
  }

  /// Minimum over entries above a floor, by cyclic descent.
  Entries minimum() const {
    const double floor = kFloor * smallest / scale;
    Entries x = Entries::Ones();
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      double moved = 0.0;
      for (Eigen::Index n = 0; n < x.size(); ++n) {
        const double slope = right[n] - matrix.row(n).dot(x);
        const double next = std::max(x[n] + slope / matrix(n, n), floor);
        moved = std::max(moved, std::abs(next - x[n]));
        x[n] = next;
      }
      if (moved < kSettled) break;
    }
    return scale * x;
  }
};

/// The table's column, by our component: c11, c22, c33.
constexpr int kColumn[] = {0, 2, 3};
constexpr int kCoupling = 1;

/// Coupling S_uu / E_vv [N/m] at rest, which the table holds as 2 c12; never negative.
double couplingOf(const SheetResponse& response) {
  constexpr double kSmall = 1e-6;
  return std::max(response.membraneStress(Vec3(0.0, kSmall, 0.0))[0] / kSmall, 0.0);
}

/// What the program's k of a component must be at a strain, by its own formula of stress.
double neededStiffness(const SheetResponse& response, int component, double coupling,
                       const Vec3& green) {
  const Vec3 stress = response.membraneStress(green);
  if (component == 2) return stress[2] / (0.5 * green[2]);
  return (stress[component] - coupling * green[1 - component]) / green[component];
}

/// Largest stretch along a direction, sides held, at which every component stays measured.
double measuredLimit(const SheetResponse& response, const Vec3& direction) {
  double limit = std::numeric_limits<double>::infinity();
  for (int component = 0; component < 3; ++component) {
    const double end =
        response.greenOf(component, response.window(kMembraneNames[component]).max)[component];
    if (direction[component] > 1e-9) limit = std::min(limit, end / direction[component]);
  }
  return limit;
}

void addDirections(const SheetResponse& response, int component, double coupling,
                   Squares& squares) {
  for (int d = 0; d < kDirections; ++d) {
    const double angle = d * std::numbers::pi / 8.0;
    const double c = std::cos(angle), s = std::sin(angle);
    const Vec3 direction(c * c, s * s, 2.0 * c * s);
    if (direction[component] < 1e-9) continue;
    const double limit = measuredLimit(response, direction);
    for (int i = 1; i <= kDirectionSamples; ++i) {
      const Vec3 green = limit * i / kDirectionSamples * direction;
      squares.add(green, neededStiffness(response, component, coupling, green), kSideWeight);
    }
  }
}

Entries columnOf(const SheetResponse& response, int component, double coupling) {
  const Vec3 nearly_rest = 1e-6 * Vec3::Unit(component);
  const double at_rest = 0.5 * neededStiffness(response, component, coupling, nearly_rest);
  Squares squares(std::max(at_rest, 1e-12));
  for (const auto& sample : response.membraneSamples()) {
    if (sample.component != component) continue;
    squares.add(sample.green, neededStiffness(response, component, coupling, sample.green), 1.0);
  }
  addDirections(response, component, coupling, squares);
  return squares.minimum();
}

Tables tablesOf(const SheetResponse& response) {
  Tables tables;
  tables.density_kg_per_m2 = response.material().areal_density_kg_per_m2;
  const double coupling = couplingOf(response);
  tables.stretching.col(kCoupling).setConstant(0.5 * coupling);
  for (int component = 0; component < 3; ++component) {
    tables.stretching.col(kColumn[component]) = columnOf(response, component, coupling);
  }
  for (int row = 0; row < arcsim::kBendRows; ++row) {
    // An edge resists the curvature across it.
    const double fibres = std::numbers::pi / 4.0 * row + 0.5 * std::numbers::pi;
    for (int column = 0; column < arcsim::kBendColumns; ++column) {
      const double kappa = std::max(2.0 * arcsim::kCurvatureStep_per_m * column, 1e-3);
      tables.bending(row, column) =
          response.cylinderMoment(fibres, kappa) / kappa / arcsim::kRigidityPerEntry;
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
        return arcsim::cylinderMoment(tables, angle + 0.5 * std::numbers::pi, kappa);
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
