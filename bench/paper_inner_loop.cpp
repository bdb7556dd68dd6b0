// SPDX-License-Identifier: GPL-3.0-or-later
#include "paper_inner_loop.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "cloth_replica.h"
#include "position_residuals.h"
#include "simulation_pool.h"
#include "switchable_law.h"

namespace tenter::bench {
namespace {

constexpr double kForceTolerance_N = 10e-6;  // [Est12] sec. 5.1.
constexpr int kMaxSteps = 2000;
/// Accuracy of the linear solves; [Est12] gives none. Looser ones need more steps.
constexpr double kLinearTolerance = 1e-6;
constexpr double kFirstDamping = 1e-3;  // Of the mean diagonal.
constexpr double kLeastDamping = 1e-9, kMostDamping = 1e9;

using Sparse = Eigen::SparseMatrix<double>;
using ConjugateGradient =
    Eigen::ConjugateGradient<Sparse, Eigen::Lower, Eigen::DiagonalPreconditioner<double>>;

double threadSeconds() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Sparse damped(const SparseLower& lower, double damping) {
  const Eigen::Map<const Sparse> view(
      lower.size, lower.size, static_cast<Eigen::Index>(lower.value.size()),
      lower.column_begin.data(), lower.row.data(), lower.value.data());
  Sparse matrix = view;
  for (int i = 0; i < lower.size; ++i) matrix.coeffRef(i, i) += damping;
  return matrix;
}

double meanDiagonal(const SparseLower& lower) {
  double sum = 0.0;
  for (int i = 0; i < lower.size; ++i) sum += std::abs(lower.value[lower.column_begin[i]]);
  return sum / lower.size;
}

/// Additive Levenberg-Marquardt: (dF/dx + mu I) step = F, mu down when the force shrinks and up
/// when it does not.
struct PaperSolve {
  bool converged = false;
  double damping = 0.0;
  long steps = 0, gradient_steps = 0;
};

PaperSolve paperEquilibrium(const ClothSystem& system, ClothState& state) {
  PaperSolve solve;
  Eigen::VectorXd gradient, trial_gradient;
  system.gradient(state, gradient);
  const double scale = meanDiagonal(system.hessian(state, Projection::kNone));
  double relative = kFirstDamping;
  while (solve.steps < kMaxSteps && gradient.norm() >= kForceTolerance_N) {
    const SparseLower& hessian = system.hessian(state, Projection::kNone);
    bool shrunk = false;
    for (; !shrunk && relative < kMostDamping; ++solve.steps) {
      const Sparse matrix = damped(hessian, relative * scale);
      ConjugateGradient linear(matrix);
      linear.setTolerance(kLinearTolerance);
      const Eigen::VectorXd step = linear.solve(-gradient);
      solve.gradient_steps += linear.iterations();
      ClothState trial = state;
      system.advance(trial, step, 1.0);
      system.gradient(trial, trial_gradient);
      shrunk = trial_gradient.allFinite() && trial_gradient.norm() < gradient.norm();
      relative = shrunk ? std::max(kLeastDamping, 0.1 * relative) : 10.0 * relative;
      if (!shrunk) continue;
      state = std::move(trial);
      gradient.swap(trial_gradient);
    }
    if (!shrunk) break;
  }
  solve.converged = gradient.norm() < kForceTolerance_N;
  solve.damping = relative * scale;
  return solve;
}

/// [Est12] eq. 7, one conjugate-gradient solve a parameter, on the damped matrix as the paper says.
long paperDerivatives(const ClothSystem& system, const ClothState& state, double damping) {
  Eigen::MatrixXd by_parameter;
  system.gradientByParameter(state, by_parameter);
  const Sparse matrix = damped(system.hessian(state, Projection::kNone), damping);
  ConjugateGradient linear(matrix);
  linear.setTolerance(kLinearTolerance);
  long iterations = 0;
  Eigen::VectorXd moved;
  for (Eigen::Index p = 0; p < by_parameter.cols(); ++p) {
    moved = linear.solve(by_parameter.col(p));
    iterations += linear.iterations();
  }
  return iterations;
}

class PaperTest final : public FitTest {
 public:
  PaperTest(std::unique_ptr<FitTest> judge, PaperCounts& counts)
      : judge_(std::move(judge)), counts_(counts) {}

  Result<void> prepare(const Measurement& m, const ClothModel& model,
                       const FitTestOptions& options);

  const Measurement& measurement() const override { return judge_->measurement(); }
  int frameCount() const override { return judge_->frameCount(); }
  int residualCount(int frame) const override { return judge_->residualCount(frame); }
  std::vector<int> observedComponents(const ClothModel& model) const override {
    return judge_->observedComponents(model);
  }
  void setParameters(const ParameterSet& parameters) override;
  FrameOutcome evaluate(int frame, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) override;
  void accept() override { judge_->accept(); }
  void restart() override { judge_->restart(); }
  void reweigh() override { judge_->reweigh(); }
  FramePrediction predict(int frame, bool with_derivatives) override {
    return judge_->predict(frame, with_derivatives);
  }
  StrainSamples strainSamples(int component) const override {
    return judge_->strainSamples(component);
  }

 private:
  struct Grid {
    std::vector<std::string> clips;
    std::vector<ClipOutline> outlines;
    std::unique_ptr<SimulationPool> pool;
  };
  struct Frame {
    int grid = 0;
    Points3 start;
  };
  Result<Frame> makeFrame(const SheetFrame& sheet, const Measurement& m, const ClothModel& model,
                          const MeasurementFrame& frame, const FitTestOptions& options);

