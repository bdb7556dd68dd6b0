// SPDX-License-Identifier: GPL-3.0-or-later
#include "page_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace tenter {

namespace {

constexpr std::array kPapers = {Paper{"a4", 210.0, 297.0},     Paper{"a3", 297.0, 420.0},
                                Paper{"a2", 420.0, 594.0},     Paper{"a1", 594.0, 841.0},
                                Paper{"letter", 215.9, 279.4}, Paper{"tabloid", 279.4, 431.8},
                                Paper{"fit", 0.0, 0.0}};

/// White kept free around the content; the rulers stand at the left and below.
constexpr double kLeft_mm = 18.0, kRight_mm = 8.0, kTop_mm = 8.0, kBottom_mm = 26.0;
constexpr double kLine_mm = 0.2, kText_mm = 2.6;

std::string asText(double a, double b) {
  char text[80];
  std::snprintf(text, sizeof text, "%.4g x %.4g mm", a, b);
  return text;
}

/// A ruler of whole centimetres, along x or along y.
void addRuler(PrintPage& page, double x_mm, double y_mm, int length_mm, bool along_x) {
  const auto box = [&](double along, double across, double length, double width) {
    if (along_x) {
      page.boxes.push_back({x_mm + along, y_mm + across, length, width});
    } else {
      page.boxes.push_back({x_mm + across, y_mm + along, width, length});
    }
  };
  box(-0.5 * kLine_mm, 0.0, length_mm + kLine_mm, kLine_mm);
  for (int tick = 0; tick <= length_mm; ++tick) {
    const double size = tick % 10 == 0 ? 4.0 : tick % 5 == 0 ? 3.0 : 1.8;
    box(tick - 0.5 * kLine_mm, 0.0, kLine_mm, size);
    if (tick % 10 != 0) continue;
    const std::string number = std::to_string(tick);
    if (along_x) {
      page.texts.push_back({x_mm + tick + 0.4, y_mm + 4.0 + kText_mm, kText_mm, number});
    } else {
      page.texts.push_back({x_mm + 4.4, y_mm + tick + 0.5 * kText_mm, kText_mm, number});
    }
  }
}

int rulerLength(double room_mm) {
  constexpr int kLongest_mm = 200;
  return std::min(kLongest_mm, 10 * static_cast<int>(room_mm / 10.0));
}

}  // namespace

Result<Paper> paperByName(std::string_view name) {
  std::string names;
  for (const Paper& paper : kPapers) {
    if (paper.name == name) return paper;
    names += (names.empty() ? "" : ", ") + std::string(paper.name);
  }
  return usageError("the paper '" + std::string(name) + "' is not known", "one of " + names);
}

Result<Layout> layOut(double width_mm, double height_mm, const Paper& paper,
                      const std::string& caption) {
  const double needed_x = width_mm + kLeft_mm + kRight_mm;
  const double needed_y = height_mm + kTop_mm + kBottom_mm;
  double page_x = paper.width_mm, page_y = paper.height_mm;
  if (paper.name == "fit") {
    page_x = needed_x;
    page_y = needed_y;
  } else if (needed_x > page_x || needed_y > page_y) {
    std::swap(page_x, page_y);
  }
  if (needed_x > page_x || needed_y > page_y) {
    return usageError(asText(width_mm, height_mm) + " and the rulers do not fit on " +
                          std::string(paper.name) + " paper",
                      "choose a larger --paper, or fit, or make it smaller");
  }
  Layout layout;
  PrintPage& page = layout.page;
  page.width_mm = page_x;
  page.height_mm = page_y;
  layout.x_mm = kLeft_mm + 0.5 * (page_x - needed_x);
  layout.y_mm = kTop_mm + 0.5 * (page_y - needed_y);
  const double below = page_y - kBottom_mm;
  addRuler(page, kLeft_mm, below + 5.0, rulerLength(page_x - kLeft_mm - kRight_mm), true);
  addRuler(page, 5.0, kTop_mm, rulerLength(page_y - kTop_mm - kBottom_mm), false);
  page.texts.push_back({kLeft_mm, page_y - 5.0, kText_mm, caption});
  return layout;
}

}  // namespace tenter
