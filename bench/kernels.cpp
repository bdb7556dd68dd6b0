// SPDX-License-Identifier: GPL-3.0-or-later
// What the fit spends its time on, by size: curves, assembly, factorisation, one equilibrium.
#include <benchmark/benchmark.h>

#include <cmath>

#include "tenter/mechanics/equilibrium.h"

namespace tenter {
namespace {

constexpr double kSide_m = 0.1;

std::vector<ComponentCurve> ordinaryCurves(const ClothModel& model) {
  const double stiffness[] = {1000.0, 1500.0, 60.0, 1e-5, 2e-5, 5e-6};
  std::vector<ComponentCurve> curves(model.componentCount());
  for (int c = 0; c < model.componentCount(); ++c)
    curves[c].curve = StiffnessCurve::constant(stiffness[c], model.component(c).even);
  return curves;
}

/// A square held along one edge, bending under its weight.
ClothSystem overhang(int nodes) {
  const ClothModel& model = **findClothModel("stvk");
  SheetMesh sheet = gridSheet(Vec2(kSide_m, kSide_m), nodes, nodes, DiagonalPattern::kUniform);
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = 0.2;
  for (int j = 0; j < nodes; ++j)
    for (int i = 0; i < 2; ++i) setup.fixed_nodes.push_back(sheet.grid->node(i, j));
  return std::move(
      ClothSystem::create(std::move(sheet), model, makeLaws(model, ordinaryCurves(model)), setup)
          .value());
}

void BM_Curve(benchmark::State& state) {
  const SplineBasis basis = SplineBasis::onKnots({0.0, 0.05, 0.1, 0.15, 0.2}, false);
  const StiffnessCurve curve = basis.curve(Eigen::VectorXd::LinSpaced(basis.size(), 100.0, 900.0));
  double strain = 0.0;
  for (auto _ : state) {
    strain = std::fmod(strain + 0.0137, 0.2);
    benchmark::DoNotOptimize(curve.evaluate(strain));
  }
}
BENCHMARK(BM_Curve);

void BM_Assembly(benchmark::State& state) {
  const ClothSystem system = overhang(static_cast<int>(state.range(0)));
  const ClothState rest = system.restState();
  for (auto _ : state)
    benchmark::DoNotOptimize(&system.hessian(rest, Projection::kPositiveSemiDefinite));
}
BENCHMARK(BM_Assembly)->Arg(25)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond);

void BM_AssemblyAndFactorisation(benchmark::State& state) {
  const ClothSystem system = overhang(static_cast<int>(state.range(0)));
  EquilibriumSolver solver(system);
  const ClothState rest = system.restState();
  for (auto _ : state) benchmark::DoNotOptimize(solver.factorize(rest));
}
BENCHMARK(BM_AssemblyAndFactorisation)->Arg(25)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond);

void BM_Equilibrium(benchmark::State& state) {
  const ClothSystem system = overhang(static_cast<int>(state.range(0)));
  EquilibriumSolver solver(system);
  for (auto _ : state) {
    ClothState shape = system.restState();
    const EquilibriumSummary summary = solver.solve(shape);
    state.counters["newton_steps"] = summary.newton_steps;
    state.counters["factorizations"] = summary.factorizations;
    state.counters["converged"] = summary.converged();
  }
}
BENCHMARK(BM_Equilibrium)->Arg(25)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tenter

BENCHMARK_MAIN();
