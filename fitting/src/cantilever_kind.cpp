// SPDX-License-Identifier: GPL-3.0-or-later
// A strip clamped horizontally that hangs under its own weight: two residuals a frame, reach and
// drop of the tip.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "hanging_curve.h"
#include "simulated_test.h"
#include "strip_sheet.h"
#include "test_kinds.h"

namespace tenter {
namespace {

constexpr int kMinNodesAlong = 33;
constexpr int kMaxNodesAcross = 9;
/// Columns of nodes behind the clamp line: the hinges on the line need a rigid neighbour, ring-2
/// springs two.
constexpr int kStubColumns = 2;
/// Of the length, where the measurement states no width: wide enough that the free sides do not
/// matter.
constexpr double kWidthOfLength = 1.0 / 3.0;

class CantileverTest final : public SimulatedTest {
 public:
  CantileverTest(std::shared_ptr<const Measurement> m, const ClothModel& model,
                 const FitTestOptions& options, StripSheet strip);

  int residualCount(int /*frame*/) const override { return 2; }
  std::vector<int> observedComponents(const ClothModel& model) const override;

 protected:
  ClothState startState(const Simulation& simulation, int frame) const override;
  std::vector<ClothState> otherStarts(const Simulation& simulation, int frame) const override;
  void residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                   Eigen::MatrixXd* by_law_parameter) const override;
  void fill(const SolvedFrame& solved, FramePrediction& prediction) const override;

 private:
  /// (reach, drop) of a displacement or position.
  Eigen::Matrix<double, 2, 3> tipDirections() const {
    Eigen::Matrix<double, 2, 3> directions;
    directions << along_.transpose(), -Vec3::UnitZ().transpose();
    return directions;
  }
  Vec2 tip(const ClothState& state) const;
  double sigma(int frame) const {
    const double own = measured(frame).tip_sigma_m;
    return own > 0.0 ? own : options().cantilever_sigma_m;
  }
  BendingResponse response(double kappa) const;
  ClothState hanging(const Simulation& simulation, double weight_factor) const;

  Eigen::VectorXd s_;
  Vec3 along_;
  std::vector<int> tip_nodes_;
  double spacing_m_;
};

CantileverTest::CantileverTest(std::shared_ptr<const Measurement> shared, const ClothModel& model,
                               const FitTestOptions& options, StripSheet strip)
    : SimulatedTest(std::move(shared), model, options),
      s_(strip.s),
      along_(strip.along),
      tip_nodes_(strip.nodesBetween(measurement().cantilever->length_m,
                                    measurement().cantilever->length_m)),
      spacing_m_(-strip.s.minCoeff() / kStubColumns) {
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = measurement().areal_density_kg_per_m2;
  setup.gravity_m_per_s2 = Vec3(0.0, 0.0, -measurement().gravity_m_per_s2.norm());
  setup.clips.resize(1);
  setup.clips[0].id = "clamp";
  setup.clips[0].nodes = strip.nodesBetween(s_.minCoeff(), 0.0);
  const int replica = addReplica(std::move(strip.sheet), std::move(setup));
  for (const int source : chosenFrames()) addFrame(replica, source);
}

std::vector<int> CantileverTest::observedComponents(const ClothModel& model) const {
  std::vector<int> seen;
  const auto see = [&](double share, std::string_view name) {
    const int index = model.componentIndex(name);
    if (share > 1e-6 && index >= 0) seen.push_back(index);
  };
  see(std::abs(along_.x()), "bend_weft");
  see(std::abs(along_.y()), "bend_warp");
  const bool diagonal_springs = model.bending == BendingElement::kSprings;
  see(diagonal_springs ? 1.0 : std::abs(along_.x() * along_.y()), "bend_diagonal");
  return seen;
}

/// Of the strip bent about its width.
BendingResponse CantileverTest::response(double kappa) const {
  const double c = along_.x(), s = along_.y();
  if (model().bending != BendingElement::kSprings) {
    const Vec3 direction(c * c, s * s, 2.0 * c * s);
    const LawValue law = bendingLaw().evaluate(kappa * direction, 0);
    return {law.energy, law.stress.dot(direction), direction.dot(law.tangent * direction)};
  }
  // A spring to the second neighbour, two steps h long, of a polygon with turns kappa h.
  const double h = spacing_m_, bend = kappa * h;
  const Vec3 share(c * c, s * s, 0.0);
  const LawValue law = bendingLaw().evaluate(-0.125 * bend * bend * share, 0);
  const double stress = law.stress.dot(share), tangent = share.dot(law.tangent * share);
  return {law.energy, -0.25 * stress * bend * h,
          tangent * std::pow(0.25 * bend * h, 2) - 0.25 * stress * h * h};
}

ClothState CantileverTest::hanging(const Simulation& simulation, double weight_factor) const {
  const double length_m = measurement().cantilever->length_m;
  const double weight_N_per_m2 =
      weight_factor * measurement().areal_density_kg_per_m2 * measurement().gravity_m_per_s2.norm();
  const std::vector<double> angles =
      hangingAngles(length_m, weight_N_per_m2, 4 * kMinNodesAlong,
                    [this](double kappa) { return response(kappa); });
  ClothState state = simulation.system.restState();
  const Points3& rest = simulation.system.sheet().rest.positions;
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    if (s_[i] <= 0.0) continue;
    const Vec2 point = pointOnCurve(angles, length_m, s_[i]);
    state.q.segment<3>(3 * i) =
        rest.col(i) + (point.x() - s_[i]) * along_ - point.y() * Vec3::UnitZ();
  }
  return state;
}

