// SPDX-License-Identifier: GPL-3.0-or-later
// Where nothing can be written, or somebody stops the program: complete or absent, never half.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "program.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::listFolder;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;
using Arguments = std::vector<std::string>;
using Names = std::vector<std::string>;

Arguments importTo(const std::string& output) {
  return {"import",
          "cantilever",
          "--length-mm",
          "75",
          "--reach-mm",
          "38.1",
          "--drop-mm",
          "63.5",
          "--angle-deg",
          "0",
          "--areal-density-kg-m2",
          "0.06",
          "-o",
          output};
}

Arguments captureTo(const std::string& output) {
  return {"twin",  "capture",       "--fabric", "denim-14", "--protocol",
          "shear", "--measurement", "--nodes",  "15",       "--frames",
          "4",     "--tracked",     "60",       "-o",       output};
}

/// A small file system of its own while it lives.
class SmallDisk {
 public:
  explicit SmallDisk(std::filesystem::path at) : at_(std::move(at)) {
    std::filesystem::create_directory(at_);
    mounted_ = mount("tmpfs", at_.c_str(), "tmpfs", 0, "size=64k") == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount(at_.c_str());
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }

 private:
  std::filesystem::path at_;
  bool mounted_ = false;
};

TEST(OutputFailure, AFullDiskLeavesNothing) {
  TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "a small file system can be mounted by root alone";
  const Outcome outcome = tenter(captureTo("disk/m"), folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("disk/m"));
  EXPECT_THAT(outcome.err, HasSubstr("No space left"));
  EXPECT_EQ(listFolder(folder / "disk"), Names{});
}

TEST(OutputFailure, WhereNoFolderCanBeIsSaidBeforeTheWork) {
  TemporaryFolder folder;
  folder.write("file", "text");
  for (const Arguments& arguments :
       {importTo("file/m"), captureTo("file/a/m"), Arguments{"fit", "nowhere", "-o", "file/m.json"},
        Arguments{"demo", "--out", "file/demo"}}) {
    const Outcome outcome = tenter(arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 3) << arguments.front();
    EXPECT_THAT(outcome.err, HasSubstr("file is not a folder")) << arguments.front();
  }
  EXPECT_EQ(listFolder(folder.path()), Names{"file"});
  EXPECT_EQ(test_support::slurp(folder / "file"), "text");
}

TEST(OutputFailure, ForeignFoldersStayAsTheyAre) {
  TemporaryFolder folder;
  folder.write("thesis/chapter.txt", "years of work");
  for (const Arguments& arguments :
       {importTo("thesis"), captureTo("thesis"), Arguments{"demo", "--out", "thesis"}}) {
    const Outcome outcome = tenter(arguments, folder.path());
    EXPECT_EQ(outcome.exit_code, 3) << arguments.front();
    EXPECT_THAT(outcome.err, HasSubstr("thesis"));
  }
  EXPECT_EQ(listFolder(folder / "thesis"), Names{"chapter.txt"});
  EXPECT_EQ(listFolder(folder.path()), Names{"thesis"});
}

TEST(Interrupted, ACaptureLeavesNothing) {
  TemporaryFolder folder;
  // Takes some ten seconds if it is let.
  const Outcome outcome =
      tenter({"twin", "capture", "--fabric", "knit-12", "--protocol", "stretch-weft",
              "--measurement", "-o", "m", "--truth", "t", "--nodes", "60", "--frames", "600"},
             folder.path(), 0.5);
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_THAT(outcome.err, HasSubstr("nothing was written"));
  EXPECT_EQ(listFolder(folder.path()), Names{});
}

}  // namespace
}  // namespace tenter::system_test
