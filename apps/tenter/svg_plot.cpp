// SPDX-License-Identifier: GPL-3.0-or-later
#include "svg_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace tenter::app {

namespace {

constexpr double kWidth = 460, kHeight = 300, kLeft = 64, kRight = 14, kTop = 30, kBottom = 46;
constexpr int kWantedTicks = 5;

std::string format(const char* pattern, double a, double b = 0.0) {
  char text[96];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

/// A range that grows with what it is shown.
struct Extent {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  void show(double v) {
    if (!std::isfinite(v)) return;
    min = std::min(min, v);
    max = std::max(max, v);
  }
  /// Never empty, with a little air.
  void settle() {
    if (!(min <= max)) min = 0.0, max = 1.0;
    if (max - min < 1e-12 * std::max(std::abs(max), 1e-300)) {
      const double air = std::max(std::abs(max), 1e-12) * 0.5;
      min -= air;
      max += air;
    }
    const double air = 0.03 * (max - min);
    min -= air;
    max += air;
  }
};

/// A step of 1, 2 or 5 times a power of ten.
double tickStep(const Extent& e) {
  const double rough = (e.max - e.min) / kWantedTicks;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10.0 * power;
}

class Canvas {
 public:
  Canvas(Extent x, Extent y) : x_(x), y_(y) {}

  double px(double x) const {
    return kLeft + (x - x_.min) / (x_.max - x_.min) * (kWidth - kLeft - kRight);
  }
  double py(double y) const {
    return kHeight - kBottom - (y - y_.min) / (y_.max - y_.min) * (kHeight - kTop - kBottom);
  }
  std::string at(double x, double y) const { return format("%.1f,%.1f ", px(x), py(y)); }

  std::string axes() const {
    std::string svg = "<g class=\"axis\">";
    const double step_x = tickStep(x_), step_y = tickStep(y_);
    for (double t = std::ceil(x_.min / step_x) * step_x; t <= x_.max; t += step_x) {
      svg += format("<line x1=\"%.1f\" x2=\"%.1f\" ", px(t), px(t)) +
             format("y1=\"%.1f\" y2=\"%.1f\"/>", kTop, kHeight - kBottom);
      svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", px(t),
                    kHeight - kBottom + 15) +
             tickText(t, step_x) + "</text>";
    }
    for (double t = std::ceil(y_.min / step_y) * step_y; t <= y_.max; t += step_y) {
      svg += format("<line y1=\"%.1f\" y2=\"%.1f\" ", py(t), py(t)) +
             format("x1=\"%.1f\" x2=\"%.1f\"/>", kLeft, kWidth - kRight);
      svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">", kLeft - 5, py(t) + 4) +
             tickText(t, step_y) + "</text>";
    }
    return svg + "</g>";
  }

 private:
  static std::string tickText(double t, double step) {
    return format("%.4g", std::abs(t) < 1e-9 * step ? 0.0 : t);
  }
  Extent x_, y_;
};

bool drawable(const PlotSeries& s, std::size_t i) {
  return i < s.y.size() && std::isfinite(s.x[i]) && std::isfinite(s.y[i]);
}

double bandAt(const PlotSeries& s, std::size_t i) {
  return i < s.half_width.size() && std::isfinite(s.half_width[i]) ? s.half_width[i] : 0.0;
}

std::string drawSeries(const PlotSeries& s, const Canvas& canvas) {
  std::string svg;
  if (!s.half_width.empty()) {
    std::string upper, lower;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!drawable(s, i)) continue;
      upper += canvas.at(s.x[i], s.y[i] + bandAt(s, i));
      lower.insert(0, canvas.at(s.x[i], s.y[i] - bandAt(s, i)));
    }
    svg += "<polygon points=\"" + upper + lower + "\" fill=\"" + s.colour + "\" opacity=\"0.18\"/>";
  }
  if (s.points) {
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!drawable(s, i)) continue;
      if (const double band = bandAt(s, i); band > 0.0) {
        svg +=
            format("<line x1=\"%.1f\" y1=\"%.1f\" ", canvas.px(s.x[i]), canvas.py(s.y[i] - band)) +
            format("x2=\"%.1f\" y2=\"%.1f\" ", canvas.px(s.x[i]), canvas.py(s.y[i] + band)) +
            "stroke=\"" + s.colour + "\" opacity=\"0.35\"/>";
      }
      svg +=
          format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\" ", canvas.px(s.x[i]), canvas.py(s.y[i])) +
          "fill=\"" + s.colour + "\"/>";
    }
    return svg;
  }
  std::string line;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (drawable(s, i)) line += canvas.at(s.x[i], s.y[i]);
  }
  return svg + "<polyline points=\"" + line + "\" fill=\"none\" stroke=\"" + s.colour +
         "\" stroke-width=\"1.6\"/>";
}

}  // namespace

std::string renderSvg(const Plot& plot) {
  Extent x, y;
  for (const PlotSeries& s : plot.series) {
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!drawable(s, i)) continue;
      x.show(s.x[i]);
      y.show(s.y[i] + bandAt(s, i));
      y.show(s.y[i] - bandAt(s, i));
    }
  }
  x.settle();
  y.settle();
  const Canvas canvas(x, y);
  std::string svg = "<svg viewBox=\"0 0 " + format("%g %g", kWidth, kHeight) +
                    "\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\">" + canvas.axes();
  for (const PlotSeries& s : plot.series) svg += drawSeries(s, canvas);
  svg += format("<text class=\"title\" x=\"%.1f\" y=\"16\">", kLeft) + escapeHtml(plot.title) +
         "</text>";
  svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">",
                (kLeft + kWidth - kRight) / 2, kHeight - 12) +
         escapeHtml(plot.x_label) + "</text>";
  const double middle = (kTop + kHeight - kBottom) / 2;
  svg +=
      format("<text transform=\"translate(14,%.1f) rotate(-90)\" text-anchor=\"middle\">", middle) +
      escapeHtml(plot.y_label) + "</text>";
  double row = kTop + 12;
  for (const PlotSeries& s : plot.series) {
    if (s.label.empty()) continue;
    svg += format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3\" ", kLeft + 8, row - 4) + "fill=\"" +
           s.colour + "\"/>";
    svg += format("<text x=\"%.1f\" y=\"%.1f\" class=\"key\">", kLeft + 15, row) +
           escapeHtml(s.label) + "</text>";
    row += 13;
  }
  return svg + "</svg>";
}

std::string escapeHtml(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string numberText(double value) { return std::isfinite(value) ? format("%.4g", value) : "–"; }

}  // namespace tenter::app
