// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/reconstruction/image_session.h"
#include "tenter/reconstruction/reconstruct_images.h"

namespace tenter {

/// What a cord's tension errs by beyond its cell, at the pulley [Est12] sec. 3.3.
struct TensionErrors {
  double cell_N = 3e-3;
  double friction_N = 0.05;
};

struct SessionReconstruction {
  SurfaceOptions surface;
  TensionErrors tension;
  /// Where finished frames are kept until all are done, so that a run that was broken off goes on;
  /// empty: nowhere.
  std::filesystem::path partial;
  /// Asked between frames and within them: frames done, frames in all; false stops.
  std::function<bool(int, int)> keep_going;
};

/// A session's images to a measurement (docs/reconstruction.md): the mesh is laid over the frame at
/// rest, every later frame becomes one of the measurement, with clips from their tags, clamped
/// vertices, cords and their tensions. What cannot be seen is marked or left out, and named in the
/// warnings. Error: the session (openImageSession), or a frame at rest that cannot be
/// reconstructed.
Result<SeriesResult> reconstructSession(const ImageSession& session,
                                        const SessionReconstruction& options);

/// Removes the frames that were kept in a `partial` folder, and the folder if nothing else is in
/// it.
void discardPartial(const std::filesystem::path& folder);

}  // namespace tenter
