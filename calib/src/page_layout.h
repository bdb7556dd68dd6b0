// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/calib/print_page.h"

namespace tenter {

/// A page with rulers on which something of this size stands in the middle of what is left.
struct Layout {
  PrintPage page;
  double x_mm = 0.0, y_mm = 0.0;  ///< Where the content's upper left corner goes.
};
Result<Layout> layOut(double width_mm, double height_mm, const Paper& paper,
                      const std::string& caption);

}  // namespace tenter
