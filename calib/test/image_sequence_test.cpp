// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/image_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<int> numbers(const std::string& pattern, const std::string& camera) {
  const auto found = findImages(pattern, camera);
  std::vector<int> out;
  if (!found) return {-1};
  for (const auto& [number, file] : *found) out.push_back(number);
  return out;
}

TEST(ImageSequenceTest, FindsNumbersWithGapsInOrder) {
  const TemporaryFolder folder;
  for (const char* name :
       {"left14.jpg", "left01.jpg", "left02.jpg", "left.jpg", "left3.jpg", "left100.jpg",
        "left007.jpg", "right05.jpg", "left09.png", "left-1.jpg"}) {
    folder.write(name, "x");
  }
  const std::string pattern = folder.path().string() + "/{camera}{index:02}.jpg";
  EXPECT_THAT(numbers(pattern, "left"), ElementsAre(1, 2, 14, 100));
  EXPECT_THAT(numbers(pattern, "right"), ElementsAre(5));
  EXPECT_EQ(findImages(pattern, "left")->at(14), folder / "left14.jpg");
  // Without a width any digits will do, but none with needless zeros.
  EXPECT_THAT(numbers(folder.path().string() + "/{camera}{index}.jpg", "left"),
              ElementsAre(3, 14, 100));
}

TEST(ImageSequenceTest, CameraAndNumberMayNameFolders) {
  const TemporaryFolder folder;
  folder.write("a/set_0003/a.png", "x");
  folder.write("a/set_0004/b.png", "x");
  folder.write("a/set_0011/a.png", "x");
  const std::string pattern = folder.path().string() + "/{camera}/set_{index:04}/{camera}.png";
  EXPECT_THAT(numbers(pattern, "a"), ElementsAre(3, 11));
  EXPECT_EQ(findImages(pattern, "a")->at(11), folder / "a/set_0011/a.png");
}

TEST(ImageSequenceTest, OtherCharactersStandForThemselves) {
  const TemporaryFolder folder;
  folder.write("[x]*1.png", "x");
  folder.write("xx1.png", "x");
  EXPECT_THAT(numbers(folder.path().string() + "/{camera}*{index}.png", "[x]"), ElementsAre(1));
}

TEST(ImageSequenceTest, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  folder.write("left1.png", "x");
  const std::string at = folder.path().string() + "/";
  const auto nothing = findImages(at + "{camera}{index:02}.png", "left");
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(nothing.error().message(), HasSubstr("no image of the camera 'left'"));
  EXPECT_THAT(findImages(at + "gone/{index}.png", "left").error().message(), HasSubstr("gone"));
  for (const char* pattern : {"left01.png", "{index}{index}.png", "{index", "{index:x}.png",
                              "{index:2x}", "{indexes}.png", "{index:00}.png"}) {
    const auto found = findImages(at + pattern, "left");
    ASSERT_FALSE(found.ok()) << pattern;
    EXPECT_EQ(found.error().kind, ErrorKind::kUsage) << pattern;
  }
}

}  // namespace
}  // namespace tenter
