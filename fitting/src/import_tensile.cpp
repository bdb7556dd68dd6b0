// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>

#include "import_specimen.h"
#include "import_table.h"
#include "tenter/core/median.h"
#include "tenter/fitting/import.h"

namespace tenter {

namespace {

using import::checkRange;
using import::NumberedTable;
using import::shown;

constexpr Eigen::Index kMinRows = 5;
constexpr double kMaxStrain = 1.0;
constexpr double kMaxForce_N = 20'000.0;  // as measurement files have it
constexpr double kMinStrain = 1e-4;       // a whole test below this is a displacement in metres
constexpr double kTurnFraction = 0.01;    // of the travel: less is the clamp's jitter
constexpr int kMaxTurns = 60;             // thirty cycles; more is not a test but noise
constexpr double kFirstRowsFraction = 0.06;
constexpr Eigen::Index kFewFirstRows = 8, kFirstRows = 32;
constexpr double kMaxExtrapolation = 0.05;  // of the strip's length
constexpr double kMax_mm = 2000.0;

struct Rows {
  Eigen::VectorXd displacement_m, force_N;
};

Result<void> checkSetup(const TensileImportOptions& o) {
  if (auto ok = import::checkSpecimen(o.info); !ok) return ok;
  if (auto ok = checkRange("--length-mm", 1e3 * o.length_m, 5.0, kMax_mm, "mm"); !ok) return ok;
  if (auto ok = checkRange("--width-mm", 1e3 * o.width_m, 0.1, kMax_mm, "mm"); !ok) return ok;
  if (auto ok = checkRange("--strips", o.strips, 1, 10000, "strips"); !ok) return ok;
  const double angle_deg = o.angle_rad * 180.0 / std::numbers::pi;
  if (auto ok = checkRange("--angle-deg", angle_deg, -180.0, 180.0, "degrees"); !ok) return ok;
  if (auto ok = checkRange("--force-sigma-N", o.force_sigma_N, 0.0, 1e6, "N"); !ok) return ok;
  const double bound_mm = 1e3 * kMaxExtrapolation * o.length_m;
  if (o.zero_strain != ZeroStrainRule::kGiven) return {};
  return checkRange("--zero-offset-mm", 1e3 * o.zero_offset_m, -bound_mm, bound_mm, "mm");
}

/// Units that cannot be right.
Result<void> checkRows(const NumberedTable& table, const Rows& rows, double length_m) {
  if (rows.force_N.size() < kMinRows) {
    return badInput(table.file, "",
                    "holds " + std::to_string(rows.force_N.size()) +
                        " rows; a tensile test needs " + std::to_string(kMinRows));
  }
  Eigen::Index at = 0;
  const double largest_m = rows.displacement_m.cwiseAbs().maxCoeff(&at);
  if (largest_m > kMaxStrain * length_m) {
    return badInput(table.file, table.place(at),
                    "the displacement " + shown(1e3 * largest_m) +
                        " mm is longer than the strip of " + shown(1e3 * length_m) + " mm",
                    "the first column is the displacement in mm, the second the force in N");
  }
  if (largest_m < kMinStrain * length_m) {
    return badInput(table.file, table.place(at),
                    "the largest displacement is " + shown(1e3 * largest_m) + " mm, a strain of " +
                        shown(largest_m / length_m),
                    "displacements must be in mm, not in metres");
  }
  const double largest_N = rows.force_N.cwiseAbs().maxCoeff(&at);
  if (largest_N > kMaxForce_N) {
    return badInput(table.file, table.place(at),
                    "the force " + shown(largest_N) + " N is beyond any test of cloth",
                    "the second column is the force in N");
  }
  if (rows.force_N.maxCoeff() <= 0.0) {
    return badInput(table.file, "", "no force is positive", "tension counts positive, in N");
  }
  return {};
}

/// Loading and unloading of every row: the direction turns where the clamp goes back by more than
/// its jitter. Returns the number of turns.
int branchesOf(const Eigen::VectorXd& displacement, std::vector<Branch>& branch) {
  const double jitter = kTurnFraction * (displacement.maxCoeff() - displacement.minCoeff());
  branch.assign(static_cast<std::size_t>(displacement.size()), Branch::kLoading);
  Branch now = Branch::kLoading;
  int turns = 0;
  std::size_t extreme = 0;
  for (std::size_t i = 0; i < branch.size(); ++i) {
    const double sign = now == Branch::kLoading ? 1.0 : -1.0;
    const auto value = [&](std::size_t k) {
      return sign * displacement(static_cast<Eigen::Index>(k));
    };
    if (value(i) >= value(extreme)) extreme = i;
    if (value(extreme) - value(i) > jitter) {
      now = now == Branch::kLoading ? Branch::kUnloading : Branch::kLoading;
      std::fill(branch.begin() + static_cast<std::ptrdiff_t>(extreme) + 1,
                branch.begin() + static_cast<std::ptrdiff_t>(i), now);
      extreme = i;
      ++turns;
    }
    branch[i] = now;
  }
  return turns;
}

/// At most kFirstRows of the first rows, evenly chosen.
std::vector<Eigen::Index> firstRows(Eigen::Index rows) {
  const auto share = static_cast<Eigen::Index>(kFirstRowsFraction * static_cast<double>(rows));
  const Eigen::Index last = std::min(std::max(share, kFewFirstRows), rows);
  const Eigen::Index step = (last + kFirstRows - 1) / kFirstRows;
  std::vector<Eigen::Index> chosen;
  for (Eigen::Index i = 0; i < last; i += step) chosen.push_back(i);
  return chosen;
}

/// Force at displacement 0 and its slope there: medians over the parabolas through all triples of
/// the first rows, so that neither an outlier nor the curve's own bend moves them far.
struct InitialLine {
  double slope_N_per_m = 0.0, force_N = 0.0;
  bool found = false;
};
InitialLine initialLine(const Rows& rows) {
  const auto chosen = firstRows(rows.force_N.size());
  std::vector<double> slopes, forces;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (std::size_t j = i + 1; j < chosen.size(); ++j) {
      for (std::size_t k = j + 1; k < chosen.size(); ++k) {
        const double a = rows.displacement_m(chosen[i]), b = rows.displacement_m(chosen[j]),
                     c = rows.displacement_m(chosen[k]);
        if (a == b || b == c || a == c) continue;
        const double first = rows.force_N(chosen[i]);
        const double ab = (rows.force_N(chosen[j]) - first) / (b - a);
        const double ac = (rows.force_N(chosen[k]) - first) / (c - a);
        const double bend = (ac - ab) / (c - b);
        slopes.push_back(ab - bend * (a + b));
        forces.push_back(first - ab * a + bend * a * b);
      }
    }
  }
  if (slopes.empty()) return {};
  return {medianOf(std::move(slopes)), medianOf(std::move(forces)), true};
}

Result<double> extrapolatedOffset(const NumberedTable& table, const Rows& rows, double length_m) {
  const InitialLine line = initialLine(rows);
  const std::string advice = "choose --zero-strain first-row, or given with --zero-offset-mm";
  if (!line.found || line.slope_N_per_m <= 0.0) {
    return badInput(table.file, table.place(0),
                    "the force does not rise over the first rows, so zero strain cannot be found",
                    advice);
  }
  const double offset_m = line.force_N / line.slope_N_per_m;
  if (std::abs(offset_m) > kMaxExtrapolation * length_m) {
    return badInput(table.file, table.place(0),
                    "the first rows put zero force " + shown(1e3 * offset_m) +
                        " mm away, more than 5 % of the strip",
                    advice);
  }
  return offset_m;
}

Result<void> setZeroStrain(const NumberedTable& table, const Rows& rows,
                           const TensileImportOptions& options, TensileSetup& setup) {
  switch (options.zero_strain) {
    case ZeroStrainRule::kFirstRow:
      setup.zero_strain_rule = "first-row";
      setup.zero_offset_m = -rows.displacement_m(0);
      return {};
    case ZeroStrainRule::kGiven:
      setup.zero_strain_rule = "given";
      setup.zero_offset_m = options.zero_offset_m;
      return {};
    case ZeroStrainRule::kExtrapolate:
      break;
  }
  const auto offset = extrapolatedOffset(table, rows, options.length_m);
  if (!offset) return offset.error();
  setup.zero_strain_rule = "extrapolate";
  setup.zero_offset_m = *offset;
  return {};
}

MeasurementFrame frameOf(const Rows& rows, Eigen::Index i, Branch branch, double sigma_N) {
  MeasurementFrame frame;
  frame.time_ns = static_cast<std::int64_t>(i) * 1'000'000'000;  // the file has no clock
  frame.branch = branch;
  frame.displacement_m = rows.displacement_m(i);
  frame.force_N = rows.force_N(i);
  frame.force_sigma_N = sigma_N;
  return frame;
}

}  // namespace

