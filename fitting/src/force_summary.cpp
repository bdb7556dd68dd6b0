// SPDX-License-Identifier: GPL-3.0-or-later
#include "force_summary.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tenter {
namespace {

/// Places of a clip, at rest and at its pose.
struct ClipPlace {
  int row;  ///< First of its six in the stack.
  const ClipSetup* clip;
  Eigen::Isometry3d pose;
  Vec3 rest, now;
};

struct Pair {
  ClipPlace a, b;
  Vec3 direction;  ///< From b to a, now.
  double stretch;  ///< Of the distance.
};

std::vector<ClipPlace> placesOf(const SheetMesh& sheet, const SystemSetup& setup,
                                const ClothState& state, const std::vector<int>& clips) {
  std::vector<ClipPlace> places;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const ClipSetup& clip = setup.clips[clips[i]];
    Vec3 rest = Vec3::Zero();
    for (const int node : clip.nodes) rest += sheet.rest.positions.col(node);
    rest /= std::max<double>(1.0, static_cast<double>(clip.nodes.size()));
    places.push_back({6 * static_cast<int>(i), &clip, state.clips[clips[i]], rest,
                      state.clips[clips[i]] * rest});
  }
  return places;
}

Pair pairOf(const ClipPlace& a, const ClipPlace& b) {
  const double rest = (a.rest - b.rest).norm(), now = (a.now - b.now).norm();
  return {a, b, (a.now - b.now).normalized(), rest > 0.0 ? now / rest - 1.0 : 0.0};
}

Pair farthestPair(const std::vector<ClipPlace>& places) {
  std::size_t a = 0, b = 0;
  double best = -1.0;
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (const double d = (places[i].rest - places[j].rest).norm(); d > best) {
        best = d;
        a = i;
        b = j;
      }
  return pairOf(places[a], places[b]);
}

/// Free length between the facing edges of two clips at rest.
double gap(const SheetMesh& sheet, const Pair& pair) {
  const Vec3 along = (pair.a.rest - pair.b.rest).normalized();
  double begin = -std::numeric_limits<double>::infinity(),
         end = std::numeric_limits<double>::infinity();
  for (const int node : pair.a.clip->nodes)
    end = std::min(end, along.dot(sheet.rest.positions.col(node)));
  for (const int node : pair.b.clip->nodes)
    begin = std::max(begin, along.dot(sheet.rest.positions.col(node)));
  return end - begin;
}

void addPairForce(const Pair& pair, const Vec3& direction, double sign, Eigen::VectorXd& weights) {
  weights.segment<3>(pair.a.row) += 0.5 * sign * direction;
  weights.segment<3>(pair.b.row) -= 0.5 * sign * direction;
}

/// Best affine map from material coordinates to where the clips hold the cloth.
Eigen::Matrix<double, 3, 2> bestGradient(const SheetMesh& sheet,
                                         const std::vector<ClipPlace>& places) {
  Vec2 mean_uv = Vec2::Zero();
  Vec3 mean_x = Vec3::Zero();
  double count = 0.0;
  for (const ClipPlace& place : places)
    for (const int node : place.clip->nodes) {
      mean_uv += sheet.rest.uv.col(node);
      mean_x += place.pose * Vec3(sheet.rest.positions.col(node));
      count += 1.0;
    }
  mean_uv /= count;
  mean_x /= count;
  Mat2 normal = Mat2::Zero();
  Eigen::Matrix<double, 3, 2> mixed = Eigen::Matrix<double, 3, 2>::Zero();
  for (const ClipPlace& place : places)
    for (const int node : place.clip->nodes) {
      const Vec2 uv = sheet.rest.uv.col(node) - mean_uv;
      normal += uv * uv.transpose();
      mixed += (place.pose * Vec3(sheet.rest.positions.col(node)) - mean_x) * uv.transpose();
    }
  return mixed * normal.inverse();
}

double shearAngle(const Eigen::Matrix<double, 3, 2>& gradient) {
  const double sine = gradient.col(0).normalized().dot(gradient.col(1).normalized());
  return std::asin(std::clamp(sine, -1.0, 1.0));
}

