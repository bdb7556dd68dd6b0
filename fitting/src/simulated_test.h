// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulation_pool.h"
#include "switchable_law.h"
#include "tenter/fitting/fit_test.h"

namespace tenter {

/// A sheet with its supports, shared by all frames that lie on it alike.
struct Replica {
  SheetMesh sheet;
  SystemSetup setup;
  std::unique_ptr<SimulationPool> pool;
};

/// A solved frame and what its answers depend on.
struct SolvedFrame {
  Simulation& simulation;
  const ClothState& state;
  int frame;
  const Eigen::MatrixXd*
      dofs_by_parameter;  ///< dofs x the system's parameters; null if not asked for.
};

/// What all kinds of tests share: laws, simulations for several threads, warm starts, implicit
/// differentiation. A kind says what it simulates (addReplica, addFrame), where a frame starts and
/// what is compared.
class SimulatedTest : public FitTest {
 public:
  const Measurement& measurement() const final { return *measurement_; }
  int frameCount() const final { return static_cast<int>(frames_.size()); }
  void setParameters(const ParameterSet& parameters) final;
  void setLaws(const ClothLaws& laws) final;
  FrameOutcome evaluate(int frame, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) final;
  void accept() final;
  void restart() final;
  void reweigh() final;
  void requireProof(bool required) final { require_proof_ = required; }
  void cancelWhen(std::function<bool()> cancelled) final { cancelled_ = std::move(cancelled); }
  MultistabilityReport crossCheck(int frame) final;
  bool adoptNearerShape(int frame) final;
  FramePrediction predict(int frame, bool with_derivatives) final;
  StrainSamples strainSamples(int component) const final;

  /// One simulation of the first replica, to find out early whether the model can run on it.
  Result<void> tryReplica();

 protected:
  SimulatedTest(std::shared_ptr<const Measurement> measurement, const ClothModel& model,
                const FitTestOptions& options);

  int addReplica(SheetMesh sheet, SystemSetup setup);
  /// @param source  index into the measurement's frames.
  void addFrame(int replica, int source);

  /// The shape from which a frame starts when nothing better is known.
  virtual ClothState startState(const Simulation& simulation, int frame) const = 0;
  /// Whether startState() is what was measured, so that nearness to it tells shapes apart.
  virtual bool startIsMeasured() const { return false; }
  /// Other starts to try, in order, when that one leads nowhere.
  virtual std::vector<ClothState> otherStarts(const Simulation&, int) const { return {}; }
  /// Called once per frame with the first solved state, and again after restart() and reweigh().
  virtual void weigh(const SolvedFrame&) {}
  virtual void residualsOf(const SolvedFrame& solved, Eigen::VectorXd& residuals,
                           Eigen::MatrixXd* by_law_parameter) const = 0;
  /// Fills what is not common to all kinds; derivatives are by the system's parameters.
  virtual void fill(const SolvedFrame& solved, FramePrediction& prediction) const = 0;

  const MeasurementFrame& measured(int frame) const {
    return measurement_->frames[frames_[frame].source];
  }
  /// Null before accept() saw a converged state of the frame.
  const ClothState* acceptedState(int frame) const {
    return frames_[frame].accepted.generation >= 0 ? &frames_[frame].accepted.state : nullptr;
  }
  const Replica& replicaOf(int frame) const { return *replicas_[frames_[frame].replica]; }
  const Replica& replicaAt(int replica) const { return *replicas_[replica]; }
  const ClothModel& model() const { return *model_; }
  const FitTestOptions& options() const { return options_; }
  const StrainLaw& bendingLaw() const { return *bending_law_; }
  /// Sources of an evenly chosen subset of at most options().max_frames frames, first and last
  /// included.
  std::vector<int> chosenFrames() const;
  double forceTolerance_N =
      0.0;  ///< Of the equilibrium where the options state none; 0: the solver's own.

 private:
  /// A solved state, the parameters it belongs to, and how it moves with them.
  struct Solution {
    int generation = -1;  ///< Of the parameters' structure; -1: not solved yet.
    ClothState state;
    Eigen::VectorXd parameters;
    FrameOutcome outcome;
    Eigen::MatrixXf tangent;  ///< dofs x parameters of the system, empty if unknown.
  };
  using Curves = std::vector<ComponentCurve>;
  /// Where a frame's own start led, and the curves that it was solved with.
  struct FromStart {
    ClothState state;
    std::shared_ptr<const Curves> curves;
  };
  struct Frame {
    int replica = 0, source = 0;
    bool weighed = false;
    Solution accepted, current;
    std::optional<FromStart> from_start;
  };

  using Bases = std::vector<std::shared_ptr<const SplineBasis>>;
  void exchange(const ClothLaws& laws, Bases bases, const Eigen::VectorXd& parameters);
  EquilibriumOptions solverOptions(int max_iterations) const;
  bool isCurrent(const Solution& solution) const;
  std::vector<ClothState> warmStarts(const Simulation& simulation, const Solution& accepted) const;
  std::vector<ClothState> coldStarts(const Simulation& simulation, int frame) const;
  /// Tries the starts in order; the counts in the outcome are sums. `state` is the last one tried
  /// if none converges.
  FrameOutcome solveFrom(Simulation& simulation, std::vector<ClothState> starts, int max_iterations,
                         ClothState& state) const;
  static void polish(Simulation& simulation, ClothState& state);
  /// The equilibrium that the frame's own start leads to: followed from where it led with curves
  /// that hardly differed, otherwise found anew.
  FrameOutcome solveFromStart(Simulation& simulation, int frame, int max_iterations,
                              ClothState& state);
  void rememberStart(Frame& frame, const ClothState& state) const;
  /// Brings the frame's current solution up to date, factorised if derivatives are wanted. dofs x
  /// parameters, or empty.
  Eigen::MatrixXd solve(Simulation& simulation, int frame, bool with_derivatives,
                        FrameOutcome& outcome);

  std::shared_ptr<const Measurement> measurement_;
  const ClothModel* model_;
  FitTestOptions options_;
  std::shared_ptr<SwitchableLaw> membrane_law_, bending_law_;
  Bases bases_;
  std::shared_ptr<const Curves> curves_;  ///< Null where laws were given instead.
  bool require_proof_ = true;
  std::function<bool()> cancelled_;
  int generation_ = 0;  ///< Counts changes of the parameters' structure.
  Eigen::VectorXd parameters_;
  std::vector<std::unique_ptr<Replica>> replicas_;
  std::vector<Frame> frames_;
};

}  // namespace tenter
