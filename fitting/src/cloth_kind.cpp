// SPDX-License-Identifier: GPL-3.0-or-later
// A tracked sheet of cloth held by clips at measured poses [Est12] sec. 3 and 5.1.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "clip_forces.h"
#include "cloth_replica.h"
#include "force_summary.h"
#include "position_residuals.h"
#include "protocol_family.h"
#include "simulated_test.h"
#include "test_kinds.h"

namespace tenter {
namespace {

/// A sheet whose lines lie on a frame's clips; frames whose clips cover the same cloth share it.
struct Grid {
  std::vector<std::string> clips;
  std::vector<ClipOutline> outlines;
  GridLines lines;
  Interpolation interpolation;
  int replica = -1;
};

/// What is known of a frame before anything is solved.
struct ClothFrame {
  int grid = 0;
  Points3 start;  ///< Nodes near the measured shape.
  ClipForces forces;
  Eigen::MatrixXd covariance;  ///< Of forces.measured, clip-pose errors included once known.
  Eigen::MatrixXd rows;        ///< Rows compared x forces.measured.
  Eigen::MatrixXd whitener;    ///< Inverse Cholesky factor of the rows' covariance, times rows.
  std::optional<PositionResiduals> positions;
};

/// A misfit beyond the noise by less than this share of it is not told from noise, and an estimate
/// that changes by less stays: weights would change in every round.
constexpr double kToldFromNoise = 0.1;

TrackedFrame tracked(const MeasurementFrame& frame, double discrepancy_m = 0.0) {
  return {frame.positions, frame.position_sigma_m, frame.valid, discrepancy_m};
}

/// Forces over all clips balance the cloth's weight whatever its stiffness: orthonormal
/// combinations of clips without their sum.
Eigen::MatrixXd withoutSum(int clips) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3 * std::max(0, clips - 1), 6 * clips);
  for (int k = 1; k < clips; ++k) {
    const double scale = 1.0 / std::sqrt(k * (k + 1.0));
    for (int clip = 0; clip <= k; ++clip)
      rows.block<3, 3>(3 * (k - 1), 6 * clip) = (clip < k ? scale : -k * scale) * Mat3::Identity();
  }
  return rows;
}

Eigen::MatrixXd everyForce(int clips) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3 * clips, 6 * clips);
  for (int clip = 0; clip < clips; ++clip) rows.block<3, 3>(3 * clip, 6 * clip).setIdentity();
  return rows;
}

class ClothTest final : public SimulatedTest {
 public:
  ClothTest(std::shared_ptr<const Measurement> m, const ClothModel& model,
            const FitTestOptions& options)
      : SimulatedTest(std::move(m), model, options), family_(protocolFamily(measurement())) {}

  /// Builds replicas and frames.
  Result<void> prepare();

  int residualCount(int frame) const override {
    const ClothFrame& f = cloth_[frame];
    return static_cast<int>(f.rows.rows()) + (f.positions ? f.positions->size() : 0);
  }
  std::vector<int> observedComponents(const ClothModel& model) const override {
    return componentsSeen(family_, model);
  }
  double constantCost() const override;
  int constantCount() const override;
  bool updateDiscrepancy() override;
  double discrepancy_m() const override { return discrepancy_m_; }

 protected:
  ClothState startState(const Simulation& simulation, int frame) const override;
  bool startIsMeasured() const override { return true; }
  void weigh(const SolvedFrame& solved) override;
  void residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                   Eigen::MatrixXd* by_law_parameter) const override;
  void fill(const SolvedFrame& solved, FramePrediction& prediction) const override;

 private:
  Result<int> gridOf(const SheetFrame& sheet, const MeasurementFrame& frame);
  Result<Grid> makeGrid(const SheetFrame& sheet, const MeasurementFrame& frame,
                        std::vector<ClipOutline> outlines);
  SystemSetup setupOf(const MeasurementFrame& frame, std::vector<std::vector<int>> held) const;
  ClothFrame makeFrame(int grid, const MeasurementFrame& frame) const;
  Points3 measuredShape(const Grid& grid, const MeasurementFrame& frame) const;
  Eigen::MatrixXd comparedRows(const Grid& grid, const MeasurementFrame& frame,
                               const ClipForces& forces) const;
  static void updateWhitener(ClothFrame& frame);
  void weighPositions();
  void fillForces(const SolvedFrame& solved, FramePrediction& prediction) const;
  void fillDrop(const SolvedFrame& solved, FramePrediction& prediction) const;

  const ProtocolFamily& family_;
  std::vector<Grid> grids_;
  std::vector<ClothFrame> cloth_;
  double discrepancy_m_ = 0.0;  ///< One for all frames; docs/fitting-tests.md.
};

