// SPDX-License-Identifier: GPL-3.0-or-later
#include "grid_propagation.h"

#include <algorithm>
#include <cmath>

#include "opencv_threads.h"
#include "parallel_for.h"

namespace tenter {

namespace {

/// Nodes spread from the best matches first: these are the classes of ZNCC.
constexpr double kClasses[] = {0.95, 0.9, 0.8, 0.0};
/// Neighbours from which an unmatched node is tried.
constexpr std::size_t kAttempts = 4;
/// A match may lie so far from what a neighbour predicts: a fixed part [px] and one by distance,
/// that is a change of strain. A false match is a grain of texture away, or more.
constexpr double kJump_px = 1.0, kJumpPerDistance = 0.1;
/// A second place that fits nearly as well makes a match ambiguous.
constexpr double kRivalZncc = 0.85;
/// Side of a cell in subsets, and seeds sown in one.
constexpr int kCellSubsets = 3, kSeedsPerCell = 3;
/// Searches of the whole image, and with turned templates; they take long.
constexpr int kWideSeeds = 12, kTurnedSeeds = 4;
/// From here on an affine match is good enough to begin the real one.
constexpr double kStartZncc = 0.6;

SubsetMatcher affineMatcher(const GradientImage& reference, MatchOptions options) {
  options.order = 1;
  return {reference, options};
}

SubsetWarp withoutCurvature(SubsetWarp warp) {
  for (std::size_t k = 3; k < 6; ++k) warp.u[k] = warp.v[k] = 0.0;
  return warp;
}

}  // namespace

std::vector<int> PointGrid::neighbours(int i) const {
  const int column = i % columns, row = i / columns;
  std::vector<int> around;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c) {
      if (index(c, r) != i) around.push_back(index(c, r));
    }
  }
  return around;
}

GridPropagation::GridPropagation(const GradientImage& reference, const SplineImage& deformed,
                                 const SeedSearch& search, const PointGrid& grid,
                                 const CorrelateOptions& options)
    : matcher_(reference, options.match),
      affine_(affineMatcher(reference, options.match)),
      deformed_(deformed),
      search_(search),
      grid_(grid),
      options_(options),
      nodes_(static_cast<std::size_t>(grid.size())),
      scratch_(static_cast<std::size_t>(std::max(options.threads, 1))) {
  makeCells();
}

void GridPropagation::makeCells() {
  const int side = std::max(1, kCellSubsets * options_.match.subset_px / grid_.step_px);
  const int across = (grid_.columns + side - 1) / side, down = (grid_.rows + side - 1) / side;
  cells_.resize(static_cast<std::size_t>(across) * down);
  for (int i = 0; i < grid_.size(); ++i) {
    const int column = i % grid_.columns / side, row = i / grid_.columns / side;
    cells_[static_cast<std::size_t>(row) * across + column].nodes.push_back(i);
  }
  // The middle of an image shows the specimen; seeds there are most likely to be good.
  const Vec2 centre = 0.5 * (grid_.position(0) + grid_.position(grid_.size() - 1));
  std::stable_sort(cells_.begin(), cells_.end(), [&](const Cell& left, const Cell& right) {
    const auto distance = [&](const Cell& cell) {
      return (grid_.position(cell.nodes[cell.nodes.size() / 2]) - centre).norm();
    };
    return distance(left) < distance(right);
  });
}

void GridPropagation::run() {
  for (int round = 0; round < kSeedsPerCell; ++round) {
    for (Cell& cell : cells_) {
      if (!keepGoing()) return;
      if (sow(cell)) spread();
    }
  }
}

bool GridPropagation::keepGoing() {
  if (!stopped_ && options_.keep_going) {
    stopped_ = !options_.keep_going(static_cast<double>(matched_) / grid_.size());
  }
  return !stopped_;
}

void GridPropagation::spread() {
  bool more = true;
  while (more && keepGoing()) {
    more = std::any_of(std::begin(kClasses), std::end(kClasses),
                       [this](double zncc) { return spreadRound(zncc); });
  }
}

/// Matches all nodes that have a matched neighbour of this quality; false if there is none.
bool GridPropagation::spreadRound(double least_zncc) {
  struct Task {
    int node, parent;
    SubsetMatch match;
  };
  std::vector<Task> tasks;
  for (const int i : frontier_) {
    const int parent = bestParent(i, least_zncc);
    if (parent >= 0) tasks.push_back({i, parent, {}});
  }
  if (tasks.empty()) return false;
  const auto guessOf = [this](const Task& task) {
    const SubsetWarp& warp = nodes_[task.parent].match.warp;
    const Vec2 offset = grid_.position(task.node) - grid_.position(task.parent);
    const bool beyond = grid_.step_px > options_.match.subset_px / 2;
    return (beyond ? withoutCurvature(warp) : warp).movedBy(offset);
  };
  parallelFor(tasks.size(), options_.threads, [&](std::size_t k, std::size_t worker) {
    tasks[k].match = matcher_.match(deformed_, grid_.position(tasks[k].node), guessOf(tasks[k]),
                                    scratch_[worker]);
  });
  for (const Task& task : tasks) {
    nodes_[task.node].tried.push_back(task.parent);
    const Vec2 jump = task.match.warp.displacement() - guessOf(task).displacement();
    const double distance = (grid_.position(task.node) - grid_.position(task.parent)).norm();
    SubsetMatch match = task.match;
    if (jump.norm() > kJump_px + kJumpPerDistance * distance) match.end = MatchEnd::kDiverged;
    keepMatch(task.node, match);
  }
  std::erase_if(frontier_, [this](int i) {
    Node& node = nodes_[i];
    node.in_frontier = !node.matched && bestParent(i, 0.0) >= 0;
    return !node.in_frontier;
  });
  return true;
}

