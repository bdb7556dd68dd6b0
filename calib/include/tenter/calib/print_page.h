// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tenter/calib/board.h"
#include "tenter/calib/byte_image.h"

namespace tenter {

/// Something to be printed at true scale. All lengths in millimetres from the page's upper left
/// corner, y down; greys 0 black to 255 white. Drawn in the order picture, boxes, texts.
struct PrintPage {
  struct Box {
    double x_mm, y_mm, width_mm, height_mm;
    int grey = 0;
  };
  struct Text {
    double x_mm, y_mm;  ///< Beginning of the base line.
    double height_mm;   ///< Of a capital letter.
    std::string text;   ///< ASCII.
  };
  struct Picture {
    double x_mm = 0.0, y_mm = 0.0, width_mm = 0.0, height_mm = 0.0;
    ByteImage image;  ///< Empty: no picture.
  };

  double width_mm = 0.0, height_mm = 0.0;
  Picture picture;
  std::vector<Box> boxes;
  std::vector<Text> texts;
};

/// A paper: "a4", "a3", "a2", "a1", "letter", "tabloid", or "fit", which is as large as what is
/// printed. Turned on its side where that fits better.
struct Paper {
  std::string_view name;
  double width_mm, height_mm;
};
Result<Paper> paperByName(std::string_view name);

/// A calibration board with rulers along both axes to check the print by, and a line that says what
/// it is. Error if it does not fit the paper. Precondition: validateBoard(board).
Result<PrintPage> boardPage(const Board& board, const Paper& paper);

/// Wavelet noise [CD05] as texture for cloth: no two places alike, no contrast lost to scales that
/// the cameras cannot see.
struct TextureOptions {
  double width_mm = 180.0, height_mm = 180.0;
  double feature_mm = 0.6;  ///< Finest dots are one to two of it across.
  int bands = 3;            ///< Octaves, each coarser by two.
  unsigned seed = 1;
  double dots_per_inch = 600.0;
};
/// Error for sizes that are out of range or do not fit the paper.
Result<PrintPage> texturePage(const TextureOptions& options, const Paper& paper);

/// A PDF 1.4 of one page that asks the viewer not to scale it.
std::string pdfOf(const PrintPage& page);

/// The same as pixels; boxes are blended by the area that they cover of a pixel. Error if it would
/// have more than 2^28 pixels.
Result<ByteImage> rasterOf(const PrintPage& page, double pixels_per_mm);

}  // namespace tenter