Result<void> ClothTest::prepare() {
  const Result<SheetFrame> sheet = sheetFrame(*measurement().rest);
  if (!sheet) return sheet.error().in(measurement().name);
  for (const int source : chosenFrames()) {
    const MeasurementFrame& frame = measurement().frames[source];
    const Result<int> grid = gridOf(*sheet, frame);
    if (!grid) {
      Error error = grid.error().in(measurement().name);
      error.place =
          "frame " + std::to_string(source) + (error.place.empty() ? "" : ": " + error.place);
      return error;
    }
    cloth_.push_back(makeFrame(*grid, frame));
    addFrame(grids_[*grid].replica, source);
  }
  return tryReplica();
}

Result<int> ClothTest::gridOf(const SheetFrame& sheet, const MeasurementFrame& frame) {
  if (frame.clips.empty()) return badInput("", "", "no clip holds the cloth");
  std::vector<std::string> clips;
  std::vector<ClipOutline> outlines;
  for (const ClipReading& clip : frame.clips) {
    Result<ClipOutline> outline = clipOutline(clip, sheet);
    if (!outline) return outline.error();
    clips.push_back(clip.clip);
    outlines.push_back(std::move(*outline));
  }
  for (std::size_t g = 0; g < grids_.size(); ++g)
    if (grids_[g].clips == clips && grids_[g].outlines == outlines) return static_cast<int>(g);
  Result<Grid> grid = makeGrid(sheet, frame, std::move(outlines));
  if (!grid) return grid.error();
  grids_.push_back(std::move(*grid));
  return static_cast<int>(grids_.size()) - 1;
}

Result<Grid> ClothTest::makeGrid(const SheetFrame& sheet, const MeasurementFrame& frame,
                                 std::vector<ClipOutline> outlines) {
  Grid grid;
  for (const ClipReading& clip : frame.clips) grid.clips.push_back(clip.clip);
  grid.lines = replicaLines(sheet, outlines, options());
  Result<SheetMesh> mesh = replicaSheet(sheet, grid.lines, model());
  if (!mesh) return mesh.error();
  SystemSetup setup = setupOf(frame, heldNodes(grid.lines, outlines));
  grid.outlines = std::move(outlines);
  grid.interpolation = interpolation(grid.lines, sheet.vertices_m);
  grid.replica = addReplica(std::move(*mesh), std::move(setup));
  return grid;
}

SystemSetup ClothTest::setupOf(const MeasurementFrame& frame,
                               std::vector<std::vector<int>> held) const {
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = measurement().areal_density_kg_per_m2;
  setup.gravity_m_per_s2 = measurement().gravity_m_per_s2;
  for (std::size_t c = 0; c < frame.clips.size(); ++c) {
    ClipSetup clip;
    clip.id = frame.clips[c].clip;
    clip.nodes = std::move(held[c]);
    for (const ClipInfo& info : measurement().clips)
      if (info.id == clip.id) clip.mass_kg = info.mass_kg;
    setup.clips.push_back(std::move(clip));
  }
  return setup;
}

Points3 ClothTest::measuredShape(const Grid& grid, const MeasurementFrame& frame) const {
  const SheetMesh& sheet = replicaAt(grid.replica).sheet;
  Points3 nodes = sheet.rest.positions;
  std::vector<bool> held(nodes.cols(), false);
  for (std::size_t c = 0; c < frame.clips.size(); ++c)
    for (const int node : replicaAt(grid.replica).setup.clips[c].nodes) {
      nodes.col(node) = frame.clips[c].rig_from_clip * Vec3(sheet.rest.positions.col(node));
      held[node] = true;
    }
  fillMeasuredShape(grid.interpolation, tracked(frame), grid.lines, sheet.rest.positions, held,
                    nodes);
  return nodes;
}

Eigen::MatrixXd ClothTest::comparedRows(const Grid& grid, const MeasurementFrame& frame,
                                        const ClipForces& forces) const {
  const int count = static_cast<int>(forces.clips.size());
  if (family_.forces == ForceRows::kNone || count == 0) return Eigen::MatrixXd::Zero(0, 6 * count);
  if (family_.forces == ForceRows::kVector)
    return forces.all_have_cords && count > 1 ? withoutSum(count) : everyForce(count);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, 6 * count);
  for (int i = 0; i < count; ++i)
    rows.block<1, 3>(i, 6 * i) = longSide(replicaAt(grid.replica).sheet,
                                          replicaAt(grid.replica).setup.clips[forces.clips[i]],
                                          frame.clips[forces.clips[i]].rig_from_clip)
                                     .transpose();
  return rows;
}

