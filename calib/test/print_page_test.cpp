// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/print_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "tenter/calib/wavelet_noise.h"

namespace tenter {
namespace {

using testing::HasSubstr;

Board board(Board::Kind kind) {
  Board out;
  out.kind = kind;
  out.columns = 6;
  out.rows = 4;
  out.square_m = 0.02;
  out.marker_m = 0.015;
  return out;
}

TEST(BoardPageTest, SquaresAreBlackAndWhiteAtTrueScale) {
  const auto page = boardPage(board(Board::Kind::kChessboard), *paperByName("a4"));
  ASSERT_TRUE(page.ok()) << page.error().message();
  constexpr double kPixelsPerMm = 4.0;
  const auto image = rasterOf(*page, kPixelsPerMm);
  ASSERT_TRUE(image.ok());
  EXPECT_EQ(image->width, 840);
  EXPECT_EQ(image->height, 1188);
  const PrintPage::Box* first = nullptr;
  for (const PrintPage::Box& box : page->boxes) {
    if (first == nullptr && box.width_mm == 20.0) first = &box;
  }
  ASSERT_NE(first, nullptr);
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 7; ++column) {
      const int x = static_cast<int>(kPixelsPerMm * (first->x_mm + 20.0 * column + 10.0));
      const int y = static_cast<int>(kPixelsPerMm * (first->y_mm + 20.0 * row + 10.0));
      EXPECT_EQ(image->at(x, y), (row + column) % 2 == 0 ? 0 : 255) << row << " " << column;
    }
  }
}

TEST(BoardPageTest, BoxesCoverTheAreaTheyHave) {
  PrintPage page;
  page.width_mm = page.height_mm = 10.0;
  page.boxes.push_back({2.3, 3.1, 4.45, 2.2, 0});
  const auto image = rasterOf(page, 1.0);
  ASSERT_TRUE(image.ok());
  double covered = 0.0;
  for (const std::uint8_t value : image->pixels) covered += (255.0 - value) / 255.0;
  EXPECT_NEAR(covered, 4.45 * 2.2, 0.1);
}

TEST(BoardPageTest, RefusesWhatDoesNotFit) {
  Board large = board(Board::Kind::kChessboard);
  large.square_m = 0.05;
  const auto page = boardPage(large, *paperByName("a4"));
  ASSERT_FALSE(page.ok());
  EXPECT_THAT(page.error().message(), HasSubstr("350 x 250 mm"));
  EXPECT_TRUE(boardPage(large, *paperByName("fit")).ok());
  EXPECT_FALSE(paperByName("papyrus").ok());
}

TEST(PdfTest, HasAPageOfTheRightSizeAndObjectsWhereItSays) {
  const auto page = boardPage(board(Board::Kind::kCharuco), *paperByName("a4"));
  ASSERT_TRUE(page.ok());
  const std::string pdf = pdfOf(*page);
  EXPECT_TRUE(pdf.starts_with("%PDF-1.4"));
  EXPECT_THAT(pdf, HasSubstr("/MediaBox [0 0 595.2756 841.8898]"));
  EXPECT_THAT(pdf, HasSubstr("/PrintScaling /None"));
  const auto table = std::stoul(pdf.substr(pdf.rfind("startxref") + 10));
  ASSERT_EQ(pdf.substr(table, 4), "xref");
  std::istringstream entries(pdf.substr(table + 7));
  std::size_t offset = 0, generation = 0;
  char kind = 0;
  entries >> offset >> generation >> kind >> offset;  // the count of the header's line was eaten
  for (int object = 1; object <= 5; ++object) {
    const auto line = pdf.find("n \n", table) - 17 + 20 * (object - 1);
    const auto at = std::stoul(pdf.substr(line, 10));
    EXPECT_EQ(pdf.substr(at, 7), std::to_string(object) + " 0 obj");
  }
}

TEST(PngTest, TellsItsScaleAndReadsBack) {
  ByteImage image{16, 12, std::vector<std::uint8_t>(16 * 12)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = static_cast<std::uint8_t>(i);
  const std::string png = encodePng(image, 23622.0);
  const auto chunk = png.find("pHYs");
  ASSERT_NE(chunk, std::string::npos);
  EXPECT_EQ(static_cast<unsigned char>(png[chunk + 6]), 23622 / 256);
  EXPECT_EQ(static_cast<unsigned char>(png[chunk + 7]), 23622 % 256);
  const auto back = decodeByteImage(png, "memory.png");
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ(back->pixels, image.pixels);
}

TEST(ByteImageTest, RefusesWhatIsNoImage) {
  EXPECT_FALSE(decodeByteImage("", "a").ok());
  EXPECT_FALSE(decodeByteImage("no image at all", "a").ok());
  const ByteImage small{4, 4, std::vector<std::uint8_t>(16, 9)};
  const auto refused = decodeByteImage(encodePng(small, 1.0), "a");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("4 x 4 pixels"));
}

/// Energy of a picture's columns and rows at frequencies below `limit` cycles a sample, as part of
/// all.
double energyBelow(const cv::Mat& values, double limit) {
  cv::Mat spectrum;
  cv::dft(values, spectrum, cv::DFT_COMPLEX_OUTPUT);
  double low = 0.0, all = 0.0;
  for (int v = 0; v < spectrum.rows; ++v) {
    for (int u = 0; u < spectrum.cols; ++u) {
      const auto& c = spectrum.at<cv::Vec2d>(v, u);
      const double energy = c[0] * c[0] + c[1] * c[1];
      const double fu = std::min(u, spectrum.cols - u) / static_cast<double>(spectrum.cols);
      const double fv = std::min(v, spectrum.rows - v) / static_cast<double>(spectrum.rows);
      all += energy;
      if (std::max(fu, fv) < limit) low += energy;
    }
  }
  return low / all;
}

TEST(WaveletNoiseTest, HasNothingBelowItsBandAndRepeatsByItsSeed) {
  constexpr int kSize = 64;
  const WaveletNoiseBand noise(kSize, kSize, 5), same(kSize, kSize, 5), other(kSize, kSize, 6);
  EXPECT_EQ(noise.coefficients(), same.coefficients());
  EXPECT_NE(noise.coefficients(), other.coefficients());
  EXPECT_EQ(noise.at(3.25, 7.5), noise.at(3.25 + kSize, 7.5 - kSize));
  cv::Mat values(kSize, kSize, CV_64F);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) values.at<double>(y, x) = noise.at(x + 0.5, y + 0.5);
  }
  // White noise through the same spline would have an eighth and more of its energy there.
  EXPECT_LT(energyBelow(values, 0.125), 0.01);
}

TEST(TexturePageTest, GreysAreEvenlySpreadAndSizesChecked) {
  TextureOptions options;
  options.width_mm = options.height_mm = 60.0;
  options.dots_per_inch = 150.0;
  const auto page = texturePage(options, *paperByName("a4"));
  ASSERT_TRUE(page.ok()) << page.error().message();
  const ByteImage& image = page->picture.image;
  EXPECT_EQ(image.width, 354);
  int quarter[4] = {0, 0, 0, 0};
  for (const std::uint8_t value : image.pixels) ++quarter[value / 64];
  for (const int count : quarter) {
    EXPECT_NEAR(count / static_cast<double>(image.pixels.size()), 0.25, 0.03);
  }
  options.feature_mm = 0.0;
  EXPECT_FALSE(texturePage(options, *paperByName("a4")).ok());
  options.feature_mm = 0.6;
  options.width_mm = 400.0;
  EXPECT_FALSE(texturePage(options, *paperByName("a4")).ok());
}

}  // namespace
}  // namespace tenter
