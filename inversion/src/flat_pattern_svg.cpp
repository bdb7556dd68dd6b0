// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>

#include "tenter/inversion/flat_pattern.h"

namespace tenter {
namespace {

constexpr double kMarginMm = 10.0, kRulerMm = 100.0, kTextMm = 4.0;

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      out += c;
    }
  }
  return out;
}

std::string line(const Vec2& a, const Vec2& b, const char* style) {
  char text[200];
  std::snprintf(text, sizeof text, "<line x1=\"%.4f\" y1=\"%.4f\" x2=\"%.4f\" y2=\"%.4f\" %s/>\n",
                a[0], a[1], b[0], b[1], style);
  return text;
}

std::string label(const Vec2& at, const std::string& content) {
  char text[120];
  std::snprintf(text, sizeof text, "<text x=\"%.2f\" y=\"%.2f\" font-size=\"%.2f\">", at[0], at[1],
                kTextMm);
  return text + escaped(content) + "</text>\n";
}

}  // namespace

std::string patternSvg(const FlatPattern& pattern, const std::string& title) {
  const Vec2 low = pattern.places.rowwise().minCoeff(), high = pattern.places.rowwise().maxCoeff();
  const Vec2 size_mm = 1e3 * (high - low);
  const double width = std::max(size_mm[0], kRulerMm) + 2.0 * kMarginMm;
  const double height = size_mm[1] + 3.0 * kMarginMm + 2.0 * kTextMm;
  const auto page = [&](const Vec2& p) {
    return Vec2(kMarginMm + 1e3 * (p[0] - low[0]), kMarginMm + 1e3 * (high[1] - p[1]));
  };
  char head[400];
  std::snprintf(head, sizeof head,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.4fmm\" height=\"%.4fmm\" "
                "viewBox=\"0 0 %.4f %.4f\" font-family=\"sans-serif\">\n",
                width, height, width, height);
  std::string svg = head;
  svg += "<title>" + escaped(title) + "</title>\n<desc>Tenter flat pattern</desc>\n";
  const std::size_t n = pattern.outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    svg += line(page(pattern.places.col(pattern.outline[i])),
                page(pattern.places.col(pattern.outline[(i + 1) % n])),
                pattern.outline_is_cut[i] != 0
                    ? "stroke=\"#c00\" stroke-width=\"0.3\" stroke-dasharray=\"3 1\""
                    : "stroke=\"#000\" stroke-width=\"0.3\"");
  }
  if (pattern.warp.norm() > 0.0) {
    const double half = 0.1 * (high - low).minCoeff();
    const Vec2 middle = 0.5 * (low + high), along = half * pattern.warp;
    const Vec2 side(-along[1], along[0]), tip = middle + along;
    constexpr const char* kStyle = "stroke=\"#06c\" stroke-width=\"0.3\"";
    svg += line(page(middle - along), page(tip), kStyle);
    svg += line(page(tip), page(tip - 0.3 * along + 0.15 * side), kStyle);
    svg += line(page(tip), page(tip - 0.3 * along - 0.15 * side), kStyle);
  }
  const double foot = size_mm[1] + 2.0 * kMarginMm;
  svg += line(Vec2(kMarginMm, foot), Vec2(kMarginMm + kRulerMm, foot),
              "stroke=\"#000\" stroke-width=\"0.2\"");
  for (int k = 0; k <= 10; ++k) {
    const double x = kMarginMm + 0.1 * kRulerMm * k;
    svg += line(Vec2(x, foot), Vec2(x, foot - 2.0), "stroke=\"#000\" stroke-width=\"0.2\"");
  }
  svg += label(Vec2(kMarginMm, foot + 1.5 * kTextMm), "100 mm. " + title);
  return svg + "</svg>\n";
}

}  // namespace tenter