  std::unique_ptr<FitTest> judge_;
  PaperCounts& counts_;
  std::shared_ptr<SwitchableLaw> membrane_, bending_;
  std::vector<Grid> grids_;
  std::vector<Frame> frames_;
};

Result<PaperTest::Frame> PaperTest::makeFrame(const SheetFrame& sheet, const Measurement& m,
                                              const ClothModel& model,
                                              const MeasurementFrame& frame,
                                              const FitTestOptions& options) {
  std::vector<std::string> clips;
  std::vector<ClipOutline> outlines;
  for (const ClipReading& clip : frame.clips) {
    Result<ClipOutline> outline = clipOutline(clip, sheet);
    if (!outline) return outline.error();
    clips.push_back(clip.clip);
    outlines.push_back(std::move(*outline));
  }
  const GridLines lines = replicaLines(sheet, outlines, options);
  Result<SheetMesh> mesh = replicaSheet(sheet, lines, model);
  if (!mesh) return mesh.error();
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = m.areal_density_kg_per_m2;
  setup.gravity_m_per_s2 = m.gravity_m_per_s2;
  const std::vector<std::vector<int>> held = heldNodes(lines, outlines);
  Frame out{.grid = -1, .start = mesh->rest.positions};
  std::vector<bool> is_held(mesh->nodeCount(), false);
  for (std::size_t c = 0; c < clips.size(); ++c) {
    ClipSetup clip;
    clip.id = clips[c];
    clip.nodes = held[c];
    for (const int node : held[c]) {
      out.start.col(node) = frame.clips[c].rig_from_clip * Vec3(mesh->rest.positions.col(node));
      is_held[node] = true;
    }
    setup.clips.push_back(std::move(clip));
  }
  const TrackedFrame tracked{frame.positions, frame.position_sigma_m, frame.valid};
  fillMeasuredShape(interpolation(lines, sheet.vertices_m), tracked, lines, mesh->rest.positions,
                    is_held, out.start);
  for (std::size_t g = 0; g < grids_.size(); ++g)
    if (grids_[g].clips == clips && grids_[g].outlines == outlines) out.grid = static_cast<int>(g);
  if (out.grid >= 0) return out;
  const ClothLaws laws{membrane_, bending_};
  auto factory = [sheet_mesh = std::move(*mesh), &model, laws, setup] {
    return ClothSystem::create(sheet_mesh, model, laws, setup);
  };
  out.grid = static_cast<int>(grids_.size());
  grids_.push_back({clips, outlines, std::make_unique<SimulationPool>(std::move(factory))});
  return out;
}

Result<void> PaperTest::prepare(const Measurement& m, const ClothModel& model,
                                const FitTestOptions& options) {
  const ClothLaws any = makeLaws(model, std::vector<ComponentCurve>(model.componentCount()));
  membrane_ = std::make_shared<SwitchableLaw>(any.membrane);
  bending_ = std::make_shared<SwitchableLaw>(any.bending);
  const Result<SheetFrame> sheet = sheetFrame(*m.rest);
  if (!sheet) return sheet.error();
  for (const MeasurementFrame& frame : m.frames) {
    Result<Frame> made = makeFrame(*sheet, m, model, frame, options);
    if (!made) return made.error();
    frames_.push_back(std::move(*made));
  }
  return {};
}

void PaperTest::setParameters(const ParameterSet& parameters) {
  judge_->setParameters(parameters);
  const ClothLaws laws = makeLaws(*parameters.model, parameters.components);
  membrane_->set(laws.membrane);
  bending_->set(laws.bending);
  // The number of parameters may have changed, and systems ask for it once.
  for (Grid& grid : grids_) grid.pool->clear();
}

FrameOutcome PaperTest::evaluate(int frame, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) {
  {
    Result<SimulationPool::Lease> lease = grids_[frames_[frame].grid].pool->lease();
    require(lease.ok(), "a replica that was built once is built again");
    const ClothSystem& system = (*lease)->system;
    ClothState state = system.restState();
    state.q.head(frames_[frame].start.size()) = frames_[frame].start.reshaped();
    const MeasurementFrame& measured = measurement().frames[frame];
    for (std::size_t c = 0; c < measured.clips.size(); ++c)
      system.setClipPose(state, static_cast<int>(c), measured.clips[c].rig_from_clip);
    const double begin = threadSeconds();
    const PaperSolve solve = paperEquilibrium(system, state);
    counts_.gradient_steps +=
        solve.gradient_steps + (jacobian ? paperDerivatives(system, state, solve.damping) : 0);
    counts_.cpu_seconds += threadSeconds() - begin;
    counts_.steps += solve.steps;
    ++counts_.equilibria;
    if (!solve.converged) ++counts_.unconverged;
  }
  return judge_->evaluate(frame, residuals, jacobian);
}

}  // namespace

Result<std::unique_ptr<FitTest>> makePaperTest(const Measurement& measurement,
                                               const ClothModel& model,
                                               const FitTestOptions& options,
                                               std::unique_ptr<FitTest> judge,
                                               PaperCounts& counts) {
  auto test = std::make_unique<PaperTest>(std::move(judge), counts);
  if (const Result<void> ready = test->prepare(measurement, model, options); !ready.ok())
    return ready.error();
  return std::unique_ptr<FitTest>(std::move(test));
}

}  // namespace tenter::bench
