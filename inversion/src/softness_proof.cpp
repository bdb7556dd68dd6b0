// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/softness_proof.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tenter/mechanics/dihedral_angle.h"

namespace tenter {
namespace {

/// Of the sum of all terms' sizes: what rounding may make of the bound.
constexpr double kRounding = 1e-9;
/// Of the motion's largest entry.
constexpr double kZero = 1e-12;
constexpr int kBisections = 12;

/// Adds the largest values that the terms of a proof can take.
class Sum {
 public:
  explicit Sum(double weight_change) : most_(1.0 + weight_change) {}
  void add(double value) {
    total_ += value;
    size_ += std::abs(value);
  }
  /// A term whose factor is what the hinge's weight or the triangle's mass may become.
  void addWeighted(double value) { add(value > 0.0 ? value * most_ : value / most_); }
  double total() const { return total_; }
  double size() const { return size_; }

 private:
  double most_, total_ = 0.0, size_ = 0.0;
};

double largest(double slope, double lower, double upper) {
  return std::max(slope * lower, slope * upper);
}

void addEdges(const SoftnessProof& proof, const InverseShell& shell, Sum& sum) {
  const auto& edges = shell.topology().edges;
  const Points3& x = shell.target().positions;
  const auto between = [](const Points3& at, const std::array<int, 2>& v) {
    return Vec3(at.col(v[1]) - at.col(v[0]));
  };
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto& ends = edges[e].vertices;
    const double k =
        shell.material().laws.membrane->evaluate(Vec3::Zero(), static_cast<int>(e)).tangent(0, 0);
    const Vec3 along = between(x, ends);
    const double length = along.norm();
    double stretched = 0.0, slope = k / length * along.dot(between(proof.motion, ends));
    for (const Points3& mode : proof.modes) {
      const Vec3 relative = between(mode, ends);
      stretched += k / length * std::pow(relative.dot(along) / length, 2);
      slope += k / length * relative.squaredNorm();
    }
    sum.add(stretched);
    sum.add(largest(slope, 1.0 / kStretchLimit - 1.0, kStretchLimit - 1.0));
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
    double bent = 0.0, slope = first.dot(gathered(proof.motion));
    for (const Points3& mode : proof.modes) {
      const Vec12 v = gathered(mode);
      bent += std::pow(first.dot(v), 2);
      slope += v.dot(second * v);
    }
    sum.addWeighted(k * (bent + largest(slope, -std::numbers::pi, std::numbers::pi)));
  }
}

void addWeight(const SoftnessProof& proof, const InverseShell& shell, Sum& sum) {
  const SheetMesh sheet = shell.sheet(shell.target().positions);
  const ShellMaterial& material = shell.material();
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    Vec3 moved = Vec3::Zero();
    for (const int v : shell.target().triangles[t]) moved += proof.motion.col(v) / 3.0;
    sum.addWeighted(-material.areal_density_kg_per_m2 * sheet.triangles[t].area_m2 *
                    material.gravity_m_per_s2.dot(moved));
  }
}

/// Whether motion and modes are what they have to be at supports.
bool isAdmissible(const SoftnessProof& proof, const InverseShell& shell,
                  const std::vector<int>& fixed, const std::vector<Contact>& contacts) {
  const int n = shell.vertexCount();
  if (proof.motion.cols() != n || !proof.motion.allFinite()) return false;
  const double zero = kZero * proof.motion.cwiseAbs().maxCoeff();
  for (const int v : fixed)
    if (!proof.motion.col(v).isZero(0.0)) return false;
  for (const Contact& c : contacts) {
    const Vec3 y = proof.motion.col(c.vertex);
    const double normal = y.dot(c.normal);
    if (normal < c.friction * (y - normal * c.normal).norm() - zero) return false;
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
