// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/gray_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;

std::string encoded(const cv::Mat& pixels, const char* extension) {
  std::vector<uchar> bytes;
  cv::imencode(extension, pixels, bytes);
  return {bytes.begin(), bytes.end()};
}

cv::Mat ramp(int type, double factor) {
  cv::Mat1d values(12, 16);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) values(y, x) = factor * (x + 16 * y);
  }
  cv::Mat result;
  values.convertTo(result, type);
  return result;
}

TEST(GrayImage, ReadsEightBitsRowsFromTheTop) {
  for (const char* extension : {".tif", ".png", ".bmp", ".pgm"}) {
    const auto file = decodeGrayImage(encoded(ramp(CV_8U, 1.0), extension), "a");
    ASSERT_TRUE(file.ok()) << extension;
    EXPECT_EQ(file->image.width, 16);
    EXPECT_EQ(file->image.height, 12);
    EXPECT_EQ(file->image.white, 255.0F);
    EXPECT_EQ(file->image.at(3, 2), 35.0F);
    EXPECT_THAT(file->warnings, IsEmpty());
  }
}

TEST(GrayImage, ReadsSixteenBits) {
  const auto file = decodeGrayImage(encoded(ramp(CV_16U, 300.0), ".tif"), "a");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->image.white, 65535.0F);
  EXPECT_EQ(file->image.at(3, 2), 10500.0F);
}

TEST(GrayImage, TurnsColourIntoLuminanceAndSaysSo) {
  const cv::Mat colour(12, 16, CV_8UC3, cv::Scalar(20, 100, 200));  // blue, green, red
  const auto file = decodeGrayImage(encoded(colour, ".png"), "a");
  ASSERT_TRUE(file.ok());
  EXPECT_NEAR(file->image.at(5, 5), 0.299 * 200 + 0.587 * 100 + 0.114 * 20, 1.0);
  ASSERT_EQ(file->warnings.size(), 1U);
  EXPECT_THAT(file->warnings[0], HasSubstr("colour"));
}

TEST(GrayImage, RefusesWhatIsNoUsableImage) {
  const auto reason = [](const std::string& bytes) {
    const auto file = decodeGrayImage(bytes, "a");
    return file.ok() ? std::string() : file.error().reason;
  };
  const std::string whole = encoded(ramp(CV_8U, 1.0), ".tif");
  EXPECT_EQ(reason(whole), "");
  EXPECT_THAT(reason(""), HasSubstr("empty"));
  EXPECT_THAT(reason("II*\0 and then nothing"), HasSubstr("no image"));
  EXPECT_THAT(reason(whole.substr(0, whole.size() / 2)), HasSubstr("no image"));
  EXPECT_THAT(reason(encoded(ramp(CV_32F, 1.0), ".tif")), HasSubstr("8 or 16 bits"));
  EXPECT_THAT(reason(encoded(cv::Mat::zeros(4, 30, CV_8U), ".png")), HasSubstr("30 x 4"));
}

TEST(GrayImage, RefusesFilesWithTheirName) {
  TemporaryFolder folder;
  EXPECT_THAT(readGrayImage(folder / "absent.tif").error().message(), HasSubstr("absent.tif"));
  EXPECT_THAT(readGrayImage(folder.path()).error().reason, HasSubstr("folder"));
}

TEST(GrayImage, NothingIsPrintedAboutABrokenFile) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  EXPECT_FALSE(decodeGrayImage("P5\n999999999 999999999\n255\n", "a").ok());
  EXPECT_FALSE(decodeGrayImage(encoded(ramp(CV_8U, 1.0), ".tif").substr(0, 60), "a").ok());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

}  // namespace
}  // namespace tenter
