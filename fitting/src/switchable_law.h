// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <utility>

#include "tenter/mechanics/strain_law.h"

namespace tenter {

/// A law that can be exchanged under the simulations that hold it, so that a fit need not build
/// them anew whenever a parameter moves. Exchange only while no simulation runs.
class SwitchableLaw final : public StrainLaw {
 public:
  explicit SwitchableLaw(std::shared_ptr<const StrainLaw> law) : law_(std::move(law)) {}
  void set(std::shared_ptr<const StrainLaw> law) { law_ = std::move(law); }

  LawValue evaluate(const Vec3& strain, int element) const override {
    return law_->evaluate(strain, element);
  }
  int parameterCount() const override { return law_->parameterCount(); }
  void stressByParameter(const Vec3& strain,
                         Eigen::Ref<Eigen::Matrix3Xd> derivative) const override {
    law_->stressByParameter(strain, derivative);
  }

 private:
  std::shared_ptr<const StrainLaw> law_;
};

}  // namespace tenter
