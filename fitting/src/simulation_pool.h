// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "tenter/mechanics/cloth_system.h"
#include "tenter/mechanics/equilibrium.h"

namespace tenter {

/// A system with its solver; serves one thread at a time.
struct Simulation {
  explicit Simulation(ClothSystem s) : system(std::move(s)), solver(system) {}
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  ClothSystem system;
  EquilibriumSolver solver;
};

/// Simulations of one replica, built on demand and handed out to threads one at a time.
class SimulationPool {
 public:
  using Factory = std::function<Result<ClothSystem>()>;

  /// Gives its simulation back at the end of the scope.
  class Lease {
   public:
    Lease(SimulationPool& pool, std::unique_ptr<Simulation> simulation)
        : pool_(&pool), simulation_(std::move(simulation)) {}
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Lease(Lease&&) noexcept = default;
    Lease& operator=(Lease&&) = delete;
    ~Lease() {
      if (simulation_) pool_->put(std::move(simulation_));
    }
    Simulation& operator*() const { return *simulation_; }
    Simulation* operator->() const { return simulation_.get(); }

   private:
    SimulationPool* pool_;
    std::unique_ptr<Simulation> simulation_;
  };

  explicit SimulationPool(Factory factory) : factory_(std::move(factory)) {}

  /// Error only if the first simulation cannot be built; the others are built as the first was.
  Result<Lease> lease();

  /// Forgets the simulations; none may be out.
  void clear();

 private:
  void put(std::unique_ptr<Simulation> simulation);

  Factory factory_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Simulation>> idle_;
};

}  // namespace tenter