/// Round the centre of the cloth, in the order of their angle.
void sortAround(std::vector<ClipPlace>& places, const SheetMesh& sheet) {
  const Vec3 centre = sheet.rest.positions.rowwise().mean();
  const Vec3 first = (sheet.rest.positions.col(1) - sheet.rest.positions.col(0)).normalized();
  const Triangle& t = sheet.rest.triangles.front();
  const Vec3 edge = sheet.rest.positions.col(t[1]) - sheet.rest.positions.col(t[0]);
  const Vec3 other = sheet.rest.positions.col(t[2]) - sheet.rest.positions.col(t[0]);
  const Vec3 second = edge.cross(other).normalized().cross(first);
  const auto angle = [&](const ClipPlace& p) {
    return std::atan2(second.dot(p.rest - centre), first.dot(p.rest - centre));
  };
  std::stable_sort(places.begin(), places.end(),
                   [&](const ClipPlace& a, const ClipPlace& b) { return angle(a) < angle(b); });
}

void aggregateTorque(std::vector<ClipPlace> places, const SheetMesh& sheet, ForceSummary& summary) {
  const auto gradient = bestGradient(sheet, places);
  summary.abscissa = shearAngle(gradient);
  const Vec3 normal = gradient.col(0).cross(gradient.col(1)).normalized();
  Vec3 centre = Vec3::Zero();
  for (const ClipPlace& place : places) centre += place.now / static_cast<double>(places.size());
  sortAround(places, sheet);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    // n . (T - c x F) = n . T - (n x c) . F
    summary.weights.segment<3>(places[i].row) = -sign * normal.cross(centre);
    summary.weights.segment<3>(places[i].row + 3) = sign * normal;
  }
}

void pairDifference(std::vector<ClipPlace> places, const SheetMesh& sheet, ForceSummary& summary) {
  sortAround(places, sheet);
  const Pair first = pairOf(places[0], places[2]), second = pairOf(places[1], places[3]);
  addPairForce(first, first.direction, 1.0, summary.weights);
  addPairForce(second, second.direction, -1.0, summary.weights);
  summary.abscissa = first.stretch - second.stretch;
}

}  // namespace

Vec3 longSide(const SheetMesh& sheet, const ClipSetup& clip, const Eigen::Isometry3d& pose) {
  Vec3 mean = Vec3::Zero();
  for (const int node : clip.nodes) mean += sheet.rest.positions.col(node);
  mean /= std::max<double>(1.0, static_cast<double>(clip.nodes.size()));
  Mat3 spread = Mat3::Zero();
  for (const int node : clip.nodes) {
    const Vec3 arm = sheet.rest.positions.col(node) - mean;
    spread += arm * arm.transpose();
  }
  if (spread.norm() == 0.0) return Vec3::Zero();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
  Vec3 axis = axes.eigenvectors().col(2);
  if (axis.sum() < 0.0) axis = -axis;
  return pose.linear() * axis;
}

ForceSummary forceSummary(Summary kind, const SheetMesh& sheet, const SystemSetup& setup,
                          const ClothState& state, const std::vector<int>& clips) {
  ForceSummary summary;
  summary.weights.setZero(6 * static_cast<Eigen::Index>(clips.size()));
  const std::vector<ClipPlace> places = placesOf(sheet, setup, state, clips);
  if (kind == Summary::kDrop || places.size() < 2) return summary;
  if (kind == Summary::kAggregateTorque && places.size() > 2) {
    aggregateTorque(places, sheet, summary);
    return summary;
  }
  if (kind == Summary::kPairDifference && places.size() == 4) {
    pairDifference(places, sheet, summary);
    return summary;
  }
  const Pair pair = farthestPair(places);
  if (kind == Summary::kShearForce || kind == Summary::kAggregateTorque) {
    addPairForce(pair, longSide(sheet, *pair.a.clip, pair.a.pose), 1.0, summary.weights);
    summary.abscissa = shearAngle(bestGradient(sheet, places));
    return summary;
  }
  addPairForce(pair, pair.direction, 1.0, summary.weights);
  const double free_length = gap(sheet, pair),
               moved = (pair.a.now - pair.b.now).norm() - (pair.a.rest - pair.b.rest).norm();
  summary.abscissa = free_length > 0.0 ? moved / free_length : pair.stretch;
  return summary;
}

}  // namespace tenter
