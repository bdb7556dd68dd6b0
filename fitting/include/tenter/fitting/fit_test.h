// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// A model with one curve a component; those with a basis are what a fit moves.
struct ParameterSet {
  const ClothModel* model = nullptr;
  std::vector<ComponentCurve> components;  ///< In the registry's order.

  int size() const;  ///< All coefficients of all bases, concatenated in component order.
  int offset(int component) const;  ///< First coefficient of a component.
  Eigen::VectorXd coefficients() const;
  void setCoefficients(const Eigen::VectorXd& coefficients);  ///< Rebuilds the curves.
};

/// How a measurement is turned into a simulation.
struct FitTestOptions {
  int nodes = 25;  ///< Per side of the cloth replica ([Est12] sec. 5.1).
  DiagonalPattern diagonals = DiagonalPattern::kUniform;
  int max_frames = 0;                  ///< Evenly chosen subset of the frames; 0: all.
  double cantilever_sigma_m = 0.5e-3;  ///< Where the measurement states none.
  double tensile_sigma_rel = 0.002;    ///< Of the largest force, where the measurement states none.
  double equilibrium_tolerance_N = 0.0;  ///< 0: the solver's default.
};

/// What became of one frame.
struct FrameOutcome {
  bool converged = false;
  bool stable = false;
  bool proven = false;     ///< Stability was seen at the state itself, not at one near by.
  bool cancelled = false;  ///< Stopped on the way (FitTest::cancelWhen): nothing is known of it.
  int newton_steps = 0;
  int factorizations = 0;
  std::string problem;  ///< Empty when all is well.
};

/// Prediction against measurement of one frame, for reports. Vectors are stacked over clips (or
/// axial for a strip).
struct FramePrediction {
  double time_s = 0.0;
  Branch branch = Branch::kUnknown;
  double displacement =
      0.0;  ///< Test's own abscissa: mean strain, shear angle [rad], overhang [m] ...
  Eigen::VectorXd measured_force_N,
      predicted_force_N;          ///< Empty without forces; 3 a clip, or 1 for a strip.
  Eigen::VectorXd force_sigma_N;  ///< Measurement's, same size.
  double position_rms_m =
      0.0;  ///< NaN without positions. Vector error, root mean square over valid vertices.
  double summary_measured = 0.0,
         summary_predicted =
             0.0;              ///< The paper's force summaries (Fig. 7): axial force, torque, ...
  double summary_sigma = 0.0;  ///< Standard deviation of summary_measured; 0 if not known.
  Eigen::VectorXd summary_by_parameter;  ///< ParameterSet::size(); empty if not asked for, or if
                                         ///< there are no forces.
  Points3 predicted_positions;           ///< Simulation nodes, for pictures.
  Eigen::MatrixXd force_by_parameter;  ///< rows as predicted_force_N, columns ParameterSet::size();
                                       ///< empty if not asked for.
  FrameOutcome outcome;
};

/// The same frame solved again from the measured shape: several stable shapes of the same cloth
/// exist ([Est12] sec. 6).
struct MultistabilityReport {
  bool checked = false;         ///< False when either solve failed, or nothing was solved yet.
  bool disagrees = false;       ///< Positions differ by more than 1e-3 of the sample's diagonal.
  double position_rms_m = 0.0;  ///< Between the two shapes.
  double energy_accepted_J = 0.0, energy_restarted_J = 0.0;
};

/// One measurement as a set of independent frames that a fit evaluates. Frames may be evaluated
/// from several threads at once, each frame by one thread at a time. Residuals are divided by their
/// standard deviations, clip-pose error included.
class FitTest {
 public:
  virtual ~FitTest() = default;

  virtual const Measurement& measurement() const = 0;
  virtual int frameCount() const = 0;
  virtual int residualCount(int frame) const = 0;
  /// Which components this kind of test can see, as indices into the model's components.
  virtual std::vector<int> observedComponents(const ClothModel& model) const = 0;

  /// Gives every frame the laws to compute with. Called by one thread, before evaluate().
  virtual void setParameters(const ParameterSet& parameters) = 0;
  /// Laws that no ParameterSet expresses, such as imported tables: everything but derivatives
  /// works.
  virtual void setLaws(const ClothLaws& laws);

  /// Solves the frame's equilibrium, warm-started from its last accepted state (with the tangent
  /// predictor), and fills `residuals` and, if not null, `jacobian` (residuals x
  /// ParameterSet::size(), by the implicit function theorem, [Est12] eq. 7-9). Not converged: the
  /// residuals are those of the state it started from and the Jacobian is zero; so it is when not
  /// stable.
  virtual FrameOutcome evaluate(int frame, Eigen::VectorXd& residuals,
                                Eigen::MatrixXd* jacobian) = 0;

  /// The last evaluated state of every frame becomes the warm start.
  virtual void accept() = 0;
  /// Forgets warm starts: back to the measured shape. Used for the cross-check of several stable
  /// shapes.
  virtual void restart() = 0;

  /// Takes the residuals' standard deviations, which depend on the local stiffness through the
  /// clip-pose error, anew from the next solved state of every frame, and keeps the warm starts.
  /// Otherwise they stay as of the first solved state, or of restart().
  virtual void reweigh() {}
  /// Estimates anew, from the states accepted last, by how much the law misses what was measured
  /// beyond its noise, and weighs residuals by both. Returns whether weights changed; then they are
  /// those of reweigh() too.
  virtual bool updateDiscrepancy() { return false; }
  /// That estimate: standard deviation per axis of what the law cannot follow at tracked vertices
  /// [m]; 0 where noise explains the misfit.
  virtual double discrepancy_m() const { return 0.0; }
  /// Whether evaluate() proves each state stable with factors of its own (the default), or lets
  /// those of a near state stand in, which halves their number, also in derivatives: for the way,
  /// not for the end.
  virtual void requireProof(bool /*required*/) {}
  /// Polled while an equilibrium is sought: true ends the search, and its outcome is `cancelled`.
  /// Empty: none.
  virtual void cancelWhen(std::function<bool()> /*cancelled*/) {}
  /// Compares the frame's last solved state with the one reached from the measured shape. Changes
  /// neither.
  virtual MultistabilityReport crossCheck(int frame);

  /// Solves the frame again from the measured shape at the current parameters and takes that state,
  /// if it is another stable shape and nearer to what was measured. Returns whether it did.
  virtual bool adoptNearerShape(int /*frame*/) { return false; }

  virtual FramePrediction predict(int frame, bool with_derivatives) = 0;

  /// Strains of a component over all frames at the current states: value and weight (area), for
  /// histograms.
  struct StrainSamples {
    std::vector<double> strain, weight;
  };
  virtual StrainSamples strainSamples(int component) const = 0;

  /// Sum of squares that no parameter can change (noise left out when vertices were projected on
  /// the mesh).
  virtual double constantCost() const { return 0.0; }
  /// How many measured numbers stand behind constantCost(), beyond the residuals' rows.
  virtual int constantCount() const { return 0; }
};

/// Builds the test that a measurement's kind calls for. To add a kind: one file, and one line in
/// fit_test_registry.cpp. Error when the measurement lacks what its kind needs or the model cannot
/// run on it.
Result<std::unique_ptr<FitTest>> makeFitTest(std::shared_ptr<const Measurement> measurement,
                                             const ClothModel& model,
                                             const FitTestOptions& options);
/// The same on a copy of the measurement.
Result<std::unique_ptr<FitTest>> makeFitTest(const Measurement& measurement,
                                             const ClothModel& model,
                                             const FitTestOptions& options);

}  // namespace tenter
