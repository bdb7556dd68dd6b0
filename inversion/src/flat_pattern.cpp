// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/flat_pattern.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <queue>
#include <set>
#include <utility>

#include "mesh_cuts.h"

namespace tenter {
namespace {

constexpr int kMaxIterations = 60;
/// Least angle defect that another cut is made for.
constexpr double kWorthCutting_rad = 1e-3;

/// An edge of the pattern with its length on the surface.
struct Side {
  int a, b;
  double length_m;
};

std::vector<Side> sidesOf(const CutMesh& cut, const TriangleMesh& surface) {
  std::set<std::pair<int, int>> seen;
  std::vector<Side> sides;
  for (const Triangle& t : cut.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
      if (!seen.insert({a, b}).second) continue;
      const double length =
          (surface.positions.col(cut.vertices[a]) - surface.positions.col(cut.vertices[b])).norm();
      sides.push_back({a, b, length});
    }
  }
  return sides;
}

/// The corner beyond the edge from a to b, on its left, that has these distances from both.
Vec2 apex(const Vec2& a, const Vec2& b, double from_a, double from_b) {
  const Vec2 along = b - a;
  const double length = along.norm();
  const double x = (length * length + from_a * from_a - from_b * from_b) / (2.0 * length);
  const double y = std::sqrt(std::max(0.0, from_a * from_a - x * x));
  return a + (x * along + y * Vec2(-along[1], along[0])) / length;
}

/// Lays triangle after triangle beside one that is already there: exact for what can be unrolled.
Points2 layOut(const CutMesh& cut, const TriangleMesh& surface) {
  const auto length = [&](int a, int b) {
    return (surface.positions.col(cut.vertices[a]) - surface.positions.col(cut.vertices[b])).norm();
  };
  std::vector<std::vector<int>> at(cut.vertices.size());
  for (std::size_t t = 0; t < cut.triangles.size(); ++t)
    for (const int v : cut.triangles[t]) at[v].push_back(static_cast<int>(t));
  Points2 places = Points2::Zero(2, static_cast<Eigen::Index>(cut.vertices.size()));
  std::vector<char> known(cut.vertices.size(), 0), done(cut.triangles.size(), 0);
  const Triangle& first = cut.triangles[0];
  places.col(first[1]) = Vec2(length(first[0], first[1]), 0.0);
  known[first[0]] = known[first[1]] = 1;
  std::queue<int> open({0});
  done[0] = 1;
  while (!open.empty()) {
    const Triangle t = cut.triangles[open.front()];
    open.pop();
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[(k + 1) % 3], b = t[(k + 2) % 3], c = t[k];
      if (known[c] != 0) continue;
      places.col(c) = apex(places.col(a), places.col(b), length(a, c), length(b, c));
      known[c] = 1;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      for (const int other : at[t[k]]) {
        const Triangle& n = cut.triangles[other];
        const bool shares = std::count_if(n.begin(), n.end(), [&](int v) {
                              return std::find(t.begin(), t.end(), v) != t.end();
                            }) == 2;
        if (!shares || std::exchange(done[other], 1) != 0) continue;
        open.push(other);
      }
    }
  }
  return places;
}

double distortionOf(const Points2& places, const std::vector<Side>& sides) {
  double worst = 0.0;
  for (const Side& s : sides) {
    const double flat = (places.col(s.b) - places.col(s.a)).norm();
    worst = std::max(worst, std::abs(flat / s.length_m - 1.0));
  }
  return worst;
}

double energyOf(const Points2& places, const std::vector<Side>& sides) {
  double sum = 0.0;
  for (const Side& s : sides) {
    const double strain = (places.col(s.b) - places.col(s.a)).norm() / s.length_m - 1.0;
    sum += strain * strain;
  }
  return sum;
}

