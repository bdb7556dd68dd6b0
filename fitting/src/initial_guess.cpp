// SPDX-License-Identifier: GPL-3.0-or-later
#include "initial_guess.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

namespace tenter {
namespace {

constexpr double kFallbackStretch_N_per_m = 1000.0;
/// Cloth shears an order more easily than it stretches; only a start, or an assumption that is
/// reported as one.
constexpr double kShearOverStretch = 0.1;
/// Gamma = w L^3 / B at which a cantilever has dropped by about three quarters of its length.
constexpr double kVisibleGamma = 10.0;
/// Bending length of ordinary clothing fabric [m], where no test bends the cloth: B = w c^3.
constexpr double kOrdinaryBendingLength_m = 0.025;
constexpr double kSpringBendOverStretch = 0.01;
constexpr double kPoissonOverStretch = 0.3;
/// Strain at which shear stiffening would double the shear stiffness: only the scale of that
/// coefficient.
constexpr double kStiffeningStrain = 0.05;

Vec3 netCordForce(const MeasurementFrame& frame, const std::string& clip) {
  Vec3 force = Vec3::Zero();
  for (const CordReading& cord : frame.cords)
    if (cord.clip == clip) force += cord.tension_N * cord.direction;
  return force;
}

/// Centre of what a clip holds, at rest.
std::optional<Vec3> clipCentre(const Measurement& m, const ClipReading& clip) {
  if (!m.rest || clip.clamped_vertices.empty()) return std::nullopt;
  Vec3 centre = Vec3::Zero();
  for (const int v : clip.clamped_vertices) centre += m.rest->positions.col(v);
  return centre / static_cast<double>(clip.clamped_vertices.size());
}

/// Largest relative displacement of two clips over their distance: the strain of stretching, the
/// angle of shearing.
double nominalStrain(const Measurement& m, const MeasurementFrame& frame) {
  double strain = 0.0;
  for (const ClipReading& a : frame.clips)
    for (const ClipReading& b : frame.clips) {
      const std::optional<Vec3> rest_a = clipCentre(m, a), rest_b = clipCentre(m, b);
      if (a.clip >= b.clip || !rest_a || !rest_b) continue;
      const Vec3 rest = *rest_a - *rest_b;
      const Vec3 now = a.rig_from_clip * *rest_a - b.rig_from_clip * *rest_b;
      if (rest.norm() > 0.0) strain = std::max(strain, (now - rest).norm() / rest.norm());
    }
  return strain;
}

double weight_N_per_m2(const Measurement& m) {
  return m.areal_density_kg_per_m2 * m.gravity_m_per_s2.norm();
}

double bendLength_m(const Measurement& m) {
  if (m.cantilever) return m.cantilever->length_m;
  return 0.5 * m.sample_size_m.maxCoeff();
}

/// Guesses of the groups that tests isolate; zero for the others.
std::vector<double> guessesFromData(const FitState& state,
                                    const std::vector<const Measurement*>& measurements,
                                    const std::vector<TestRole>& roles) {
  std::vector<double> guess(state.groups.size(), 0.0);
  for (std::size_t t = 0; t < roles.size(); ++t) {
    if (roles[t].primary < 0) continue;
    const int g = state.groupOf(roles[t].primary);
    const Measurement& m = *measurements[t];
    if (state.groups[g].bending && state.model->bending == BendingElement::kSprings) continue;
    guess[g] = std::max(
        guess[g], state.groups[g].bending ? visibleRigidity_N_m(m) : secantStiffness_N_per_m(m));
  }
  return guess;
}

/// Where no test says: hinges have an ordinary bending length. Ring-2 springs stand beside the
/// stretch springs, so a stiff one would take their test away from them; what bends does so later
/// ([Est12] sec. 5.2 leaves bending out of stretch fits).
double assumedBending(const FitState& state, const Measurement& m, double stretch_N_per_m) {
  if (state.model->bending == BendingElement::kSprings)
    return kSpringBendOverStretch * stretch_N_per_m;
  return weight_N_per_m2(m) * std::pow(kOrdinaryBendingLength_m, 3);
}

}  // namespace

double secantStiffness_N_per_m(const Measurement& m) {
  double force = 0.0, stiffness = 0.0;
  for (const MeasurementFrame& frame : m.frames) {
    double f = 0.0, strain = 0.0, width = 0.0;
    if (m.tensile) {
      f = std::abs(frame.force_N);
      width = m.tensile->width_m * m.tensile->strips;
      strain = (frame.displacement_m + m.tensile->zero_offset_m) / m.tensile->length_m;
    } else {
      for (const ClipReading& clip : frame.clips)
        f = std::max(f, netCordForce(frame, clip.clip).norm());
      width = m.sample_size_m.minCoeff();
      strain = nominalStrain(m, frame);
    }
    if (f <= force || strain <= 0.0 || width <= 0.0) continue;
    force = f;
    stiffness = f / (width * strain);
  }
  return stiffness;
}

double visibleRigidity_N_m(const Measurement& m) {
  return weight_N_per_m2(m) * std::pow(bendLength_m(m), 3) / kVisibleGamma;
}

void setInitialGuesses(FitState& state, const std::vector<const Measurement*>& measurements,
                       const std::vector<TestRole>& roles) {
  const std::vector<double> guess = guessesFromData(state, measurements, roles);
  double stretch = 0.0, bend = 0.0;
  for (std::size_t g = 0; g < guess.size(); ++g)
    (state.groups[g].bending ? bend : stretch) =
        std::max(state.groups[g].bending ? bend : stretch, guess[g]);
  if (stretch <= 0.0) stretch = kFallbackStretch_N_per_m;
  if (bend <= 0.0) bend = assumedBending(state, *measurements.front(), stretch);

  const int shear = state.groupOf(std::max(0, state.model->componentIndex("shear")));
  for (int g = 0; g < static_cast<int>(guess.size()); ++g) {
    const double fallback = state.groups[g].bending ? bend
                            : g == shear            ? kShearOverStretch * stretch
                                                    : stretch;
    if (!state.groups[g].may_be_negative) {
      state.setConstant(g, guess[g] > 0.0 ? guess[g] : fallback);
      continue;
    }
    state.setConstant(g, 0.0);
    const bool poisson = state.groupName(g) == "poisson";
    state.groups[g].reference =
        poisson ? kPoissonOverStretch * stretch : kShearOverStretch * stretch / kStiffeningStrain;
  }
}

}  // namespace tenter
