// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/energy_terms.h"

namespace tenter {
namespace {

class GravityTerm final : public EnergyTerm {
 public:
  GravityTerm(const Eigen::VectorXd& mass, const Vec3& gravity) : force_(3, mass.size()) {
    for (Eigen::Index i = 0; i < mass.size(); ++i) force_.col(i) = mass[i] * gravity;
  }

  const std::vector<Stencil>& stencils() const override { return stencils_; }

  double energy(const Eigen::VectorXd& q) const override {
    return -flat().dot(q.head(force_.size()));
  }

  void addGradient(const Eigen::VectorXd& /*q*/, Eigen::VectorXd& gradient) const override {
    gradient.head(force_.size()) -= flat();
  }

  void addHessian(const Eigen::VectorXd& /*q*/, Projection /*projection*/,
                  HessianSink& /*sink*/) const override {}

 private:
  Eigen::Map<const Eigen::VectorXd> flat() const { return {force_.data(), force_.size()}; }

  Points3 force_;
  std::vector<Stencil> stencils_;
};

}  // namespace

std::unique_ptr<EnergyTerm> makeGravityTerm(const Eigen::VectorXd& nodal_mass_kg,
                                            const Vec3& gravity_m_per_s2) {
  return std::make_unique<GravityTerm>(nodal_mass_kg, gravity_m_per_s2);
}

Eigen::VectorXd lumpedMass(const SheetMesh& sheet, double areal_density_kg_per_m2) {
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(sheet.nodeCount());
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    const double third = areal_density_kg_per_m2 * sheet.triangles[t].area_m2 / 3.0;
    for (const int node : sheet.rest.triangles[t]) mass[node] += third;
  }
  return mass;
}

}  // namespace tenter
