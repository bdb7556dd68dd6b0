// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/stiffness_curve.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "polynomial_roots.h"

namespace tenter {
namespace {

/// Up to here counting breaks is faster than bisection.
constexpr std::size_t kLinearSearchBreaks = 12;
/// A dip of d(k e)/de below zero smaller than this fraction of the largest |k| is rounding.
constexpr double kRoundingFraction = 1e-12;

bool allFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::string knotName(std::size_t i) { return "knot " + std::to_string(i); }

/// c_i of a cubic Hermite interval about its first end.
void hermite(double width, double k0, double k1, double m0, double m1, double (&c)[4]) {
  const double secant = (k1 - k0) / width;
  c[0] = k0;
  c[1] = m0;
  c[2] = (3.0 * secant - 2.0 * m0 - m1) / width;
  c[3] = (m0 + m1 - 2.0 * secant) / (width * width);
}

/// The same cubic in powers of t - shift.
void shiftCubic(double shift, double (&c)[4]) {
  c[0] += shift * (c[1] + shift * (c[2] + shift * c[3]));
  c[1] += shift * (2.0 * c[2] + shift * 3.0 * c[3]);
  c[2] += 3.0 * shift * c[3];
}

}  // namespace

StiffnessCurve StiffnessCurve::constant(double stiffness, bool even) {
  StiffnessCurve curve;
  curve.strain_ = {0.0};
  curve.stiffness_ = {stiffness};
  curve.tangent_ = {0.0};
  curve.even_ = even;
  curve.build();
  return curve;
}

Result<StiffnessCurve> StiffnessCurve::fromKnots(std::vector<double> strain,
                                                 std::vector<double> stiffness,
                                                 std::vector<double> tangent, bool even) {
  if (strain.empty()) return badInput("", "", "a stiffness curve needs at least one knot");
  if (strain.size() != stiffness.size() || strain.size() != tangent.size())
    return badInput("", "", "strains, stiffnesses and tangents differ in number");
  if (!allFinite(strain) || !allFinite(stiffness) || !allFinite(tangent))
    return badInput("", "", "a knot has a value that is not a finite number");
  for (std::size_t i = 1; i < strain.size(); ++i)
    if (!(strain[i] > strain[i - 1]))
      return badInput("", knotName(i), "strains of the knots do not increase");
  if (even && (strain.front() != 0.0 || tangent.front() != 0.0))
    return badInput("", knotName(0), "an even curve must begin at strain 0 with tangent 0");

  StiffnessCurve curve;
  curve.strain_ = std::move(strain);
  curve.stiffness_ = std::move(stiffness);
  curve.tangent_ = std::move(tangent);
  curve.even_ = even;
  curve.build();
  for (const Piece& piece : curve.pieces_)
    if (!std::all_of(std::begin(piece.energy), std::end(piece.energy),
                     [](double v) { return std::isfinite(v); }))
      return badInput("", "", "knots are too large, or too close together, to compute with");
  return curve;
}

StiffnessCurve::Piece StiffnessCurve::pieceAbout(double anchor, const double (&c)[4]) {
  Piece piece;
  piece.anchor = anchor;
  std::copy(std::begin(c), std::end(c), piece.stiffness);
  piece.energy[1] = anchor * c[0];
  for (int i = 1; i < 4; ++i) piece.energy[i + 1] = (c[i - 1] + anchor * c[i]) / (i + 1);
  piece.energy[5] = c[3] / 5.0;
  return piece;
}

/// Pieces between knots i and i + 1, two if strain 0 lies between them.
void StiffnessCurve::addInterval(int knot) {
  const double begin = strain_[knot], end = strain_[knot + 1];
  double c[4];
  hermite(end - begin, stiffness_[knot], stiffness_[knot + 1], tangent_[knot], tangent_[knot + 1],
          c);
  const double anchor = std::clamp(0.0, begin, end);
  shiftCubic(anchor - begin, c);
  // The anchored end carries the file's own stiffness, not one that the shift has rounded.
  if (anchor == end) c[0] = stiffness_[knot + 1];
  const Piece piece = pieceAbout(anchor, c);
  if (anchor > begin && anchor < end) {
    pieces_.push_back(piece);
    breaks_.push_back(0.0);
  }
  pieces_.push_back(piece);
  breaks_.push_back(end);
}

void StiffnessCurve::build() {
  breaks_.clear();
  pieces_.clear();
  const double before[4] = {stiffness_.front(), 0.0, 0.0, 0.0};
  const double beyond[4] = {stiffness_.back(), 0.0, 0.0, 0.0};
  if (knotCount() == 1) {
    pieces_.push_back(pieceAbout(0.0, before));
    return;
  }
  pieces_.push_back(pieceAbout(std::min(strain_.front(), 0.0), before));
  breaks_.push_back(strain_.front());
  for (int i = 0; i + 1 < knotCount(); ++i) addInterval(i);
  pieces_.push_back(pieceAbout(std::max(strain_.back(), 0.0), beyond));

  // W(anchor) of each piece, outwards from strain 0 where W = 0.
  const auto energyAt = [](const Piece& piece, double strain) {
    const double t = strain - piece.anchor;
    double sum = 0.0;
    for (int i = 5; i >= 0; --i) sum = sum * t + piece.energy[i];
    return sum;
  };
  const int count = static_cast<int>(pieces_.size());
  for (int i = 1; i < count; ++i)
    if (pieces_[i].anchor > 0.0) pieces_[i].energy[0] = energyAt(pieces_[i - 1], breaks_[i - 1]);
  for (int i = count - 2; i >= 0; --i)
    if (pieces_[i].anchor < 0.0) pieces_[i].energy[0] = energyAt(pieces_[i + 1], breaks_[i]);
}

int StiffnessCurve::pieceIndex(double strain) const {
  if (breaks_.size() > kLinearSearchBreaks)
    return static_cast<int>(std::lower_bound(breaks_.begin(), breaks_.end(), strain) -
                            breaks_.begin());
  int index = 0;
  for (const double end : breaks_) index += strain > end ? 1 : 0;
  return index;
}

CurveValue StiffnessCurve::evaluate(double strain) const {
  const double e = even_ ? std::abs(strain) : strain;
  const Piece& piece = pieces_[pieceIndex(e)];
  const double t = e - piece.anchor;
  const double(&c)[4] = piece.stiffness;
  const double(&w)[6] = piece.energy;
  // Pairs instead of Horner's chain: the same operations, but not each waiting for the one before.
  const double t2 = t * t;
  CurveValue value;
  value.stiffness = (c[0] + t * c[1]) + t2 * (c[2] + t * c[3]);
  value.energy = (w[0] + t * w[1]) + t2 * ((w[2] + t * w[3]) + t2 * (w[4] + t * w[5]));
  value.stress = value.stiffness * strain;
  value.tangent = value.stiffness + e * (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]));
  return value;
}

