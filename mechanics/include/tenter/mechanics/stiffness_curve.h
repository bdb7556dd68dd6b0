// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// Values of a stiffness curve at one strain, all from the same polynomial.
struct CurveValue {
  double stiffness = 0.0;  ///< k(e).
  double energy = 0.0;     ///< W(e) = integral of k(s) s ds from 0 to e.
  double stress = 0.0;     ///< sigma(e) = k(e) e = dW/de.
  double tangent = 0.0;    ///< d sigma / d e.
};

/// Strain-dependent stiffness k(e) of one component as a cubic Hermite spline, sigma = k(e) e
/// [Est12] sec. 4.2. The energy is the closed-form integral of the spline, so energy, stress and
/// tangent agree to rounding. Beyond its first and last knot k is constant. An even curve is given
/// for e >= 0 and mirrored, its first knot at 0 with zero slope. Units: e and k as the component
/// says (membrane k [N/m], bending k [N m]).
class StiffnessCurve {
 public:
  /// One knot at strain 0: a linear material.
  static StiffnessCurve constant(double stiffness, bool even = false);

  /// Error when sizes differ, strains do not increase, a value is not finite, or an even curve does
  /// not start at 0 with zero slope. Negative stiffness is accepted here and reported by
  /// minimumStiffness().
  static Result<StiffnessCurve> fromKnots(std::vector<double> strain, std::vector<double> stiffness,
                                          std::vector<double> tangent, bool even = false);

  CurveValue evaluate(double strain) const;  ///< Never allocates.

  bool even() const { return even_; }
  int knotCount() const { return static_cast<int>(strain_.size()); }
  const std::vector<double>& strains() const { return strain_; }
  const std::vector<double>& stiffnesses() const { return stiffness_; }
  const std::vector<double>& tangents() const { return tangent_; }  ///< dk/de at the knots.

  /// Smallest k over the whole range, exact (interior extrema of each cubic included), and where.
  struct Extremum {
    double strain, value;
  };
  Extremum minimumStiffness() const;

  /// Strain intervals inside the knot range where d(k e)/de < 0: softening that makes equilibria
  /// unstable.
  std::vector<std::pair<double, double>> softeningIntervals() const;

  /// The same curve with every stiffness multiplied.
  StiffnessCurve scaled(double factor) const;

 private:
  /// One polynomial k(e) = sum c_i (e - anchor)^i. Anchored at the end nearer to strain 0, where W
  /// is smaller: adding to it loses no digits, as subtracting towards 0 would.
  struct Piece {
    double anchor = 0.0;
    double stiffness[4] = {};  ///< c_i.
    double energy[6] = {};     ///< W(e) = sum energy_i (e - anchor)^i.
  };
  StiffnessCurve() = default;
  void build();
  static Piece pieceAbout(double anchor, const double (&stiffness)[4]);
  void addInterval(int knot);
  int pieceIndex(double strain) const;

  std::vector<double> strain_, stiffness_, tangent_;
  bool even_ = false;
  std::vector<double> breaks_;  ///< Piece i ends at breaks_[i]; the last has no end.
  std::vector<Piece> pieces_;
};

}  // namespace tenter
