// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <vector>

namespace tenter {

/// Terms of a lens and of a pose as a calibration's covariance names them, in its order: rows
/// "left.fx_px" ... "left.k3", "left.rotation_rad[0]" ... "left.translation_m[2]"
/// (docs/formats/camera-calibration.md).
inline constexpr std::array<const char*, 9> kLensParameters{
    "fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};
inline constexpr std::array<const char*, 6> kPoseParameters{"rotation_rad[0]",  "rotation_rad[1]",
                                                            "rotation_rad[2]",  "translation_m[0]",
                                                            "translation_m[1]", "translation_m[2]"};

/// Appends "of.term" for each of them.
template <std::size_t count>
void nameParameters(const std::string& of, const std::array<const char*, count>& terms,
                    std::vector<std::string>& names) {
  for (const char* term : terms) names.push_back(of + "." + term);
}

}  // namespace tenter
