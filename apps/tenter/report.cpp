// SPDX-License-Identifier: GPL-3.0-or-later
#include "report.h"

#include <algorithm>
#include <cmath>

#include "svg_plot.h"
#include "tenter/mechanics/cloth_models.h"

namespace tenter::app {

namespace {

constexpr const char* kMeasuredColour = "#8a4b08";
constexpr const char* kModelColour = "#1f5fa8";
constexpr const char* kUnloadingColour = "#d79a4e";
constexpr double kBandSigmas = 1.96;
constexpr int kCurvePoints = 80;

constexpr const char* kStyle =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1020px;margin:2em auto;padding:0 "
    "1em;color:#222}"
    "h1,h2{font-weight:600;line-height:1.2}h2{margin-top:2em;border-bottom:1px solid #ccc}"
    "table{border-collapse:collapse;margin:1em 0}td,th{padding:.25em .8em;text-align:right;"
    "border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}"
    ".plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(430px,1fr));gap:12px}"
    "svg{width:100%;height:auto;background:#fff}svg text{font:11px system-ui,sans-serif;fill:#333}"
    "svg .title{font-weight:600;font-size:12px}svg .key{fill:inherit}.axis line{stroke:#e3e3e3}"
    ".held{color:#a02020}";

/// Standard deviation of k at any strain, interpolated between the knots that have one.
double bandOf(const MaterialComponent& c, double strain) {
  const auto& knots = c.curve.strains();
  if (c.knot_std.size() != knots.size()) return 0.0;
  const double e =
      std::clamp(c.curve.even() ? std::abs(strain) : strain, knots.front(), knots.back());
  const auto above = std::upper_bound(knots.begin(), knots.end(), e);
  const std::size_t i = above == knots.end() ? knots.size() - 1 : above - knots.begin();
  if (i == 0 || above == knots.end())
    return std::isfinite(c.knot_std[i]) ? kBandSigmas * c.knot_std[i] : 0.0;
  const double t = (e - knots[i - 1]) / (knots[i] - knots[i - 1]);
  const double s = (1 - t) * c.knot_std[i - 1] + t * c.knot_std[i];
  return std::isfinite(s) ? kBandSigmas * s : 0.0;
}

std::string statusText(ComponentStatus status) {
  switch (status) {
    case ComponentStatus::kFitted:
      return "fitted";
    case ComponentStatus::kAssumed:
      return "assumed";
    case ComponentStatus::kUnobserved:
      return "unobserved";
  }
  return "";
}

Plot curvePlot(const Material& material, const MaterialComponent& c) {
  Plot plot;
  plot.title = c.name + " (" + statusText(c.status) + ")";
  plot.x_label = "strain";
  plot.y_label = "stiffness k";
  if (const auto model = findClothModel(material.law); model.ok()) {
    if (const int index = (*model)->componentIndex(c.name); index >= 0) {
      const ComponentInfo& info = (*model)->component(index);
      plot.x_label = std::string(info.strain_measure) + " [" + std::string(info.strain_unit) + "]";
      plot.y_label = "k [" + std::string(info.stiffness_unit) + "]";
    }
  }
  double begin = c.curve.strains().front(), end = c.curve.strains().back();
  if (!(end > begin)) begin = std::min(c.observed_min, 0.0), end = c.observed_max;
  if (!(end > begin)) end = begin + 0.1;
  PlotSeries line{"k, 95 % band", kModelColour, false, {}, {}, {}};
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double e = begin + (end - begin) * i / kCurvePoints;
    line.x.push_back(e);
    line.y.push_back(c.curve.evaluate(e).stiffness);
    line.half_width.push_back(bandOf(c, e));
  }
  PlotSeries seen{"knots observed", kModelColour, true, {}, {}, {}};
  PlotSeries unseen{"knots unobserved", "#b03030", true, {}, {}, {}};
  for (std::size_t i = 0; i < c.curve.strains().size(); ++i) {
    const bool observed = i < c.knot_observed.size() && c.knot_observed[i];
    PlotSeries& into = observed ? seen : unseen;
    into.x.push_back(c.curve.strains()[i]);
    into.y.push_back(c.curve.stiffnesses()[i]);
  }
  plot.series.push_back(line);
  for (const PlotSeries& knots : {seen, unseen}) {
    if (!knots.x.empty()) plot.series.push_back(knots);
  }
  return plot;
}

Plot testPlot(const EvaluatedTest& test, bool held_out) {
  Plot plot;
  plot.title = test.residual.measurement + (held_out ? " (held out)" : "");
  plot.x_label = "displacement, in the test's own measure";
  const bool forces = std::isfinite(test.residual.force_rms_N);
  plot.y_label =
      forces ? "force summary [N; N m for torques]" : "position error, root mean square [mm]";
  PlotSeries loading{"measured, loading", kMeasuredColour, true, {}, {}, {}};
  PlotSeries unloading{"measured, unloading", kUnloadingColour, true, {}, {}, {}};
  PlotSeries model{forces ? "model, 95 % band" : "model", kModelColour, !forces, {}, {}, {}};
  for (std::size_t i = 0; i < test.frames.size(); ++i) {
    const FramePrediction& frame = test.frames[i];
    if (!frame.outcome.converged) continue;
    model.x.push_back(frame.displacement);
    if (!forces) {
      model.y.push_back(1e3 * frame.position_rms_m);
      continue;
    }
    PlotSeries& measured = frame.branch == Branch::kUnloading ? unloading : loading;
    measured.x.push_back(frame.displacement);
    measured.y.push_back(frame.summary_measured);
    model.y.push_back(frame.summary_predicted);
    if (i < test.band_total.size()) model.half_width.push_back(test.band_total[i]);
  }
  model.points = true;
  for (const PlotSeries& s : {loading, unloading, model}) {
    if (!s.x.empty()) plot.series.push_back(s);
  }
  return plot;
}

}  // namespace