/// Levenberg and Marquardt's method on the strains of the edges.
void relax(Points2& places, const std::vector<Side>& sides) {
  using Sparse = Eigen::SparseMatrix<double>;
  double damping = 1e-6, energy = energyOf(places, sides);
  Eigen::SimplicialLDLT<Sparse> solver;
  for (int k = 0; k < kMaxIterations && energy > 1e-24; ++k) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd strain(static_cast<Eigen::Index>(sides.size()));
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const Side& s = sides[i];
      const Vec2 d = places.col(s.b) - places.col(s.a);
      const auto row = static_cast<int>(i);
      strain[row] = d.norm() / s.length_m - 1.0;
      for (int c = 0; c < 2; ++c) {
        const double slope = d[c] / (d.norm() * s.length_m);
        entries.emplace_back(row, 2 * s.b + c, slope);
        entries.emplace_back(row, 2 * s.a + c, -slope);
      }
    }
    Sparse j(strain.size(), places.size());
    j.setFromTriplets(entries.begin(), entries.end());
    Sparse normal = j.transpose() * j;
    const double scale = normal.diagonal().mean();
    for (Eigen::Index c = 0; c < normal.cols(); ++c) normal.coeffRef(c, c) += damping * scale;
    solver.compute(normal);
    const Eigen::VectorXd step = solver.solve(-(j.transpose() * strain));
    const Points2 trial = places + Eigen::Map<const Points2>(step.data(), 2, places.cols());
    const double trial_energy = energyOf(trial, sides);
    if (!(trial_energy < energy)) {
      damping *= 10.0;
      if (damping > 1e6) return;
      continue;
    }
    const bool settled = trial_energy > (1.0 - 1e-6) * energy;
    places = trial;
    energy = trial_energy;
    damping = std::max(1e-9, 0.2 * damping);
    if (settled) return;
  }
}

bool crosses(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const auto side = [](const Vec2& p, const Vec2& q, const Vec2& r) {
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
  };
  return side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
}

bool overlaps(const FlatPattern& p) {
  for (const Triangle& t : p.triangles) {
    const Vec2 a = p.places.col(t[1]) - p.places.col(t[0]),
               b = p.places.col(t[2]) - p.places.col(t[0]);
    if (!(a[0] * b[1] - a[1] * b[0] > 0.0)) return true;
  }
  const std::size_t n = p.outline.size();
  const auto at = [&](std::size_t i) { return Vec2(p.places.col(p.outline[i % n])); };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j)
      if ((j + 1) % n != i && crosses(at(i), at(i + 1), at(j), at(j + 1))) return true;
  return false;
}

/// Mean over the triangles of the warp's direction, from their uv.
Vec2 warpOf(const FlatPattern& p, const TriangleMesh& surface) {
  Vec2 sum = Vec2::Zero();
  if (!surface.hasUv()) return sum;
  for (std::size_t t = 0; t < p.triangles.size(); ++t) {
    const Triangle &flat = p.triangles[t], &ids = surface.triangles[t];
    Mat2 uv, place;
    for (int k = 0; k < 2; ++k) {
      uv.col(k) = surface.uv.col(ids[static_cast<std::size_t>(k) + 1]) - surface.uv.col(ids[0]);
      place.col(k) = p.places.col(flat[static_cast<std::size_t>(k) + 1]) - p.places.col(flat[0]);
    }
    const double determinant = uv.determinant();
    if (!(std::abs(determinant) > 0.0)) continue;
    Mat2 inverse;
    inverse << uv(1, 1), -uv(0, 1), -uv(1, 0), uv(0, 0);
    const Vec2 warp = place * (inverse * Vec2::UnitY()) / determinant;
    sum += place.determinant() * warp.normalized();
  }
  return sum.norm() > 0.0 ? Vec2(sum.normalized()) : sum;
}

std::vector<char> marked(std::size_t count, const std::vector<int>& ids) {
  std::vector<char> out(count, 0);
  for (const int i : ids) out[i] = 1;
  return out;
}

class Unroller {
 public:
  Unroller(const TriangleMesh& surface, MeshTopology topology, const FlatPatternOptions& options)
      : surface_(surface),
        topology_(std::move(topology)),
        options_(options),
        cut_(topology_.edges.size(), 0) {}

