// SPDX-License-Identifier: GPL-3.0-or-later
// A strip between two clamps, pulled along its length: one residual a frame, the axial force.
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulated_test.h"
#include "strip_sheet.h"
#include "test_kinds.h"

namespace tenter {
namespace {

/// Nodes across the strip: more for short ones, whose clamps matter more. With square elements the
/// force at 45 degrees is then within 2e-3 of the mesh's limit (tensile_kind_test).
int nodesAcross(double width_over_length) {
  constexpr int kLongStrip = 4, kShortStrip = 13;
  constexpr double kMoreNodes = 24.0;
  return std::clamp(kLongStrip + static_cast<int>(std::lround(kMoreNodes * width_over_length)),
                    kLongStrip, kShortStrip);
}
/// Elements along the strip at most, for strips that are threads.
constexpr int kMaxElementsAlong = 400;
/// Equilibrium of a strip, of its largest measured force.
constexpr double kRelativeForceTolerance = 1e-9;
/// An angle this near to a yarn shows that yarn alone.
constexpr double kAlongYarn = 1e-6;

enum Clamp { kFixedClamp, kMovingClamp };

class TensileTest final : public SimulatedTest {
 public:
  TensileTest(std::shared_ptr<const Measurement> m, const ClothModel& model,
              const FitTestOptions& options, StripSheet strip);

  int residualCount(int /*frame*/) const override { return 1; }
  std::vector<int> observedComponents(const ClothModel& model) const override;

 protected:
  ClothState startState(const Simulation& simulation, int frame) const override;
  std::vector<ClothState> otherStarts(const Simulation& simulation, int frame) const override;
  void residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                   Eigen::MatrixXd* by_law_parameter) const override;
  void fill(const SolvedFrame& solved, FramePrediction& prediction) const override;

 private:
  double stretch(int frame) const {
    return measured(frame).displacement_m + measurement().tensile->zero_offset_m;
  }
  double sigma(int frame) const {
    const double own = measured(frame).force_sigma_N;
    return own > 0.0 ? own : default_sigma_N_;
  }
  double force(const SolvedFrame& solved) const;
  Eigen::RowVectorXd forceByParameter(const SolvedFrame& solved) const;
  ClothState stretched(const Simulation& simulation, int frame, double contraction) const;

  Eigen::VectorXd s_;
  Vec3 along_, across_;
  double rest_length_m_;
  double default_sigma_N_;
};

TensileTest::TensileTest(std::shared_ptr<const Measurement> shared, const ClothModel& model,
                         const FitTestOptions& options, StripSheet strip)
    : SimulatedTest(std::move(shared), model, options),
      s_(strip.s),
      along_(strip.along),
      across_(strip.across),
      rest_length_m_(strip.s.maxCoeff() - strip.s.minCoeff()) {
  double largest_N = 0.0;
  for (const MeasurementFrame& frame : measurement().frames)
    largest_N = std::max(largest_N, std::abs(frame.force_N));
  // A file of zeros still needs a scale; its fit is meaningless but must not divide by zero.
  largest_N = std::max(largest_N, 1e-6);
  default_sigma_N_ = options.tensile_sigma_rel * largest_N;
  forceTolerance_N = kRelativeForceTolerance * largest_N / measurement().tensile->strips;

  SystemSetup setup;
  setup.areal_density_kg_per_m2 = measurement().areal_density_kg_per_m2;
  setup.gravity_m_per_s2 = Vec3::Zero();
  setup.planar = true;
  setup.clips.resize(2);
  setup.clips[kFixedClamp].id = "fixed";
  setup.clips[kFixedClamp].nodes = strip.nodesBetween(0.0, 0.0);
  setup.clips[kMovingClamp].id = "moving";
  setup.clips[kMovingClamp].nodes = strip.nodesBetween(rest_length_m_, rest_length_m_);
  const int replica = addReplica(std::move(strip.sheet), std::move(setup));
  for (const int source : chosenFrames()) addFrame(replica, source);
}

std::vector<int> TensileTest::observedComponents(const ClothModel& model) const {
  const bool along_weft = std::abs(along_.y()) < kAlongYarn,
             along_warp = std::abs(along_.x()) < kAlongYarn;
  std::vector<int> seen;
  const auto see = [&](std::string_view name) {
    if (const int index = model.componentIndex(name); index >= 0) seen.push_back(index);
  };
  if (!along_warp) see("stretch_weft");
  if (!along_weft) see("stretch_warp");
  // Springs on the diagonals lengthen with the yarns; triangles do not shear then.
  if ((!along_weft && !along_warp) || model.needs_grid) see("shear");
  see("poisson");
  if (!along_weft && !along_warp) see("cross_stiffening");
  return seen;
}

ClothState TensileTest::stretched(const Simulation& simulation, int frame,
                                  double contraction) const {
  ClothState state = simulation.system.restState();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = stretch(frame) * along_;
  const Points3& rest = replicaOf(frame).sheet.rest.positions;
  const Vec3 middle = 0.5 * (rest.rowwise().maxCoeff() + rest.rowwise().minCoeff());
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const double lateral = (rest.col(i) - middle).dot(across_);
    state.q.segment<3>(3 * i) = rest.col(i) + stretch(frame) * s_[i] / rest_length_m_ * along_ -
                                contraction * stretch(frame) / rest_length_m_ * lateral * across_;
  }
  simulation.system.setClipPose(state, kFixedClamp, Eigen::Isometry3d::Identity());
  simulation.system.setClipPose(state, kMovingClamp, pose);
  return state;
}

