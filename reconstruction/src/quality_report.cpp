// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/quality_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "report_pictures.h"

namespace tenter {

namespace {

constexpr std::size_t kWorstFrames = 3;
constexpr double kMmPerMetre = 1e3;
/// Maps end where this share of the vertices lies below.
constexpr double kHighest = 0.98;

constexpr const char* kHead =
    "<!DOCTYPE html><html lang=\"en\"><head><meta "
    "charset=\"utf-8\"><title>Reconstruction</title><style>"
    "body{font:15px sans-serif;max-width:70em;margin:2em auto;padding:0 1em}table{border-collapse:"
    "collapse}td,th{border:1px solid #ccc;padding:2px 8px;text-align:right}figure{display:"
    "inline-block;margin:.6em}figcaption{color:#444}td.text{text-align:left}</style></head><body>";

std::string number(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

double share(const FrameQuality& frame, std::size_t vertices) {
  return static_cast<double>(frame.valid) / static_cast<double>(std::max<std::size_t>(vertices, 1));
}

std::string frameTable(const SeriesResult& result, std::size_t vertices) {
  std::string rows;
  for (const FrameQuality& frame : result.quality) {
    std::string notes;
    for (const std::string& warning : frame.warnings) notes += htmlText(warning) + "<br>";
    rows += "<tr><td>" + std::to_string(frame.number) + "</td><td>" +
            number("%.2f", 1e-9 * static_cast<double>(frame.time_ns)) + "</td><td>" +
            number("%.2f", 100.0 * share(frame, vertices)) + "</td><td>" +
            number("%.4f", kMmPerMetre * frame.sigma_median_m) + "</td><td>" +
            number("%.4f", frame.zncc_median) + "</td><td>" +
            number("%.4f", frame.residual_median_px) + "</td><td>" +
            number("%.3f", kMmPerMetre * frame.filled_m) + "</td><td>" +
            number("%.2f", frame.seconds) + "</td><td class=\"text\">" + notes + "</td></tr>";
  }
  return "<table><tr><th>frame</th><th>time s</th><th>valid %</th><th>sigma mm</th><th>ZNCC</th>"
         "<th>residual px</th><th>filled moved mm</th><th>seconds</th><th>notes</th></tr>" +
         rows + "</table>";
}

std::string curves(const SeriesResult& result, std::size_t vertices) {
  std::vector<double> valid, sigma, zncc, residual;
  for (const FrameQuality& frame : result.quality) {
    valid.push_back(share(frame, vertices));
    sigma.push_back(kMmPerMetre * frame.sigma_median_m);
    zncc.push_back(frame.zncc_median);
    residual.push_back(frame.residual_median_px);
  }
  return curvePicture("share of vertices that are valid", valid) +
         curvePicture("median sigma [mm]", sigma) + curvePicture("median ZNCC", zncc) +
         curvePicture("median residual of sightings [px]", residual);
}

/// Every frame is matched to the one at rest, so errors do not add up; if they did, views would
/// come to disagree.
std::string driftText(const SeriesResult& result) {
  const std::size_t part = std::max<std::size_t>(1, result.quality.size() / 5);
  const auto mean = [&](std::size_t from) {
    double sum = 0.0;
    for (std::size_t i = from; i < from + part; ++i) sum += result.quality[i].residual_median_px;
    return sum / static_cast<double>(part);
  };
  const double first = mean(0), last = mean(result.quality.size() - part);
  return "<p>Every frame is matched to the reference, so errors cannot add up. If views drifted, "
         "they "
         "would come to disagree: the median residual is " +
         number("%.4f", first) + " px over the first fifth of the frames and " +
         number("%.4f", last) + " px over the last. " +
         (last <= 2.0 * first + 0.02 ? "No drift is seen."
                                     : "<b>Views disagree more at the end.</b>") +
         "</p>";
}

std::string map(const SeriesResult& result, const std::string& title, std::vector<double> values,
                bool from_zero) {
  std::vector<double> sorted;
  for (const double value : values) {
    if (std::isfinite(value)) sorted.push_back(value);
  }
  if (sorted.empty()) return "";
  std::sort(sorted.begin(), sorted.end());
  const double high =
      sorted[static_cast<std::size_t>(kHighest * static_cast<double>(sorted.size() - 1))];
  const double low = from_zero ? 0.0 : sorted.front();
  return "<figure>" + mapPicture(result.rest, values, low, high) + "<figcaption>" +
         htmlText(title) + ": " + number("%.4g", low) + " (blue) to " + number("%.4g", high) +
         " (yellow)</figcaption></figure>";
}

std::string maps(const SeriesResult& result) {
  const VertexMaps& m = result.maps;
  const auto mean = [&](const std::vector<double>& sums, double scale) {
    std::vector<double> values;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      values.push_back(m.valid[i] > 0 ? scale * sums[i] / m.valid[i]
                                      : std::numeric_limits<double>::quiet_NaN());
    }
    return values;
  };
  std::vector<double> coverage;
  for (const int valid : m.valid)
    coverage.push_back(static_cast<double>(valid) / std::max(m.frames, 1));
  return map(result, "share of frames in which a vertex was seen", coverage, true) +
         map(result, "mean ZNCC", mean(m.zncc, 1.0), false) +
         map(result, "mean residual [px]", mean(m.residual_px, 1.0), true) +
         map(result, "mean sigma [mm]", mean(m.sigma_m, kMmPerMetre), true);
}

std::string worstFrames(const SeriesResult& result, const CameraView& view,
                        const FrameImageReader& image, std::size_t vertices) {
  std::vector<std::size_t> order(result.quality.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return result.quality[a].valid < result.quality[b].valid;
  });
  std::string html;
  for (std::size_t k = 0; k < std::min(kWorstFrames, order.size()); ++k) {
    const GrayImage pixels = image(order[k]);
    if (pixels.width == 0) continue;
    html += "<figure>" + overlayPicture(pixels, view, result.measurement.frames[order[k]]) +
            "<figcaption>frame " + std::to_string(result.quality[order[k]].number) + ", camera " +
            htmlText(view.name) + ": " +
            number("%.2f", 100.0 * share(result.quality[order[k]], vertices)) +
            " % valid (green valid, red not)</figcaption></figure>";
  }
  return html;
}

}  // namespace

std::string qualityReport(const SeriesResult& result, const CameraView& view,
                          const FrameImageReader& image) {
  const auto vertices = static_cast<std::size_t>(result.rest.mesh.vertexCount());
  std::string html = kHead;
  html += "<h1>Reconstruction of " + htmlText(result.measurement.name) + "</h1><p>" +
          htmlText(result.measurement.fabric) + ", " + htmlText(result.measurement.protocol) +
          ": " + std::to_string(result.quality.size()) + " frames, " + std::to_string(vertices) +
          " vertices; at rest " + std::to_string(result.rest.validCount()) +
          " were found, views disagree by " + number("%.4f", result.rest.residual_px) +
          " px, a pixel covers " + number("%.4f", kMmPerMetre * result.rest.pixel_m) + " mm.</p>";
  for (const std::string& warning : result.warnings)
    html += "<p><b>" + htmlText(warning) + "</b></p>";
  html += "<h2>Over the frames</h2>" + curves(result, vertices);
  html += "<h2>Drift check</h2>" + driftText(result);
  html += "<h2>Over the mesh</h2>" + maps(result);
  html += "<h2>Worst frames</h2>" + worstFrames(result, view, image, vertices);
  html += "<h2>All frames</h2>" + frameTable(result, vertices);
  return html + "</body></html>\n";
}

}  // namespace tenter
