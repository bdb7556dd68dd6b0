// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "tenter/inversion/contacts.h"

namespace tenter {

/// Why no rest shape exists: moved along `direction` as a whole, the shell sinks, and no contact
/// force in its friction cone does negative work. Elasticity does no work on a translation, and
/// gravity's work is positive whatever the masses: so no choice of rest shape balances
/// (docs/inversion.md).
struct SlidingProof {
  Vec3 direction = Vec3::Zero();     ///< Unit.
  double work_per_mass = 0.0;        ///< gravity . direction [m/s^2], positive.
  double friction_factor_min = 0.0;  ///< No such motion exists with all friction times this or
                                     ///< more; infinity if friction never helps.
};

/// The proof, if the contacts alone hold the shell and let it slide; checked before it is returned.
std::optional<SlidingProof> findSlidingProof(const std::vector<Contact>& contacts,
                                             const Vec3& gravity_m_per_s2);

/// Whether `direction` is one: n . d >= mu |d_T| at every contact, and gravity . d > 0.
bool provesSliding(const Vec3& direction, const std::vector<Contact>& contacts,
                   const Vec3& gravity_m_per_s2, double friction_factor = 1.0);

}  // namespace tenter
