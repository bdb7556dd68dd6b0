// SPDX-License-Identifier: GPL-3.0-or-later
#include "arcsim_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tenter/core/json_reader.h"

namespace tenter::arcsim {

namespace {

constexpr int kGrid = 30;              // samples a side
constexpr double kGridOrigin = -0.25;  // of E_uu and E_vv; E_uv starts at 0
constexpr double kAlmostOne = 1.0 - 1e-6;
constexpr double kGridRim = 1e-5;
constexpr double kDoubling = 2.0;
constexpr double kMaxStretching_N_per_m = 1e9, kMaxBending_N_m = 1e4;

/// Stretch and direction of the larger principal strain; along weft where both are equal.
struct Principal {
  double stretch, angle_rad;
};
Principal principalOf(double e_uu, double e_vv, double e_uv) {
  const double a = 2.0 * e_uu + 1.0, d = 2.0 * e_vv + 1.0, b = 2.0 * e_uv;
  const double largest = 0.5 * (a + d + std::sqrt(4.0 * b * b + (a - d) * (a - d)));
  const double angle =
      b != 0.0 ? std::atan2(b, largest - d) : (a >= d ? 0.0 : 0.5 * std::numbers::pi);
  return {std::sqrt(std::max(largest, 0.0)), angle};
}

/// One entry of the program's grid.
RowWeights sampleWeights(double e_uu, double e_vv, double e_uv) {
  const Principal p = principalOf(e_uu, e_vv, e_uv);
  const double along = std::clamp(std::abs(p.angle_rad / std::numbers::pi) * 8.0, 0.0, 4.0 - 1e-6);
  const int column = static_cast<int>(along);
  const double angle_part = along - column;
  const double strain_part = std::clamp((p.stretch - 1.0) / kTableStretch, 0.0, kAlmostOne);
  RowWeights weights{};
  weights[0] = kDoubling * (1.0 - strain_part);
  weights[1 + static_cast<std::size_t>(column)] = kDoubling * strain_part * (1.0 - angle_part);
  weights[2 + static_cast<std::size_t>(column)] = kDoubling * strain_part * angle_part;
  return weights;
}

/// Cell of the grid and place inside it.
struct Cell {
  int index;
  double part;
};
Cell cellOf(double coordinate) {
  const double clamped = std::clamp(coordinate, 0.0, kGrid - 1.0 - kGridRim);
  const int index = std::clamp(static_cast<int>(std::floor(clamped)), 0, kGrid - 2);
  return {index, clamped - index};
}

double gridValue(int index) { return kGridOrigin + static_cast<double>(index) / kGrid; }

template <class Matrix>
bool readRows(const nlohmann::json& json, JsonReader& in, const std::string& key, double limit,
              Matrix& out) {
  if (!json.contains(key)) {
    in.fail(key, "is missing", "an ARCSim material has density, stretching and bending");
    return false;
  }
  const Eigen::MatrixXd rows =
      in.matrix(key, static_cast<int>(out.rows()), static_cast<int>(out.cols()));
  if (!in.ok()) return false;
  if (rows.cwiseAbs().maxCoeff() > limit) {
    in.fail(key, "holds a number beyond any cloth", "check the unit");
    return false;
  }
  out = rows;
  return true;
}

nlohmann::json rowsToJson(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    nlohmann::json row = nlohmann::json::array();
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(matrix(r, c));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

Result<Tables> tablesFromJson(const nlohmann::json& json, const std::string& file,
                              const std::string& place) {
  JsonReader in(json, file, place);
  if (!in.ok()) return in.error();
  Tables tables;
  tables.density_kg_per_m2 = in.number("density", JsonReader::Range::positive(50.0));
  if (!readRows(json, in, "stretching", kMaxStretching_N_per_m, tables.stretching) ||
      !readRows(json, in, "bending", kMaxBending_N_m, tables.bending) || !in.ok()) {
    return in.error();
  }
  return tables;
}

nlohmann::json tablesToJson(const Tables& tables) {
  return {{"density", tables.density_kg_per_m2},
          {"stretching", rowsToJson(tables.stretching)},
          {"bending", rowsToJson(tables.bending)}};
}

RowWeights stretchWeightsDirect(const Vec3& green) {
  return sampleWeights(green[0], green[1], 0.5 * std::abs(green[2]));
}

RowWeights stretchWeights(const Vec3& green) {
  const Cell u = cellOf((green[0] - kGridOrigin) * kGrid);
  const Cell v = cellOf((green[1] - kGridOrigin) * kGrid);
  const Cell s = cellOf(0.5 * std::abs(green[2]) * kGrid);
  RowWeights sum{};
  for (int corner = 0; corner < 8; ++corner) {
    const int du = corner & 1, dv = corner >> 1 & 1, ds = corner >> 2;
    const double weight = (du != 0 ? u.part : 1.0 - u.part) * (dv != 0 ? v.part : 1.0 - v.part) *
                          (ds != 0 ? s.part : 1.0 - s.part);
    const RowWeights sample = sampleWeights(gridValue(u.index + du), gridValue(v.index + dv),
                                            static_cast<double>(s.index + ds) / kGrid);
    for (std::size_t r = 0; r < sum.size(); ++r) sum[r] += weight * sample[r];
  }
  return sum;
}

Vec3 stress(const Tables& tables, const Vec3& green, bool direct) {
  const RowWeights weights = direct ? stretchWeightsDirect(green) : stretchWeights(green);
  const Eigen::Map<const Eigen::Matrix<double, 1, kStretchRows>> w(weights.data());
  const Eigen::Vector4d k = (w * tables.stretching).transpose().cwiseMax(0.0);
  return {k[0] * green[0] + k[1] * green[1], k[2] * green[1] + k[1] * green[0],
          0.5 * k[3] * green[2]};
}

double cylinderMoment(const Tables& tables, double edge_angle_rad, double curvature_per_m) {
  // The program folds the angle of the edge into 0 to 90 degrees and halves the curvature.
  const double turn = std::abs(std::remainder(edge_angle_rad, std::numbers::pi));
  const double along = std::clamp(turn * 4.0 / std::numbers::pi, 0.0, 2.0);
  const int row = std::min(static_cast<int>(along), kBendRows - 2);
  const double value =
      std::clamp(0.5 * std::abs(curvature_per_m) / kCurvatureStep_per_m, 0.0, kBendColumns - 1.0);
  const int column = std::min(static_cast<int>(value), kBendColumns - 2);
  const double a = along - row, b = value - column;
  const auto& d = tables.bending;
  const double entry = d(row, column) * (1.0 - a) * (1.0 - b) + d(row + 1, column) * a * (1.0 - b) +
                       d(row, column + 1) * (1.0 - a) * b + d(row + 1, column + 1) * a * b;
  return kRigidityPerEntry * std::max(entry, 0.0) * curvature_per_m;
}

}  // namespace tenter::arcsim
