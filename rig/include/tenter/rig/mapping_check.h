// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tenter/rig/rig_config.h"

namespace tenter {

/// What came of drawing in one axis.
struct MappingFinding {
  int axis = 0;
  int cell = 0;                 ///< The one that the configuration gives to the axis.
  std::optional<int> answered;  ///< The cell whose tension rose most; nothing if none rose enough.
  bool alone = false;           ///< No other cell rose nearly as much.
  double rise_N = 0.0;          ///< Of the cell that answered.
  double way_m = 0.0;           ///< How far the axis was drawn in.

  bool confirmed() const { return answered == cell && alone; }
};

/// "axis-1: cell-1 answers", or what is wrong with it.
std::string mappingText(const MappingFinding& finding, const RigConfig& config);

/// Draws in one axis after the other, until a cell's tension has risen by half of `slack_N`, and
/// lets it out again: is it the axis' own cell that answers? Pure; one call a tick.
class MappingCheck {
 public:
  /// Precondition: at least one axis, and each of them has a cell.
  MappingCheck(const RigConfig& config, const std::vector<int>& axes);

  struct Move {
    int axis = 0;
    double velocity_m_per_s = 0.0;  ///< 0: nothing moves in this tick.
    std::optional<double> goal_m;   ///< Where the motion is to end exactly.
  };
  /// `dt_s` since the tick before; setpoints of all axes, gross tensions of all cells. A tick
  /// without all tensions counts for nothing. Precondition: !done().
  Move step(double dt_s, const std::vector<double>& setpoints_m,
            const std::vector<std::optional<double>>& tensions_N);

  bool done() const { return next_ == trials_.size(); }
  /// One for each axis that has been tried.
  const std::vector<MappingFinding>& findings() const { return findings_; }

 private:
  enum class Stage { kRest, kDraw, kReturn };

  void begin(Stage stage);
  bool rest(const std::vector<double>& tensions_N, double setpoint_m);
  /// The speed to go on with; nothing once it is known what answers.
  std::optional<double> draw(double dt_s, const std::vector<double>& tensions_N, double setpoint_m);
  void judge(const std::vector<double>& rises_N, double way_m);

  /// What is needed of an axis.
  struct Trial {
    int axis, cell;
    double travel_max_m, max_speed_m_per_s;
  };

  std::vector<Trial> trials_;
  double answer_N_, draw_m_per_s_;
  std::size_t next_ = 0;
  Stage stage_ = Stage::kRest;
  double elapsed_s_ = 0.0;
  int rest_ticks_ = 0;
  std::vector<double> rest_N_;  ///< Sums, then means, while the axis stood.
  double rest_m_ = 0.0;
  std::vector<MappingFinding> findings_;
};

}  // namespace tenter
