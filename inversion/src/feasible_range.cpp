// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/feasible_range.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <utility>

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;

class ScaledLaw final : public StrainLaw {
 public:
  ScaledLaw(std::shared_ptr<StrainLaw> law, double factor)
      : law_(std::move(law)), factor_(factor) {}
  LawValue evaluate(const Vec3& strain, int element) const override {
    LawValue value = law_->evaluate(strain, element);
    value.energy *= factor_;
    value.stress *= factor_;
    value.tangent *= factor_;
    return value;
  }

 private:
  std::shared_ptr<StrainLaw> law_;
  double factor_;
};

class Search {
 public:
  Search(const InversionProblem& problem, const InversionOptions& options)
      : problem_(problem), options_(options) {}

  Result<FeasibleRange> run() {
    if (auto first = tryAt(1.0, 1.0); !first) return first.error();
    if (!out_.result.proof) searchStiffness();
    if (!problem_.contacts.empty()) searchFriction();
    out_.complete = !stopped();
    out_.result.seconds = seconds();
    return std::move(out_);
  }

 private:
  /// Whether those multiples are certified. The result is kept if it is the first, or better.
  Result<bool> tryAt(double stiffness, double friction) {
    InversionProblem problem = problem_;
    problem.material = scaled(problem_.material, stiffness);
    for (Contact& c : problem.contacts) c.friction *= friction;
    InversionOptions options = options_;
    options.explain = false;
    if (options.time_budget_s > 0.0)
      options.time_budget_s = std::max(options.time_budget_s - seconds(), 1e-3);
    auto result = invert(problem, options);
    if (!result) return result.error();
    const Certificate& c = result->certificate;
    out_.points.push_back(
        {stiffness, friction, result->status,
         c.measured_stability ? c.lambda_min_per_s2 : std::numeric_limits<double>::quiet_NaN()});
    const bool certified = result->status == InversionStatus::kCertified;
    say(stiffness, friction, name(result->status));
    const bool first = out_.points.size() == 1;
    const bool better = certified && friction == 1.0 &&
                        (out_.result.status != InversionStatus::kCertified ||
                         std::abs(std::log(stiffness)) < std::abs(std::log(out_.result_stiffness)));
    if (first || better) {
      out_.result = std::move(result).value();
      out_.result_stiffness = stiffness;
    }
    return certified;
  }

  bool certified(double stiffness, double friction) {
    const auto result = tryAt(stiffness, friction);
    return result && *result;
  }

  void searchStiffness() {
    double low = 1.0, high = 1.0;  // not certified, certified
    if (out_.result.status == InversionStatus::kCertified) {
      low = 0.0;
      while (high > kSoftestFactor && low == 0.0 && !stopped())
        (certified(0.5 * high, 1.0) ? high : low) = 0.5 * high;
    } else {
      high = 0.0;
      for (double s = 2.0; s <= kStiffestFactor && high == 0.0 && !stopped(); s *= 2.0)
        (certified(s, 1.0) ? high : low) = s;
      if (high == 0.0) return;
    }
    if (low > 0.0) narrow(low, high, [&](double s) { return certified(s, 1.0); });
    out_.stiffness_min = high;
    if (low > 0.0) out_.stiffness_below = low;
    out_.stiffness_max = std::max(high, 1.0);
    double step = 4.0;  // stiffer is safer but for rounding: the far end first
    for (double s = kStiffestFactor; s > *out_.stiffness_max && !stopped(); s /= step)
      if (certified(s, 1.0)) out_.stiffness_max = s;
  }

  void searchFriction() {
    out_.friction_at_stiffness = out_.stiffness_min ? std::max(1.0, *out_.stiffness_min) : 1.0;
    const double at = out_.friction_at_stiffness;
    if (out_.result.proof) out_.friction_proved_below = out_.result.proof->friction_factor_min;
    double low = 0.0, high = 1.0;
    if (out_.result.proof) {
      const double proved = out_.friction_proved_below;
      if (!std::isfinite(proved)) return;
      low = proved;
      high = 0.0;
      for (double s = kRangeRatio; s <= kStiffestFactor && high == 0.0 && !stopped(); s *= 2.0)
        (certified(at, proved * s) ? high : low) = proved * s;
      if (high == 0.0) return;
    } else if (!out_.stiffness_min) {
      return;
    } else {
      if (auto proof = provedBelow(); proof > 0.0) low = out_.friction_proved_below = proof;
      for (double s = 0.5; s >= kSoftestFactor && s > low && !stopped(); s *= 0.5) {
        if (!certified(at, s)) {
          low = s;
          break;
        }
        high = s;
      }
    }
    if (low > 0.0) narrow(low, high, [&](double s) { return certified(at, s); });
    out_.friction_min = high;
    if (low > 0.0) out_.friction_below = low;
  }

  /// Share of the friction below which sliding is proved.
  double provedBelow() const {
    if (!problem_.fixed.empty()) return 0.0;
    std::vector<Contact> slippery = problem_.contacts;
    for (Contact& c : slippery) c.friction *= kSoftestFactor;
    const auto proof = findSlidingProof(slippery, problem_.material.gravity_m_per_s2);
    return proof ? kSoftestFactor * proof->friction_factor_min : 0.0;
  }

  template <class Test>
  void narrow(double& low, double& high, Test good) {
    while (high / low > kRangeRatio && !stopped()) {
      const double middle = std::sqrt(low * high);
      (good(middle) ? high : low) = middle;
    }
  }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  bool stopped() const {
    return (options_.cancelled && options_.cancelled()) ||
           (options_.time_budget_s > 0.0 && seconds() > options_.time_budget_s);
  }
  void say(double stiffness, double friction, const std::string& status) const {
    if (!options_.progress) return;
    char text[120];
    std::snprintf(text, sizeof text, "stiffness x %.4g, friction x %.4g: %s", stiffness, friction,
                  status.c_str());
    options_.progress(text);
  }

  const InversionProblem& problem_;
  const InversionOptions& options_;
  Clock::time_point start_ = Clock::now();
  FeasibleRange out_;
};

}  // namespace

ShellMaterial scaled(const ShellMaterial& material, double factor) {
  ShellMaterial out = material;
  if (factor == 1.0) return out;
  out.laws.membrane = std::make_shared<ScaledLaw>(material.laws.membrane, factor);
  if (material.laws.bending)
    out.laws.bending = std::make_shared<ScaledLaw>(material.laws.bending, factor);
  return out;
}

Result<FeasibleRange> findFeasibleRange(const InversionProblem& problem,
                                        const InversionOptions& options) {
  return Search(problem, options).run();
}

}  // namespace tenter
