// SPDX-License-Identifier: GPL-3.0-or-later
// The sample pushed step by step over the edge of a table.
#include <algorithm>
#include <cmath>

#include "rig_setup.h"
#include "sheet_sampler.h"
#include "tenter/twin/mounted_specimen.h"
#include "virtual_cloth.h"

namespace tenter {
namespace {

constexpr std::int64_t kFrameInterval_ns = 2'000'000'000;
constexpr double kFirstOverhang_m = 0.010, kLastOverhang_m = 0.080;
constexpr double kFirstDroop_per_m =
    1.0;  // z = -droop s^2 starts the first frame on the right side
constexpr double kSmallestStep_m = 1e-4;
constexpr double kSameLine_m = 1e-9;

/// The hanging part of a solved frame, by distance from the table's edge: one curve a line along
/// the push.
struct Hanging {
  std::vector<double> distance;         ///< From the edge [m], increasing from 0.
  std::vector<std::vector<Vec3>> line;  ///< In the rig's frame.

  Vec3 at(std::size_t row, double s) const {
    const auto above = std::upper_bound(distance.begin(), distance.end(), s);
    const std::size_t last = distance.size() - 2;
    const std::size_t i = std::min(
        last, static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - distance.begin() - 1, 0)));
    const Vec3 along = (line[row][i + 1] - line[row][i]) / (distance[i + 1] - distance[i]);
    return line[row][i] + (s - distance[i]) * along;
  }
};

class TableRun {
 public:
  TableRun(const CaptureOptions& options, const Fabric& specimen, const ClothSource& cloth)
      : options_(options),
        cloth_(cloth),
        areal_density_(specimen.areal_density_kg_per_m2),
        axis_(options.protocol == "bend-warp" ? 1 : 0),
        on_bias_(options.protocol == "bend-bias") {
    run_.rest = trackedMesh(options.tracked, on_bias_);
    run_.clips = {{"table", 0.0, "table"}};
  }

  Result<CaptureRun> run() {
    double done = 0.0;
    for (int i = 0; i < options_.frames; ++i) {
      const double share =
          options_.frames > 1 ? static_cast<double>(i) / (options_.frames - 1) : 1.0;
      const double overhang = kFirstOverhang_m + share * (kLastOverhang_m - kFirstOverhang_m);
      double step = overhang - done;
      while (done < overhang - kSameLine_m) {
        if (options_.cancelled && options_.cancelled()) return notConverged("cancelled");
        const double next = std::min(overhang, done + step);
        auto solved = push(next, next == overhang, i);
        if (!solved) return solved.error();
        if (*solved) {
          done = next;
          continue;
        }
        step *= 0.5;
        ++run_.statistics.subdivisions;
        if (step < kSmallestStep_m) {
          return notConverged("the virtual cloth found no stable equilibrium in frame " +
                              std::to_string(i));
        }
      }
      if (options_.progress) options_.progress(i + 1, options_.frames);
    }
    return std::move(run_);
  }

 private:
  /// Solves one overhang; false if there is no equilibrium from the last shape.
  Result<bool> push(double overhang, bool recorded, int frame) {
    const double edge = kSampleSide_m - overhang;
    GridLines lines{linesThrough(0.0, kSampleSide_m, options_.nodes, {}),
                    linesThrough(0.0, kSampleSide_m, options_.nodes, {}), options_.diagonals};
    (axis_ == 0 ? lines.u_lines : lines.v_lines) =
        linesThrough(0.0, kSampleSide_m, options_.nodes, {edge});
    SheetMesh sheet = sampleSheet(lines, on_bias_);
    SystemSetup setup;
    setup.areal_density_kg_per_m2 = areal_density_;
    ClipSetup table;
    table.id = "table";
    table.nodes = onTable(sheet.rest.positions, edge);
    setup.clips.push_back(table);
    auto system = ClothSystem::create(std::move(sheet), *cloth_.model,
                                      {cloth_.membrane, cloth_.bending}, setup);
    if (!system) return system.error();
    ClothState state = system->restState();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation()[axis_] = overhang;
    start(*system, lines, edge, state);
    system->setClipPose(state, 0, pose);

    EquilibriumSolver solver(*system);
    if (!findStableShape(solver, state, run_.statistics, options_.cancelled)) return false;
    remember(state.positions(system->sheet().nodeCount()), lines, edge);
    if (recorded) record(state.positions(system->sheet().nodeCount()), lines, edge, pose, frame);
    return true;
  }