ClothState TensileTest::startState(const Simulation& simulation, int frame) const {
  return stretched(simulation, frame, 0.0);
}

std::vector<ClothState> TensileTest::otherStarts(const Simulation& simulation, int frame) const {
  return {stretched(simulation, frame, 0.5), stretched(simulation, frame, 1.0)};
}

double TensileTest::force(const SolvedFrame& solved) const {
  return -measurement().tensile->strips *
         along_.dot(solved.simulation.system.clipWrench(solved.state, kMovingClamp).force_N);
}

Eigen::RowVectorXd TensileTest::forceByParameter(const SolvedFrame& solved) const {
  const Eigen::MatrixXd wrench = solved.simulation.system.clipWrenchByParameter(
      solved.state, kMovingClamp, *solved.dofs_by_parameter);
  return -measurement().tensile->strips * along_.transpose() * wrench.topRows<3>();
}

void TensileTest::residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                              Eigen::MatrixXd* by_law_parameter) const {
  residuals.resize(1);
  residuals[0] = (force(solved) - measured(solved.frame).force_N) / sigma(solved.frame);
  if (by_law_parameter) *by_law_parameter = forceByParameter(solved) / sigma(solved.frame);
}

void TensileTest::fill(const SolvedFrame& solved, FramePrediction& prediction) const {
  const int frame = solved.frame;
  prediction.displacement = stretch(frame) / rest_length_m_;
  prediction.summary_measured = measured(frame).force_N;
  prediction.summary_predicted = force(solved);
  prediction.summary_sigma = sigma(frame);
  prediction.measured_force_N.setConstant(1, prediction.summary_measured);
  prediction.predicted_force_N.setConstant(1, prediction.summary_predicted);
  prediction.force_sigma_N.setConstant(1, prediction.summary_sigma);
  prediction.position_rms_m = std::numeric_limits<double>::quiet_NaN();
  if (!solved.dofs_by_parameter) return;
  prediction.force_by_parameter = forceByParameter(solved);
  prediction.summary_by_parameter = prediction.force_by_parameter.row(0);
}

}  // namespace

Result<std::unique_ptr<FitTest>> makeTensileTest(std::shared_ptr<const Measurement> measurement,
                                                 const ClothModel& model,
                                                 const FitTestOptions& options) {
  const Measurement& m = *measurement;
  const TensileSetup& setup = *m.tensile;
  const double rest_length_m = setup.length_m - setup.zero_offset_m;
  if (!(rest_length_m > 0.0) || !(setup.width_m > 0.0) || setup.strips < 1)
    return badInput(m.name, "tensile", "the strip has no size",
                    "length less the stretch at displacement 0, width and count must be positive");
  const int across = nodesAcross(setup.width_m / rest_length_m);
  const double element_m = setup.width_m / (across - 1);
  const int elements = static_cast<int>(
      std::clamp(std::round(rest_length_m / element_m), 4.0, double{kMaxElementsAlong}));
  Result<StripSheet> strip =
      makeStrip(model, equalLines(0.0, rest_length_m, elements),
                equalLines(-0.5 * setup.width_m, 0.5 * setup.width_m, across - 1), setup.angle_rad,
                DiagonalPattern::kAlternating);
  if (!strip) return strip.error().in(m.name);
  auto test =
      std::make_unique<TensileTest>(std::move(measurement), model, options, std::move(*strip));
  if (const Result<void> tried = test->tryReplica(); !tried.ok()) return tried.error();
  return std::unique_ptr<FitTest>(std::move(test));
}

}  // namespace tenter