void ClothTest::updateWhitener(ClothFrame& frame) {
  const Eigen::MatrixXd covariance = frame.rows * frame.covariance * frame.rows.transpose();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(covariance);
  frame.whitener = cholesky.matrixL().solve(frame.rows);
}

ClothFrame ClothTest::makeFrame(int grid, const MeasurementFrame& frame) const {
  ClothFrame out;
  out.grid = grid;
  out.start = measuredShape(grids_[grid], frame);
  out.forces = measuredForces(frame);
  out.covariance = out.forces.covariance;
  out.rows = comparedRows(grids_[grid], frame, out.forces);
  updateWhitener(out);
  if (family_.positions && frame.positions.cols() > 0) {
    const PositionResiduals* like = nullptr;
    if (!cloth_.empty() && cloth_.back().grid == grid && cloth_.back().positions)
      like = &*cloth_.back().positions;
    out.positions.emplace(grids_[grid].interpolation, tracked(frame), out.start, like);
  }
  return out;
}

/// Variance components by moments: mean squared misfit = mean sigma^2 + discrepancy^2.
bool ClothTest::updateDiscrepancy() {
  PositionMisfit misfit;
  for (int f = 0; f < frameCount(); ++f)
    if (const ClothState* state = acceptedState(f); state && cloth_[f].positions)
      addPositionMisfit(grids_[cloth_[f].grid].interpolation, tracked(measured(f)),
                        state->positions(static_cast<int>(cloth_[f].start.cols())), misfit);
  if (misfit.coordinates == 0) return false;
  const double excess_m2 = misfit.squares_m2 - misfit.noise_m2;
  const bool told = excess_m2 > kToldFromNoise * misfit.noise_m2;
  const double fresh_m =
      told ? std::sqrt(excess_m2 / static_cast<double>(misfit.coordinates)) : 0.0;
  if (std::abs(fresh_m - discrepancy_m_) <= kToldFromNoise * std::max(fresh_m, discrepancy_m_))
    return false;
  discrepancy_m_ = fresh_m;
  weighPositions();
  reweigh();
  return true;
}

void ClothTest::weighPositions() {
  const PositionResiduals* like = nullptr;
  int like_grid = -1;
  for (int f = 0; f < frameCount(); ++f) {
    ClothFrame& frame = cloth_[f];
    if (!frame.positions) continue;
    frame.positions.emplace(grids_[frame.grid].interpolation, tracked(measured(f), discrepancy_m_),
                            frame.start, like_grid == frame.grid ? like : nullptr);
    like = &*frame.positions;
    like_grid = frame.grid;
  }
}

double ClothTest::constantCost() const {
  double sum = 0.0;
  for (const ClothFrame& frame : cloth_)
    if (frame.positions) sum += frame.positions->constant();
  return sum;
}

int ClothTest::constantCount() const {
  int count = 0;
  for (const ClothFrame& frame : cloth_)
    if (frame.positions) count += frame.positions->constantCount();
  return count;
}

ClothState ClothTest::startState(const Simulation& simulation, int frame) const {
  ClothState state = simulation.system.restState();
  state.q.head(cloth_[frame].start.size()) = cloth_[frame].start.reshaped();
  const MeasurementFrame& m = measured(frame);
  for (std::size_t c = 0; c < m.clips.size(); ++c)
    simulation.system.setClipPose(state, static_cast<int>(c), m.clips[c].rig_from_clip);
  return state;
}

void ClothTest::weigh(const SolvedFrame& solved) {
  ClothFrame& frame = cloth_[solved.frame];
  const bool with_forces = !frame.forces.clips.empty();
  const PoseErrors errors = poseErrors(solved, measurement(), frame.forces.clips, with_forces);
  if (errors.positions.cols() == 0) return;
  if (with_forces) {
    frame.covariance = frame.forces.covariance + errors.forces * errors.forces.transpose();
    updateWhitener(frame);
  }
  if (frame.positions) frame.positions->setCommonErrors(errors.positions);
}