  std::vector<int> onTable(const Points3& rest, double edge) const {
    std::vector<int> ids;
    for (Eigen::Index i = 0; i < rest.cols(); ++i) {
      if (rest(axis_, i) <= edge + kSameLine_m) ids.push_back(static_cast<int>(i));
    }
    return ids;
  }

  int nodeAt(const GridLines& lines, std::size_t along, std::size_t across) const {
    const int a = static_cast<int>(along), b = static_cast<int>(across);
    return axis_ == 0 ? lines.node(a, b) : lines.node(b, a);
  }
  const std::vector<double>& alongLines(const GridLines& lines) const {
    return axis_ == 0 ? lines.u_lines : lines.v_lines;
  }
  std::size_t acrossCount(const GridLines& lines) const {
    return axis_ == 0 ? lines.v_lines.size() : lines.u_lines.size();
  }

  /// The last shape, moved on with the cloth and straight beyond its old end: no strain to begin
  /// with.
  void start(const ClothSystem& system, const GridLines& lines, double edge,
             ClothState& state) const {
    const std::vector<double>& along = alongLines(lines);
    for (std::size_t i = 0; i < along.size(); ++i) {
      const double s = along[i] - edge;
      if (s <= kSameLine_m) continue;
      for (std::size_t row = 0; row < acrossCount(lines); ++row) {
        const int node = nodeAt(lines, i, row);
        auto place = state.q.segment<3>(3 * node);
        if (hanging_.line.empty()) {
          place = system.sheet().rest.positions.col(node);
          place[axis_] = kSampleSide_m + s;
          place[2] = -kFirstDroop_per_m * s * s;
        } else {
          place = hanging_.at(row, s);
        }
      }
    }
  }

  void remember(const Eigen::Ref<const Points3>& positions, const GridLines& lines, double edge) {
    hanging_.distance.clear();
    hanging_.line.assign(acrossCount(lines), {});
    const std::vector<double>& along = alongLines(lines);
    for (std::size_t i = 0; i < along.size(); ++i) {
      const double s = along[i] - edge;
      if (s < -kSameLine_m) continue;
      hanging_.distance.push_back(s);
      for (std::size_t row = 0; row < acrossCount(lines); ++row) {
        hanging_.line[row].emplace_back(positions.col(nodeAt(lines, i, row)));
      }
    }
  }

  void record(const Eigen::Ref<const Points3>& positions, const GridLines& lines, double edge,
              const Eigen::Isometry3d& pose, int frame) {
    const std::vector<double> here{edge}, none;
    const SheetSampler sampler(lines, run_.rest.positions.topRows<2>(),
                               cloth_.own ? Sampling::kLinear : Sampling::kCubic,
                               axis_ == 0 ? here : none, axis_ == 0 ? none : here);
    ExactFrame out;
    out.reading.time_ns = frame * kFrameInterval_ns;
    out.reading.branch = Branch::kLoading;
    out.reading.positions = sampler.sample(positions);
    ClipReading table;
    table.clip = "table";
    table.rig_from_clip = pose;
    table.clamped_vertices = onTable(run_.rest.positions, edge);
    Vec2 far = Vec2::Constant(kSampleSide_m);
    far[axis_] = edge;
    for (const Vec2& corner : {Vec2(0.0, 0.0), Vec2(far.x(), 0.0), far, Vec2(0.0, far.y())}) {
      table.outline_uv_m.push_back(materialPoint(corner, on_bias_));
    }
    for (const int v : table.clamped_vertices) {
      out.reading.positions.col(v) = pose * Vec3(run_.rest.positions.col(v));
    }
    out.reading.clips.push_back(std::move(table));
    if (options_.keep_moments) {
      out.moment = {{lines, axis_ == 0 ? here : none, axis_ == 0 ? none : here, positions, {pose}},
                    std::vector<double>(MountedSpecimen::kAxes, 0.0)};
      out.moment.positions_m.front() = pose.translation()[axis_];
    }
    run_.frames.push_back(std::move(out));
  }

  const CaptureOptions& options_;
  const ClothSource& cloth_;
  double areal_density_;
  int axis_;
  bool on_bias_;
  Hanging hanging_;
  CaptureRun run_;
};

}  // namespace

Result<CaptureRun> runTable(const CaptureOptions& options, const Fabric& specimen,
                            const ClothSource& cloth) {
  return TableRun(options, specimen, cloth).run();
}

}  // namespace tenter