  Result<FlatPattern> run() {
    if (auto done = joinBorders(); !done) return done.error();
    Eigen::VectorXd defect = angleDefects(surface_, topology_).cwiseAbs();
    for (int cuts = 0;; ++cuts) {
      FlatPattern pattern = flatten();
      if (pattern.distortion <= options_.distortion) {
        if (!overlaps(pattern)) return pattern;
        return badInput("", "", "unrolled in one piece it would overlap itself",
                        "cut the surface into several pieces");
      }
      for (const int v : border_) defect[v] = 0.0;
      Eigen::Index worst = 0;
      const bool more = cuts < options_.max_cuts && defect.maxCoeff(&worst) > kWorthCutting_rad;
      if (!more) return tooCurved(pattern.distortion, cuts);
      const auto count = static_cast<std::size_t>(surface_.vertexCount());
      cutAlong(shortestPath(surface_, topology_, marked(count, {static_cast<int>(worst)}),
                            marked(count, border_)));
    }
  }

 private:
  /// One border remains.
  Result<void> joinBorders() {
    const auto count = static_cast<std::size_t>(surface_.vertexCount());
    const auto loops = borderLoops(surface_.triangles, surface_.vertexCount());
    if (loops.empty())
      return badInput("", "", "has no border, so it cannot be unrolled", "cut it open");
    border_ = loops[0];
    for (std::size_t i = 1; i < loops.size(); ++i) {
      cutAlong(shortestPath(surface_, topology_, marked(count, loops[i]), marked(count, border_)));
      border_.insert(border_.end(), loops[i].begin(), loops[i].end());
    }
    const CutMesh open = cutOpen(surface_, topology_, cut_);
    const auto corners = static_cast<int>(open.vertices.size());
    const auto edges = static_cast<int>(sidesOf(open, surface_).size());
    if (corners - edges + static_cast<int>(open.triangles.size()) != 1)
      return badInput("", "", "has handles, so it cannot be unrolled in one piece");
    return {};
  }

  void cutAlong(const std::vector<int>& path) {
    ++cuts_;
    for (const int e : path) {
      cut_[e] = 1;
      for (const int v : topology_.edges[e].vertices) border_.push_back(v);
    }
  }

  FlatPattern flatten() const {
    const CutMesh open = cutOpen(surface_, topology_, cut_);
    const std::vector<Side> sides = sidesOf(open, surface_);
    FlatPattern out;
    out.places = layOut(open, surface_);
    relax(out.places, sides);
    out.distortion = distortionOf(out.places, sides);
    out.vertices = open.vertices;
    out.triangles = open.triangles;
    out.outline = borderLoops(open.triangles, static_cast<int>(open.vertices.size()))[0];
    out.cuts = cuts_;
    std::set<std::pair<int, int>> cut;
    for (std::size_t e = 0; e < cut_.size(); ++e)
      if (cut_[e] != 0)
        cut.insert(std::minmax(topology_.edges[e].vertices[0], topology_.edges[e].vertices[1]));
    for (std::size_t i = 0; i < out.outline.size(); ++i) {
      const int a = out.vertices[out.outline[i]],
                b = out.vertices[out.outline[(i + 1) % out.outline.size()]];
      out.outline_is_cut.push_back(cut.contains(std::minmax(a, b)) ? 1 : 0);
    }
    out.warp = warpOf(out, surface_);
    return out;
  }

  static Error tooCurved(double distortion, int cuts) {
    char text[120];
    std::snprintf(text, sizeof text,
                  "cannot be unrolled: after %d cuts an edge still changes its length by %.3g %%",
                  cuts, 100.0 * distortion);
    return badInput("", "", text,
                    "allow more distortion or more cuts, or sew it of several pieces");
  }

  const TriangleMesh& surface_;
  MeshTopology topology_;
  FlatPatternOptions options_;
  std::vector<char> cut_;  ///< One an edge.
  int cuts_ = 0;
  std::vector<int> border_;  ///< Vertices on the border or on a cut.
};

}  // namespace

Result<FlatPattern> unroll(const TriangleMesh& surface, const FlatPatternOptions& options) {
  if (auto valid = validateMesh(surface); !valid) return valid.error();
  auto topology = buildTopology(surface);
  if (!topology) return topology.error();
  return Unroller(surface, std::move(topology).value(), options).run();
}

}  // namespace tenter