Result<ZeroStrainRule> parseZeroStrainRule(const std::string& name) {
  if (name == "extrapolate") return ZeroStrainRule::kExtrapolate;
  if (name == "first-row") return ZeroStrainRule::kFirstRow;
  if (name == "given") return ZeroStrainRule::kGiven;
  return usageError("no zero-strain rule is called '" + name + "'",
                    "there are: extrapolate first-row given");
}

Result<Measurement> importTensile(const std::filesystem::path& csv,
                                  const TensileImportOptions& options) {
  if (auto ok = checkSetup(options); !ok) return ok.error();
  const auto table = import::readNumberedTable(csv, 2);
  if (!table) return table.error();
  const Rows rows{1e-3 * table->values.col(0), table->values.col(1)};
  if (auto ok = checkRows(*table, rows, options.length_m); !ok) return ok.error();

  std::vector<Branch> branches;
  const int turns = branchesOf(rows.displacement_m, branches);
  if (turns > kMaxTurns) {
    return badInput(table->file, "",
                    "the displacement turns back " + std::to_string(turns) + " times",
                    "the first column must be the displacement in the order it was measured");
  }
  Measurement measurement = import::measurementOf(options.info, "tensile");
  measurement.sample_size_m = Vec2(options.length_m, options.width_m);
  TensileSetup setup;
  setup.length_m = options.length_m;
  setup.width_m = options.width_m;
  setup.strips = options.strips;
  setup.angle_rad = options.angle_rad;
  if (auto ok = setZeroStrain(*table, rows, options, setup); !ok) return ok.error();
  measurement.tensile = setup;
  for (Eigen::Index i = 0; i < rows.force_N.size(); ++i) {
    measurement.frames.push_back(
        frameOf(rows, i, branches[static_cast<std::size_t>(i)], options.force_sigma_N));
  }
  if (auto ok = validateMeasurement(measurement); !ok) return ok.error();
  return measurement;
}

}  // namespace tenter