StiffnessCurve::Extremum StiffnessCurve::minimumStiffness() const {
  Extremum minimum{strain_.front(), stiffness_.front()};
  const auto offer = [&](double strain, double value) {
    if (value < minimum.value) minimum = {strain, value};
  };
  for (int i = 1; i < knotCount(); ++i) {
    const double begin = strain_[i - 1], width = strain_[i] - begin;
    offer(strain_[i], stiffness_[i]);
    double c[4];
    hermite(width, stiffness_[i - 1], stiffness_[i], tangent_[i - 1], tangent_[i], c);
    for (const double t : quadraticRoots(3.0 * c[3], 2.0 * c[2], c[1], 0.0, width))
      offer(begin + t, c[0] + t * (c[1] + t * (c[2] + t * c[3])));
  }
  return minimum;
}

std::vector<std::pair<double, double>> StiffnessCurve::softeningIntervals() const {
  double largest = 0.0;
  for (const double k : stiffness_) largest = std::max(largest, std::abs(k));
  std::vector<std::pair<double, double>> intervals;
  for (int i = 0; i + 1 < knotCount(); ++i) {
    const double a = strain_[i], width = strain_[i + 1] - a;
    double c[4];
    hermite(width, stiffness_[i], stiffness_[i + 1], tangent_[i], tangent_[i + 1], c);
    // d/dt of (a + t) k(t).
    const double p[4] = {c[0] + a * c[1], 2.0 * (c[1] + a * c[2]), 3.0 * (c[2] + a * c[3]),
                         4.0 * c[3]};
    std::vector<double> ends = cubicRoots(p, 0.0, width);
    ends.insert(ends.begin(), 0.0);
    ends.push_back(width);
    for (std::size_t j = 0; j + 1 < ends.size(); ++j) {
      const double t = 0.5 * (ends[j] + ends[j + 1]);
      const double tangent = p[0] + t * (p[1] + t * (p[2] + t * p[3]));
      if (!(tangent < -kRoundingFraction * largest)) continue;
      const double from = a + ends[j], to = j + 2 == ends.size() ? strain_[i + 1] : a + ends[j + 1];
      if (!intervals.empty() && intervals.back().second >= from)
        intervals.back().second = to;
      else
        intervals.emplace_back(from, to);
    }
  }
  return intervals;
}

StiffnessCurve StiffnessCurve::scaled(double factor) const {
  StiffnessCurve curve = *this;
  for (double& k : curve.stiffness_) k *= factor;
  for (double& m : curve.tangent_) m *= factor;
  curve.build();
  return curve;
}

}  // namespace tenter
