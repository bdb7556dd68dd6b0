// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "tenter/core/measurement.h"
#include "tenter/reconstruction/cloth_tracker.h"

namespace tenter {

/// One frame as it was reconstructed.
struct FinishedFrame {
  MeasurementFrame frame;  ///< Clips, cords, time and branch; positions are those of `cloth`.
  ClothFrame cloth;
  double clip_position_sigma_m = 0.0, clip_rotation_sigma_rad = 0.0;
  double seconds = 0.0;
};

/// Finished frames on disk, so that a run that was broken off goes on where it stopped. A folder of
/// its own; frames of another session or other options in it are forgotten.
class PartialStore {
 public:
  /// Nothing is kept if `folder` is empty.
  PartialStore(std::filesystem::path folder, const std::string& identity);

  /// A finished frame, if it is there, whole, and of this run.
  std::optional<FinishedFrame> load(std::int64_t number, std::size_t vertices) const;
  Result<void> save(std::int64_t number, const FinishedFrame& finished) const;
  /// Removes what it wrote.
  void clear() const;

 private:
  std::filesystem::path fileOf(std::int64_t number) const;

  std::filesystem::path folder_;
  std::string identity_;
};

}  // namespace tenter
