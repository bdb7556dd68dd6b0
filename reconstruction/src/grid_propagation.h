// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "seed_search.h"
#include "tenter/reconstruction/correlate.h"

namespace tenter {

/// A regular grid of points in the reference.
struct PointGrid {
  int x0 = 0, y0 = 0, columns = 0, rows = 0, step_px = 1;

  int size() const { return columns * rows; }
  int index(int column, int row) const { return row * columns + column; }
  Vec2 position(int i) const {
    return {x0 + step_px * (i % columns), y0 + step_px * (i / columns)};
  }
  /// All that the grid holds of the eight around node i.
  std::vector<int> neighbours(int i) const;
};

/// Matches all nodes of a grid: from seeds, then outwards from the best matched nodes
/// (reliability-guided, [Pan09]), in rounds whose nodes are independent of each other.
class GridPropagation {
 public:
  /// Holds references to all but the options' values; they must outlive it.
  GridPropagation(const GradientImage& reference, const SplineImage& deformed,
                  const SeedSearch& search, const PointGrid& grid, const CorrelateOptions& options);

  void run();

  const SubsetMatch& match(int i) const { return nodes_[i].match; }
  bool matched(int i) const { return nodes_[i].matched; }
  /// Where the texture was seen to repeat; nodes that nothing reached are then ambiguous.
  const std::optional<SeedSearch::Repeat>& repeat() const { return repeat_; }

 private:
  struct Node {
    SubsetMatch match;  ///< The best attempt while there is no match.
    bool matched = false, in_frontier = false;
    std::vector<int> tried;  ///< Neighbours whose motion was taken as guess.
  };
  /// A piece of the grid in which seeds are sown together.
  struct Cell {
    std::vector<int> nodes;
    int seeds = 0;
  };

  void makeCells();
  void spread();
  bool spreadRound(double least_zncc);
  int bestParent(int i, double least_zncc) const;
  void keepMatch(int i, const SubsetMatch& match);
  bool sow(Cell& cell);
  bool seed(int i, const SubsetWarp& guess);
  bool seedFrom(int i, const std::vector<SubsetWarp>& candidates);
  bool seedIsUnique(int i, const std::vector<SubsetMatch>& found);
  SubsetWarp guessFromNearest(int i) const;
  bool keepGoing();

  const SubsetMatcher matcher_, affine_;
  const SplineImage& deformed_;
  const SeedSearch& search_;
  const PointGrid& grid_;
  const CorrelateOptions& options_;
  std::vector<Node> nodes_;
  std::vector<Cell> cells_;
  std::vector<int> frontier_;  ///< Nodes without a match beside a matched one.
  std::vector<MatchScratch> scratch_;
  std::optional<SeedSearch::Repeat> repeat_;
  int matched_ = 0, wide_seeds_ = 0, turned_seeds_ = 0;
  bool stopped_ = false;
};

}  // namespace tenter
