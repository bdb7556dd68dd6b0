// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/sliding_proof.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "second_order_cone.h"

namespace tenter {
namespace {

constexpr int kMaxSweeps = 400;
/// Of the unit direction: rounding of the projections, and the least sinking that counts.
constexpr double kRounding = 1e-9, kLeastWork = 1e-6;
constexpr double kMostFriction = 1e3;
constexpr int kBisections = 60;

/// Nearest point to `v` of { d : n . d >= mu |d_T| }: v minus its projection on the polar, -K.
Vec3 projectOnDual(const Vec3& v, const Vec3& normal, double friction) {
  return v + projectOnFrictionCone(-v, normal, friction).point;
}

/// Projection of gravity's direction on the intersection of the contacts' dual cones (Dykstra);
/// zero if they leave no way down.
Vec3 wayDown(const std::vector<Contact>& contacts, const Vec3& gravity, double factor) {
  Vec3 x = gravity.normalized();
  std::vector<Vec3> increments(contacts.size(), Vec3::Zero());
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double change = 0.0;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Vec3 from = x + increments[i];
      const Vec3 to = projectOnDual(from, contacts[i].normal, factor * contacts[i].friction);
      increments[i] = from - to;
      change = std::max(change, (to - x).norm());
      x = to;
    }
    if (change < 1e-14) break;
  }
  return x;
}

bool slides(const std::vector<Contact>& contacts, const Vec3& gravity, double factor, Vec3* way) {
  *way = wayDown(contacts, gravity, factor);
  return way->norm() > kLeastWork && provesSliding(way->normalized(), contacts, gravity, factor);
}

}  // namespace

bool provesSliding(const Vec3& direction, const std::vector<Contact>& contacts,
                   const Vec3& gravity_m_per_s2, double friction_factor) {
  if (!(gravity_m_per_s2.dot(direction) > kLeastWork * gravity_m_per_s2.norm())) return false;
  return std::all_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    const double normal = direction.dot(c.normal);
    const double tangent = (direction - normal * c.normal).norm();
    return normal >= friction_factor * c.friction * tangent - kRounding;
  });
}

std::optional<SlidingProof> findSlidingProof(const std::vector<Contact>& contacts,
                                             const Vec3& gravity_m_per_s2) {
  SlidingProof proof;
  Vec3 way;
  if (!slides(contacts, gravity_m_per_s2, 1.0, &way)) return std::nullopt;
  proof.direction = way.normalized();
  proof.work_per_mass = gravity_m_per_s2.dot(proof.direction);
  proof.friction_factor_min = std::numeric_limits<double>::infinity();
  if (slides(contacts, gravity_m_per_s2, kMostFriction, &way)) return proof;
  double low = 1.0, high = kMostFriction;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = std::sqrt(low * high);
    (slides(contacts, gravity_m_per_s2, middle, &way) ? low : high) = middle;
  }
  proof.friction_factor_min = high;
  return proof;
}

}  // namespace tenter
