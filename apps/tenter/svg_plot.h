// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace tenter::app {

/// One line, or one cloud of points, of a plot; with `half_width` a line has a band and points have
/// bars.
struct PlotSeries {
  std::string label;
  std::string colour = "#1f5fa8";
  bool points = false;
  std::vector<double> x, y;
  std::vector<double> half_width;  ///< Empty, or one per point.
};

/// A plot with linear axes as a self-contained <svg> element. Not-finite points are left out.
struct Plot {
  std::string title, x_label, y_label;
  std::vector<PlotSeries> series;
};
std::string renderSvg(const Plot& plot);

/// Text that is safe inside HTML and SVG.
std::string escapeHtml(const std::string& text);

/// A number with four significant digits; "–" if it is not finite.
std::string numberText(double value);

}  // namespace tenter::app
