// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frame_evaluator.h"

namespace tenter {

std::vector<FramePrediction> predictFrames(FitTest& test, bool with_derivatives, int threads) {
  std::vector<FramePrediction> frames(test.frameCount());
  parallelFor(test.frameCount(), threads,
              [&](int f) { frames[f] = test.predict(f, with_derivatives); });
  return frames;
}

TestResidual summarizeTest(const FitTest& test, const std::vector<FramePrediction>& frames) {
  const Measurement& m = test.measurement();
  TestResidual residual{.measurement = m.name, .specimen = m.specimen, .protocol = m.protocol};
  residual.frames = static_cast<int>(frames.size());
  double force_sum = 0.0, force_max = 0.0, position_sum = 0.0;
  int force_count = 0, position_count = 0;
  for (const FramePrediction& frame : frames) {
    if (!frame.outcome.converged) ++residual.unconverged_frames;
    if (!frame.outcome.stable) ++residual.unstable_frames;
    if (std::isfinite(frame.position_rms_m)) {
      position_sum += frame.position_rms_m * frame.position_rms_m;
      ++position_count;
    }
    const Eigen::VectorXd& measured = frame.measured_force_N;
    if (measured.size() == 0) continue;
    force_sum += (frame.predicted_force_N - measured).squaredNorm();
    ++force_count;
    const Eigen::Index per_clip = measured.size() % 3 == 0 ? 3 : 1;
    for (Eigen::Index i = 0; i + per_clip <= measured.size(); i += per_clip)
      force_max = std::max(force_max, measured.segment(i, per_clip).norm());
  }
  const double none = std::numeric_limits<double>::quiet_NaN();
  residual.force_rms_N = force_count > 0 ? std::sqrt(force_sum / force_count) : none;
  residual.force_nrmse = force_max > 0.0 ? residual.force_rms_N / force_max : none;
  residual.position_rms_m = position_count > 0 ? std::sqrt(position_sum / position_count) : none;
  return residual;
}

int countMultistable(FitTest& test, int threads) {
  std::vector<char> disagrees(test.frameCount(), 0);
  parallelFor(test.frameCount(), threads, [&](int f) {
    const MultistabilityReport report = test.crossCheck(f);
    disagrees[f] = report.checked && report.disagrees;
  });
  return static_cast<int>(std::ranges::count(disagrees, 1));
}

nlohmann::json toJson(const TestResidual& r) {
  const auto number = [](double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
  };
  return {{"measurement", r.measurement},
          {"specimen", r.specimen},
          {"protocol", r.protocol},
          {"frames", r.frames},
          {"force_rms_N", number(r.force_rms_N)},
          {"force_nrmse", number(r.force_nrmse)},
          {"position_rms_m", number(r.position_rms_m)},
          {"chi2_per_dof", number(r.chi2_per_dof)},
          {"discrepancy_m", number(r.discrepancy_m)},
          {"unconverged_frames", r.unconverged_frames},
          {"unstable_frames", r.unstable_frames},
          {"multistable_frames", r.multistable_frames}};
}

}  // namespace tenter
