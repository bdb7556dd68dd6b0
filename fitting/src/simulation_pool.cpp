// SPDX-License-Identifier: GPL-3.0-or-later
#include "simulation_pool.h"

namespace tenter {

Result<SimulationPool::Lease> SimulationPool::lease() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<Simulation> simulation = std::move(idle_.back());
      idle_.pop_back();
      return Lease(*this, std::move(simulation));
    }
  }
  Result<ClothSystem> system = factory_();
  if (!system) return system.error();
  return Lease(*this, std::make_unique<Simulation>(std::move(*system)));
}

void SimulationPool::clear() {
  const std::lock_guard lock(mutex_);
  idle_.clear();
}

void SimulationPool::put(std::unique_ptr<Simulation> simulation) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(simulation));
}

}  // namespace tenter