ClothState CantileverTest::startState(const Simulation& simulation, int /*frame*/) const {
  return hanging(simulation, 1.0);
}

std::vector<ClothState> CantileverTest::otherStarts(const Simulation& simulation,
                                                    int /*frame*/) const {
  return {hanging(simulation, 0.5), hanging(simulation, 2.0), hanging(simulation, 0.05)};
}

Vec2 CantileverTest::tip(const ClothState& state) const {
  Vec2 sum = Vec2::Zero();
  for (const int node : tip_nodes_) sum += tipDirections() * state.q.segment<3>(3 * node);
  return sum / static_cast<double>(tip_nodes_.size());
}

void CantileverTest::residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                                 Eigen::MatrixXd* by_law_parameter) const {
  const MeasurementFrame& frame = measured(solved.frame);
  residuals = (tip(solved.state) - Vec2(frame.reach_m, frame.drop_m)) / sigma(solved.frame);
  if (!by_law_parameter) return;
  const Eigen::MatrixXd positions =
      solved.simulation.system.positionsByDof(solved.state, *solved.dofs_by_parameter);
  by_law_parameter->setZero(2, positions.cols());
  const double share = 1.0 / (static_cast<double>(tip_nodes_.size()) * sigma(solved.frame));
  for (const int node : tip_nodes_)
    *by_law_parameter += share * tipDirections() * positions.middleRows<3>(3 * node);
}

void CantileverTest::fill(const SolvedFrame& solved, FramePrediction& prediction) const {
  const MeasurementFrame& frame = measured(solved.frame);
  const Vec2 predicted = tip(solved.state);
  prediction.displacement = measurement().cantilever->length_m;
  prediction.position_rms_m = (predicted - Vec2(frame.reach_m, frame.drop_m)).norm();
  prediction.summary_measured = frame.drop_m;
  prediction.summary_predicted = predicted.y();
  prediction.summary_sigma = sigma(solved.frame);
}

}  // namespace

Result<std::unique_ptr<FitTest>> makeCantileverTest(std::shared_ptr<const Measurement> measurement,
                                                    const ClothModel& model,
                                                    const FitTestOptions& options) {
  const Measurement& m = *measurement;
  const CantileverSetup& setup = *m.cantilever;
  if (!(setup.length_m > 0.0))
    return badInput(m.name, "cantilever.length_m", "the strip has no length");
  if (!(m.areal_density_kg_per_m2 > 0.0))
    return badInput(m.name, "areal_density_kg_per_m2",
                    "a cantilever bends under its weight, which is not stated");
  const int elements = std::max(kMinNodesAlong, options.nodes) - 1;
  const double spacing_m = setup.length_m / elements;
  const double width_m = setup.width_m > 0.0 ? setup.width_m : kWidthOfLength * setup.length_m;
  const int across =
      std::clamp(static_cast<int>(std::lround(width_m / spacing_m)) + 1, 3, kMaxNodesAcross);
  std::vector<double> along = equalLines(0.0, setup.length_m, elements);
  for (int i = 1; i <= kStubColumns; ++i) along.insert(along.begin(), -i * spacing_m);
  Result<StripSheet> strip =
      makeStrip(model, along, equalLines(-0.5 * width_m, 0.5 * width_m, across - 1),
                setup.angle_rad, options.diagonals);
  if (!strip) return strip.error().in(m.name);
  auto test =
      std::make_unique<CantileverTest>(std::move(measurement), model, options, std::move(*strip));
  if (const Result<void> tried = test->tryReplica(); !tried.ok()) return tried.error();
  return std::unique_ptr<FitTest>(std::move(test));
}

}  // namespace tenter
