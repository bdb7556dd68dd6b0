// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "tenter/reconstruction/reconstruct_images.h"

namespace tenter {

/// Reads the image of one view at a frame of the measurement; an empty one if there is none.
using FrameImageReader = std::function<GrayImage(std::size_t frame)>;

/// How good a reconstruction is, as one HTML page without scripts: figures, curves over the frames,
/// drift check, maps of coverage, correlation, residual and sigma over the mesh, the worst frames
/// with their vertices drawn over the images of `view`.
std::string qualityReport(const SeriesResult& result, const CameraView& view,
                          const FrameImageReader& image);

}  // namespace tenter