/// The matched neighbour of node i that correlates best and was not tried, or -1.
int GridPropagation::bestParent(int i, double least_zncc) const {
  const Node& node = nodes_[i];
  if (node.tried.size() >= kAttempts) return -1;
  int best = -1;
  for (const int other : grid_.neighbours(i)) {
    const Node& candidate = nodes_[other];
    if (!candidate.matched || candidate.match.zncc < least_zncc) continue;
    if (best >= 0 && candidate.match.zncc <= nodes_[best].match.zncc) continue;
    if (std::find(node.tried.begin(), node.tried.end(), other) == node.tried.end()) best = other;
  }
  return best;
}

void GridPropagation::keepMatch(int i, const SubsetMatch& match) {
  Node& node = nodes_[i];
  if (node.tried.size() <= 1 || match.zncc > node.match.zncc) node.match = match;
  if (match.end != MatchEnd::kConverged || match.zncc < options_.min_zncc) return;
  node.match = match;
  node.matched = true;
  ++matched_;
  for (const int other : grid_.neighbours(i)) {
    Node& neighbour = nodes_[other];
    if (neighbour.matched || neighbour.in_frontier) continue;
    neighbour.in_frontier = true;
    frontier_.push_back(other);
  }
}

/// Tries the next seed of a cell that nothing has reached; true if it took.
bool GridPropagation::sow(Cell& cell) {
  const auto reached = [this](int i) { return nodes_[i].matched; };
  if (std::any_of(cell.nodes.begin(), cell.nodes.end(), reached)) return false;
  const std::size_t count = cell.nodes.size();
  const std::size_t places[kSeedsPerCell] = {count / 2, count / 5, count - 1 - count / 5};
  const int i = cell.nodes[places[cell.seeds++]];
  return seed(i, guessFromNearest(i));
}

SubsetWarp GridPropagation::guessFromNearest(int i) const {
  double least = std::numeric_limits<double>::infinity();
  SubsetWarp guess;
  if (matched_ == 0) return guess;
  for (int other = 0; other < grid_.size(); ++other) {
    const Vec2 offset = grid_.position(i) - grid_.position(other);
    if (!nodes_[other].matched || offset.norm() >= least) continue;
    least = offset.norm();
    guess = withoutCurvature(nodes_[other].match.warp).movedBy(offset);
  }
  return guess;
}

bool GridPropagation::seed(int i, const SubsetWarp& guess) {
  const OpencvThreads threads(options_.threads);
  using Reach = SeedSearch::Reach;
  const Vec2 point = grid_.position(i);
  if (seedFrom(i, search_.find(point, guess, Reach::kNear))) return true;
  if (wide_seeds_ >= kWideSeeds) return false;
  ++wide_seeds_;
  if (seedFrom(i, search_.find(point, guess, Reach::kAll))) return true;
  if (matched_ > 0 || turned_seeds_ >= kTurnedSeeds) return false;
  ++turned_seeds_;
  return seedFrom(i, search_.find(point, guess, Reach::kTurned));
}

bool GridPropagation::seedFrom(int i, const std::vector<SubsetWarp>& candidates) {
  std::vector<SubsetMatch> found;
  for (const SubsetWarp& candidate : candidates) {
    const Vec2 point = grid_.position(i);
    const SubsetMatch start = affine_.match(deformed_, point, candidate, scratch_[0]);
    if (start.end != MatchEnd::kConverged || start.zncc < kStartZncc) continue;
    const SubsetMatch match = matcher_.match(deformed_, point, start.warp, scratch_[0]);
    if (match.end == MatchEnd::kConverged && match.zncc >= options_.min_zncc)
      found.push_back(match);
  }
  if (found.empty()) return false;
  std::stable_sort(found.begin(), found.end(),
                   [](const SubsetMatch& a, const SubsetMatch& b) { return a.zncc > b.zncc; });
  if (!seedIsUnique(i, found)) return false;
  keepMatch(i, found.front());
  return true;
}

/// Whether no other place of the deformed image fits nearly as well, and the reference does not
/// show the same again.
bool GridPropagation::seedIsUnique(int i, const std::vector<SubsetMatch>& found) {
  const SubsetMatch& best = found.front();
  for (const SubsetMatch& other : found) {
    const Vec2 apart = other.warp.displacement() - best.warp.displacement();
    if (apart.norm() < kJump_px || other.zncc < kRivalZncc * best.zncc) continue;
    repeat_ = SeedSearch::Repeat{apart, other.zncc};
    return false;
  }
  const auto repeat = search_.repeatOf(grid_.position(i));
  if (!repeat || repeat->zncc < kRivalZncc * best.zncc) return true;
  repeat_ = repeat;
  return false;
}

}  // namespace tenter
