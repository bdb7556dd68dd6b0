// SPDX-License-Identifier: GPL-3.0-or-later
#include "sheet_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tenter {
namespace {

/// Weights of the lines first .. first + 3; those outside the grid are zero.
struct LineWeights {
  int first = 0;
  std::array<double, 4> weight{};
};

class LineInterpolation {
 public:
  LineInterpolation(const std::vector<double>& lines, const std::vector<double>& breaks)
      : lines_(lines) {
    for (const double line : lines) {
      is_break_.push_back(std::any_of(breaks.begin(), breaks.end(),
                                      [&](double b) { return std::abs(b - line) < kSame; }));
    }
    is_break_.front() = is_break_.back() = true;
  }

  int cell(double x) const {
    const auto above = std::upper_bound(lines_.begin(), lines_.end(), x);
    return std::clamp(static_cast<int>(above - lines_.begin()) - 1, 0,
                      static_cast<int>(lines_.size()) - 2);
  }

  LineWeights cubic(double x) const {
    const int i = cell(x);
    const double h = lines_[i + 1] - lines_[i], t = (x - lines_[i]) / h;
    LineWeights out{i - 1, {}};
    out.weight[1] += (1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t);
    out.weight[2] += t * t * (3.0 - 2.0 * t);
    addSlope(i, i, h * t * (1.0 - t) * (1.0 - t), out);
    addSlope(i + 1, i, h * t * t * (t - 1.0), out);
    return out;
  }

 private:
  static constexpr double kSame = 1e-9;

  /// Slope at `line` for the cell `i`, from the parabola through the nearest three lines on one
  /// side of any break.
  void addSlope(int line, int i, double factor, LineWeights& out) const {
    int a = line - 1, b = line, c = line + 1;
    if (is_break_[line] && line == i) {
      if (is_break_[i + 1]) return addChord(i, factor, out);
      a = i, b = i + 1, c = i + 2;
    } else if (is_break_[line]) {
      if (is_break_[i]) return addChord(i, factor, out);
      a = i - 1, b = i, c = i + 1;
    }
    const double x = lines_[line], xa = lines_[a], xb = lines_[b], xc = lines_[c];
    out.weight[a - out.first] += factor * (2.0 * x - xb - xc) / ((xa - xb) * (xa - xc));
    out.weight[b - out.first] += factor * (2.0 * x - xa - xc) / ((xb - xa) * (xb - xc));
    out.weight[c - out.first] += factor * (2.0 * x - xa - xb) / ((xc - xa) * (xc - xb));
  }

  void addChord(int i, double factor, LineWeights& out) const {
    const double h = lines_[i + 1] - lines_[i];
    out.weight[1] -= factor / h;
    out.weight[2] += factor / h;
  }

  const std::vector<double>& lines_;
  std::vector<bool> is_break_;
};

}  // namespace

SheetSampler::SheetSampler(const GridLines& lines, const Points2& places, Sampling sampling,
                           const std::vector<double>& breaks_x,
                           const std::vector<double>& breaks_y) {
  const LineInterpolation along_x(lines.u_lines, breaks_x), along_y(lines.v_lines, breaks_y);
  shares_.resize(static_cast<std::size_t>(places.cols()));
  for (Eigen::Index p = 0; p < places.cols(); ++p) {
    auto& shares = shares_[static_cast<std::size_t>(p)];
    const double x = places(0, p), y = places(1, p);
    if (sampling == Sampling::kCubic) {
      const LineWeights wx = along_x.cubic(x), wy = along_y.cubic(y);
      for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
          const double weight = wx.weight[i] * wy.weight[j];
          if (weight != 0.0) shares.push_back({lines.node(wx.first + i, wy.first + j), weight});
        }
      }
      continue;
    }
    const int i = along_x.cell(x), j = along_y.cell(y);
    const double s = (x - lines.u_lines[i]) / (lines.u_lines[i + 1] - lines.u_lines[i]);
    const double t = (y - lines.v_lines[j]) / (lines.v_lines[j + 1] - lines.v_lines[j]);
    const int a = lines.node(i, j), b = lines.node(i + 1, j), c = lines.node(i + 1, j + 1),
              d = lines.node(i, j + 1);
    const bool other = lines.diagonals == DiagonalPattern::kAlternating && (i + j) % 2 == 1;
    if (other) {
      shares = s + t <= 1.0 ? std::vector<Share>{{a, 1.0 - s - t}, {b, s}, {d, t}}
                            : std::vector<Share>{{b, 1.0 - t}, {c, s + t - 1.0}, {d, 1.0 - s}};
    } else {
      shares = t <= s ? std::vector<Share>{{a, 1.0 - s}, {b, s - t}, {c, t}}
                      : std::vector<Share>{{a, 1.0 - t}, {c, s}, {d, t - s}};
    }
  }
}

Points3 SheetSampler::sample(const Eigen::Ref<const Points3>& nodes) const {
  Points3 out = Points3::Zero(3, static_cast<Eigen::Index>(shares_.size()));
  for (std::size_t p = 0; p < shares_.size(); ++p) {
    for (const Share& share : shares_[p])
      out.col(static_cast<Eigen::Index>(p)) += share.weight * nodes.col(share.node);
  }
  return out;
}

}  // namespace tenter
