// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/softness_proof.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "tenter/mechanics/dihedral_angle.h"

namespace tenter {
namespace {

/// Of the sum of the sizes of all products, before any of them cancel: what rounding may make of
/// the bound.
constexpr double kRounding = 1e-11;
constexpr int kBisections = 12;

/// Adds the largest values that the terms of a proof can take.
class Sum {
 public:
  explicit Sum(double weight_change) : most_(1.0 + weight_change) {}
  /// @param size  of what was added up to `value`.
  void add(double value, double size) {
    total_ += value;
    size_ += size;
  }
  /// A term whose factor is what the hinge's weight or the triangle's mass may become.
  void addWeighted(double value, double size) {
    add(value > 0.0 ? value * most_ : value / most_, most_ * size);
  }
  double total() const { return total_; }
  double size() const { return size_; }

 private:
  double most_, total_ = 0.0, size_ = 0.0;
};

double largest(double slope, double lower, double upper) {
  return std::max(slope * lower, slope * upper);
}

/// What an edge's ends are moved by.
struct Ends {
  Vec3 begin, end;
  Vec3 between() const { return end - begin; }
  double size() const { return begin.norm() + end.norm(); }
};

void addEdges(const SoftnessProof& proof, const InverseShell& shell, Sum& sum) {
  const auto& edges = shell.topology().edges;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto ends = [&](const Points3& of) {
      return Ends{of.col(edges[e].vertices[0]), of.col(edges[e].vertices[1])};
    };
    const double k =
        shell.material().laws.membrane->evaluate(Vec3::Zero(), static_cast<int>(e)).tangent(0, 0);
    const Vec3 along = ends(shell.target().positions).between();
    const double length = along.norm(), per_length = k / length;
    const Ends moved = ends(proof.motion);
    double stretched = 0.0, slope = per_length * along.dot(moved.between());
    double size = k * moved.size();
    for (const Points3& mode : proof.modes) {
      const Ends v = ends(mode);
      stretched += per_length * std::pow(v.between().dot(along) / length, 2);
      slope += per_length * v.between().squaredNorm();
      size += 2.0 * per_length * v.size() * v.size();
    }
    sum.add(stretched + largest(slope, 1.0 / kStretchLimit - 1.0, kStretchLimit - 1.0), size);
  }
}

void addHinges(const SoftnessProof& proof, const InverseShell& shell, Sum& sum) {
  const Points3& x = shell.target().positions;
  const SheetMesh sheet = shell.sheet(x);
  int hinge = 0;
  for (const MeshEdge& edge : shell.topology().edges) {
    if (edge.triangles[1] < 0) continue;
    const std::array<int, 4> ids{edge.vertices[0], edge.vertices[1], edge.opposite[0],
                                 edge.opposite[1]};
    const auto gathered = [&](const Points3& of) {
      Vec12 out;
      for (int i = 0; i < 4; ++i) out.segment<3>(3 * i) = of.col(ids[i]);
      return out;
    };
    Vec12 first;
    Mat12 second;
    dihedralAngle(gathered(x), &first, &second);
    const double area =
        sheet.triangles[edge.triangles[0]].area_m2 + sheet.triangles[edge.triangles[1]].area_m2;
    const double weight = 3.0 * (x.col(ids[1]) - x.col(ids[0])).squaredNorm() / area;
    const double k =
        shell.material().laws.bending->evaluate(Vec3::Zero(), hinge++).tangent(0, 0) * weight;
    const Vec12 moved = gathered(proof.motion);
    double bent = 0.0, slope = first.dot(moved), size = first.norm() * moved.norm();
    for (const Points3& mode : proof.modes) {
      const Vec12 v = gathered(mode);
      bent += std::pow(first.dot(v), 2);
      slope += v.dot(second * v);
      size += (first.squaredNorm() + second.norm()) * v.squaredNorm();
    }
    sum.addWeighted(k * (bent + largest(slope, -std::numbers::pi, std::numbers::pi)),
                    std::numbers::pi * k * size);
  }
}

void addWeight(const SoftnessProof& proof, const InverseShell& shell, Sum& sum) {
  const SheetMesh sheet = shell.sheet(shell.target().positions);
  const ShellMaterial& material = shell.material();
  const Vec3& gravity = material.gravity_m_per_s2;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    Vec3 moved = Vec3::Zero();
    double size = 0.0;
    for (const int v : shell.target().triangles[t]) {
      moved += proof.motion.col(v) / 3.0;
      size += proof.motion.col(v).norm() / 3.0;
    }
    const double mass = material.areal_density_kg_per_m2 * sheet.triangles[t].area_m2;
    sum.addWeighted(-mass * gravity.dot(moved), mass * gravity.norm() * size);
  }
}

/// Whether motion and modes are what they have to be at supports.
bool isAdmissible(const SoftnessProof& proof, const InverseShell& shell,
                  const std::vector<int>& fixed, const std::vector<Contact>& contacts) {
  const int n = shell.vertexCount();
  if (proof.motion.cols() != n || !proof.motion.allFinite()) return false;
  for (const int v : fixed)
    if (!proof.motion.col(v).isZero(0.0)) return false;
  for (const Contact& c : contacts) {
    const Vec3 y = proof.motion.col(c.vertex);
    const double normal = y.dot(c.normal);
    if (normal < c.friction * (y - normal * c.normal).norm()) return false;
  }
  return std::ranges::all_of(proof.modes, [&](const Points3& mode) {
    if (mode.cols() != n || !mode.allFinite()) return false;
    for (const int v : fixed)
      if (!mode.col(v).isZero(0.0)) return false;
    return std::ranges::all_of(contacts,
                               [&](const Contact& c) { return mode.col(c.vertex).isZero(0.0); });
  });
}

struct Bound {
  double value = std::numeric_limits<double>::infinity();
  bool negative = false;
};

Bound measure(const SoftnessProof& proof, const InverseShell& shell, const std::vector<int>& fixed,
              const std::vector<Contact>& contacts, double weight_change) {
  if (!isAdmissible(proof, shell, fixed, contacts)) return {};
  Sum sum(weight_change);
  addEdges(proof, shell, sum);
  addHinges(proof, shell, sum);
  addWeight(proof, shell, sum);
  Bound out{sum.total(), sum.total() < -kRounding * sum.size()};
  if (proof.modes.empty()) return out;
  const Eigen::VectorXd mass = shell.mass(shell.target().positions);
  double kinetic = 0.0;
  for (const Points3& mode : proof.modes)
    kinetic += mode.colwise().squaredNorm().dot(mass.transpose());
  if (!(kinetic > 0.0)) return {};
  out.value /= kinetic;
  return out;
}

}  // namespace

double boundOf(const SoftnessProof& proof, const InverseShell& shell, const std::vector<int>& fixed,
               const std::vector<Contact>& contacts, double weight_change) {
  return measure(proof, shell, fixed, contacts, weight_change).value;
}

bool proves(const SoftnessProof& proof, const InverseShell& shell, const std::vector<int>& fixed,
            const std::vector<Contact>& contacts, double weight_change) {
  return measure(proof, shell, fixed, contacts, weight_change).negative;
}

double weightChangeOf(const SoftnessProof& proof, const InverseShell& shell,
                      const std::vector<int>& fixed, const std::vector<Contact>& contacts) {
  double holds = 0.0, fails = 1.0;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (holds + fails);
    (proves(proof, shell, fixed, contacts, middle) ? holds : fails) = middle;
  }
  return holds;
}

}  // namespace tenter