Report::Report(const std::string& title) : title_(title) {
  body_ = "<h1>" + escapeHtml(title) + "</h1>";
}

void Report::heading(const std::string& text) { body_ += "<h2>" + escapeHtml(text) + "</h2>\n"; }

void Report::paragraph(const std::string& text) { body_ += "<p>" + escapeHtml(text) + "</p>\n"; }

void Report::list(const std::vector<std::string>& items) {
  body_ += "<ul>";
  for (const std::string& item : items) body_ += "<li>" + escapeHtml(item) + "</li>";
  body_ += "</ul>\n";
}

void Report::residualTable(const std::vector<TestResidual>& tests,
                           const std::vector<bool>& held_out) {
  body_ +=
      "<table><tr><th>test</th><th>frames</th><th>force RMS [N]</th><th>force NRMSE [%]</th>"
      "<th>position RMS [mm]</th><th>not converged</th><th>unstable</th></tr>";
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const TestResidual& t = tests[i];
    const bool held = i < held_out.size() && held_out[i];
    body_ += std::string("<tr") + (held ? " class=\"held\"" : "") + "><td>" +
             escapeHtml(t.measurement) + (held ? " (held out)" : "") + "</td><td>" +
             std::to_string(t.frames) + "</td><td>" + numberText(t.force_rms_N) + "</td><td>" +
             numberText(100.0 * t.force_nrmse) + "</td><td>" + numberText(1e3 * t.position_rms_m) +
             "</td><td>" + std::to_string(t.unconverged_frames) + "</td><td>" +
             std::to_string(t.unstable_frames) + "</td></tr>";
  }
  body_ += "</table>\n";
}

void Report::curves(const Material& material) {
  body_ += "<div class=\"plots\">";
  for (const MaterialComponent& c : material.components) body_ += renderSvg(curvePlot(material, c));
  body_ += "</div>\n";
}

void Report::tests(const std::vector<EvaluatedTest>& tests, const std::vector<bool>& held_out) {
  body_ += "<div class=\"plots\">";
  for (std::size_t i = 0; i < tests.size(); ++i) {
    body_ += renderSvg(testPlot(tests[i], i < held_out.size() && held_out[i]));
  }
  body_ += "</div>\n";
}

std::string Report::html() const {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
         escapeHtml(title_) + "</title><style>" + kStyle + "</style></head>\n<body>\n" + body_ +
         "</body></html>\n";
}

}  // namespace tenter::app