void ClothTest::residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                            Eigen::MatrixXd* by_law_parameter) const {
  const ClothFrame& frame = cloth_[solved.frame];
  const Eigen::Index forces = frame.rows.rows();
  residuals.resize(residualCount(solved.frame));
  if (by_law_parameter)
    by_law_parameter->resize(residuals.size(), solved.dofs_by_parameter->cols());
  if (forces > 0) {
    residuals.head(forces) =
        frame.whitener * (predictedForces(solved, frame.forces.clips) - frame.forces.measured);
    if (by_law_parameter)
      by_law_parameter->topRows(forces) =
          frame.whitener * predictedForcesByParameter(solved, frame.forces.clips);
  }
  if (!frame.positions) return;
  residuals.tail(frame.positions->size()) =
      frame.positions->residuals(solved.state.positions(static_cast<int>(frame.start.cols())));
  if (by_law_parameter)
    by_law_parameter->bottomRows(frame.positions->size()) = frame.positions->derivative(
        solved.simulation.system.positionsByDof(solved.state, *solved.dofs_by_parameter));
}

void ClothTest::fillForces(const SolvedFrame& solved, FramePrediction& prediction) const {
  const ClothFrame& frame = cloth_[solved.frame];
  const int count = static_cast<int>(frame.forces.clips.size());
  const Eigen::MatrixXd pick = everyForce(count);
  const Eigen::VectorXd predicted = predictedForces(solved, frame.forces.clips);
  prediction.measured_force_N = pick * frame.forces.measured;
  prediction.predicted_force_N = pick * predicted;
  prediction.force_sigma_N = (pick * frame.covariance * pick.transpose()).diagonal().cwiseSqrt();
  const ForceSummary summary =
      forceSummary(family_.summary, solved.simulation.system.sheet(),
                   solved.simulation.system.setup(), solved.state, frame.forces.clips);
  prediction.displacement = summary.abscissa;
  prediction.summary_measured = summary.weights.dot(frame.forces.measured);
  prediction.summary_predicted = summary.weights.dot(predicted);
  prediction.summary_sigma = std::sqrt(summary.weights.dot(frame.covariance * summary.weights));
  if (!solved.dofs_by_parameter) return;
  const Eigen::MatrixXd by_parameter = predictedForcesByParameter(solved, frame.forces.clips);
  prediction.force_by_parameter = pick * by_parameter;
  prediction.summary_by_parameter = by_parameter.transpose() * summary.weights;
}

void ClothTest::fillDrop(const SolvedFrame& solved, FramePrediction& prediction) const {
  const Grid& grid = grids_[cloth_[solved.frame].grid];
  const MeasurementFrame& frame = measured(solved.frame);
  const Vec3 down = measurement().gravity_m_per_s2.normalized();
  const Eigen::RowVectorXd nodes =
      down.transpose() *
      solved.state.positions(static_cast<int>(cloth_[solved.frame].start.cols()));
  const Eigen::VectorXd predicted = grid.interpolation * nodes.transpose();
  const TrackedFrame vertices = tracked(frame);
  double count = 0.0;
  for (Eigen::Index v = 0; v < frame.positions.cols(); ++v) {
    if (!vertices.seen(v)) continue;
    const double rest = down.dot(measurement().rest->positions.col(v));
    prediction.summary_measured += down.dot(frame.positions.col(v)) - rest;
    prediction.summary_predicted += predicted[v] - rest;
    count += 1.0;
  }
  if (count > 0.0) {
    prediction.summary_measured /= count;
    prediction.summary_predicted /= count;
  }
  // Overhang: the free area over the sample's width.
  const SheetMesh& sheet = replicaAt(grid.replica).sheet;
  std::vector<bool> held(sheet.nodeCount(), false);
  for (const ClipSetup& clip : replicaAt(grid.replica).setup.clips)
    for (const int node : clip.nodes) held[node] = true;
  double free_area = 0.0;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const Triangle& nodes_of = sheet.rest.triangles[t];
    if (!held[nodes_of[0]] || !held[nodes_of[1]] || !held[nodes_of[2]])
      free_area += sheet.triangles[t].area_m2;
  }
  prediction.displacement = free_area / std::sqrt(sheet.area());
}

void ClothTest::fill(const SolvedFrame& solved, FramePrediction& prediction) const {
  const ClothFrame& frame = cloth_[solved.frame];
  prediction.position_rms_m =
      positionRms(grids_[frame.grid].interpolation, tracked(measured(solved.frame)),
                  solved.state.positions(static_cast<int>(frame.start.cols())));
  if (frame.forces.clips.empty())
    fillDrop(solved, prediction);
  else
    fillForces(solved, prediction);
}

}  // namespace

Result<std::unique_ptr<FitTest>> makeClothTest(std::shared_ptr<const Measurement> measurement,
                                               const ClothModel& model,
                                               const FitTestOptions& options) {
  auto test = std::make_unique<ClothTest>(std::move(measurement), model, options);
  if (const Result<void> prepared = test->prepare(); !prepared.ok()) return prepared.error();
  return std::unique_ptr<FitTest>(std::move(test));
}

}  // namespace tenter
