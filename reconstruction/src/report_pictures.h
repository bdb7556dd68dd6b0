// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/reconstruction/reconstruct_images.h"

namespace tenter {

/// An <img> of a value per vertex over the mesh's grid, blue (low) to yellow (high); vertices with
/// NaN, and nodes without a vertex, are grey.
std::string mapPicture(const RestSurface& rest, const std::vector<double>& values, double low,
                       double high);

/// An <img> of an image with the vertices of a frame drawn over it: green valid, red not.
std::string overlayPicture(const GrayImage& image, const CameraView& view,
                           const MeasurementFrame& frame);

/// An <svg> of a value per frame; its axis begins at 0.
std::string curvePicture(const std::string& title, const std::vector<double>& values);

/// Text that is safe inside HTML.
std::string htmlText(const std::string& text);

}  // namespace tenter
