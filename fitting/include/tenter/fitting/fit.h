// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tenter/fitting/fit_test.h"
#include "tenter/mechanics/material.h"

namespace tenter {

/// Restrictions of [Est12] sec. 6: constant stiffness, and equal stiffness along weft and warp.
struct FitVariant {
  bool linear = false;
  bool isotropic = false;
};
Result<FitVariant> parseVariant(
    const std::string& name);  ///< linear | isotropic | linear-isotropic | orthotropic.
std::string variantName(FitVariant variant);

struct FitOptions {
  std::string model = "stvk";
  FitVariant variant;
  FitTestOptions test;
  int max_knots = 5;
  double knot_improvement =
      0.01;  ///< Knots are added until the residual falls by less than this ([Est12] sec. 5.2).
  std::map<std::string, std::vector<double>>
      knots;  ///< Given strains for a component, instead of its schedule's.
  int max_outer_iterations = 30;
  int threads = 2;
  bool law_uncertainty =
      true;  ///< Fit a coupled law to the same data too; the difference is the band of the law.
  std::function<bool()> cancelled;  ///< Keeps the best so far.
  struct Progress {
    std::string stage;
    int iteration;
    double cost;
    double relative_rms;
  };
  std::function<void(const Progress&)> progress;
};

/// Residuals of one test at the end.
struct TestResidual {
  std::string measurement, specimen, protocol;
  int frames = 0;
  double force_rms_N = 0.0;  ///< NaN without forces.
  double force_nrmse =
      0.0;  ///< rms of the stacked clip-force errors / largest clip force; axial for a strip.
  double position_rms_m = 0.0;  ///< NaN without positions.
  double chi2_per_dof = 0.0;
  /// What the law misses of positions beyond their noise, per axis; NaN where no fit estimated it.
  double discrepancy_m = std::numeric_limits<double>::quiet_NaN();
  int unconverged_frames = 0, unstable_frames = 0, multistable_frames = 0;
};

struct FitResult {
  bool converged = false;
  bool cancelled = false;
  Material material;  ///< Complete, ready to write.
  std::vector<TestResidual> tests;
  int outer_iterations = 0;
  long factorizations = 0, newton_steps = 0;
  double seconds = 0.0;
  std::vector<std::string> warnings;
};

/// Measurements to a material: incremental nested-loop fit, [Est12] sec. 5, docs/fitting.md.
Result<FitResult> fitMaterial(const std::vector<Measurement>& measurements,
                              const FitOptions& options);

struct EvaluationOptions {
  FitTestOptions test;
  int threads = 2;
  bool predictions = false;  ///< Keep every frame's prediction (for reports).
};
struct EvaluatedTest {
  TestResidual residual;
  std::vector<FramePrediction> frames;
  /// 95 % half-widths of the predicted force summary per frame: from the parameters' covariance,
  /// from the law, together. [N]
  std::vector<double> band_parameters, band_law, band_total;
  double coverage = 0.0;  ///< Fraction of measured summaries inside band_total; NaN without bands.
};

/// Predictions of a material against measurements; nothing is fitted.
Result<std::vector<EvaluatedTest>> evaluateMaterial(const Material& material,
                                                    const std::vector<Measurement>& measurements,
                                                    const EvaluationOptions& options);

}  // namespace tenter
