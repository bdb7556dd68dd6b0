// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/fitting/fit.h"

namespace tenter::app {

/// A page of one file: text, tables and plots, no scripts, nothing fetched.
class Report {
 public:
  explicit Report(const std::string& title);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Residuals per test as [Est12] table 2, with what was held out marked.
  void residualTable(const std::vector<TestResidual>& tests, const std::vector<bool>& held_out);
  /// Every component's stiffness curve with its 95 % band; unobserved knots are named.
  void curves(const Material& material);
  /// Measured against predicted force, or position error where there are no forces.
  void tests(const std::vector<EvaluatedTest>& tests, const std::vector<bool>& held_out);
  void list(const std::vector<std::string>& items);

  std::string html() const;

 private:
  std::string title_, body_;
};

}  // namespace tenter::app
