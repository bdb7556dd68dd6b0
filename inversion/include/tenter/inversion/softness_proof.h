// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/inversion/contacts.h"
#include "tenter/inversion/inverse_shell.h"

namespace tenter {

/// Of a metric rest state, an edge's rest length lies within a factor of this of its length in the
/// target; rest angles are free.
inline constexpr double kStretchLimit = 2.0;

/// Why no metric rest state holds the target (docs/inversion.md): along x + s v + s^2 y / 2, summed
/// over the modes v with one motion y, the energy of every state within bounds falls to second
/// order, and no contact force in its cone does negative work. Without modes: no such state
/// balances the weight.
struct SoftnessProof {
  Points3 motion;              ///< y: 3 x vertices; zero at fixed vertices.
  std::vector<Points3> modes;  ///< v, 3 x vertices each; zero at fixed vertices and contacts.
  /// With modes, which then have unit kinetic energy together (sum of v^T M v = 1): an upper bound
  /// on lambda_min [1/s^2], negative. Without: work [J], negative.
  double bound = 0.0;
  /// w: the proof still holds if every hinge's weight 3 L0^2 / A and every triangle's mass lie
  /// between 1 / (1 + w) and 1 + w of the target's: what a rest mesh may change of them.
  double weight_change = 0.0;
};

/// The proof's bound computed anew, from the mesh alone, with hinge weights and masses between
/// 1 / (1 + change) and 1 + change of the target's; +infinity if the motion or modes are not what a
/// proof's have to be.
double boundOf(const SoftnessProof& proof, const InverseShell& shell, const std::vector<int>& fixed,
               const std::vector<Contact>& contacts, double weight_change = 0.0);

/// Whether the bound is negative beyond rounding.
bool proves(const SoftnessProof& proof, const InverseShell& shell, const std::vector<int>& fixed,
            const std::vector<Contact>& contacts, double weight_change = 0.0);

/// How far weights and masses may change before the proof fails, at most by all.
double weightChangeOf(const SoftnessProof& proof, const InverseShell& shell,
                      const std::vector<int>& fixed, const std::vector<Contact>& contacts);

}  // namespace tenter
