// SPDX-License-Identifier: GPL-3.0-or-later
// Where nothing can be written, or somebody stops the program: complete or absent, never half.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <chrono>
#include <filesystem>

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

TEST(OutputFailure, TheWorkingFolderIsNotPulledAwayNorNotesBesideAMeasurement) {
  TemporaryFolder folder;
  std::filesystem::create_directories(folder / "here");
  for (const char* output : {".", "..", "../here"}) {
    for (const Arguments& arguments :
         {importTo(output), captureTo(output), Arguments{"demo", "--out", output}}) {
      const Outcome outcome = tenter(arguments, folder / "here");
      EXPECT_EQ(outcome.exit_code, 3) << arguments.front() << " " << output;
      EXPECT_THAT(outcome.err, HasSubstr("in which you work"));
    }
  }
  EXPECT_EQ(listFolder(folder / "here"), Names{});
  EXPECT_EQ(listFolder(folder.path()), Names{"here"});

  ASSERT_EQ(tenter(importTo("m"), folder.path()).exit_code, 0);
  ASSERT_EQ(tenter(importTo("m"), folder.path()).exit_code, 0) << "a measurement is replaced";
  folder.write("m/notes.txt", "days of work");
  const Outcome outcome = tenter(importTo("m"), folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("m: holds 'notes.txt'"));
  EXPECT_EQ(test_support::slurp(folder / "m" / "notes.txt"), "days of work");
}

TEST(Interrupted, ACaptureStopsWithinASecondInTheMiddleOfAFrame) {
  TemporaryFolder folder;
  // Its first frame alone takes longer than this test.
  const double interrupt_after_s = 0.5, allowed_s = 1.0;
  const auto begin = std::chrono::steady_clock::now();
  const Outcome outcome = tenter({"twin", "capture", "--fabric", "satin-4", "--protocol",
                                  "complex-shear", "--measurement", "-o", "m", "--nodes", "60"},
                                 folder.path(), interrupt_after_s);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_THAT(outcome.err, HasSubstr("nothing was written"));
  EXPECT_LT(took.count(), interrupt_after_s + allowed_s);
  EXPECT_EQ(listFolder(folder.path()), Names{});
}

/// Interrupts a fit of what is in the folder, soon after its start, and checks that "o.json" is
/// whole or as it was.
void interruptFit(const TemporaryFolder& folder, double after_s) {
  const Names names = listFolder(folder.path());
  const bool older = std::filesystem::exists(folder / "o.json");
  const std::string before = older ? test_support::slurp(folder / "o.json") : "";
  const Outcome outcome = tenter({"fit", "m", "-o", "o.json"}, folder.path(), after_s);
  const bool wrote = outcome.err.find("the best so far is in o.json") != std::string::npos;
  // A busy machine may still be loading libraries, when the signal ends the program as any other.
  if (outcome.exit_code != -1) {
    EXPECT_EQ(outcome.exit_code, 5) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(wrote ? "stopped" : "nothing was written"));
  }
  if (wrote) {
    EXPECT_TRUE(
        nlohmann::json::parse(test_support::slurp(folder / "o.json")).contains("components"));
    return;
  }
  EXPECT_EQ(listFolder(folder.path()), names);
  if (older) {
    EXPECT_EQ(test_support::slurp(folder / "o.json"), before);
  }
}

TEST(Interrupted, AFitThatHasHardlyBegunLeavesAWholeMaterialOrNothing) {
  TemporaryFolder folder;
  ASSERT_EQ(tenter(captureTo("m"), folder.path()).exit_code, 0);
  for (const double after_s : {0.05, 0.2}) {
    SCOPED_TRACE(after_s);
    interruptFit(folder, after_s);
    std::filesystem::remove(folder / "o.json");
  }
  folder.write(
      "arcsim.json",
      "{\"density\": 0.3, \"stretching\": [[100,0,90,20],[120,0,90,20],[100,0,90,20],"
      "[100,0,90,20],[100,0,90,20],[100,0,90,20]], \"bending\": [[1e-5,1e-5,1e-5,1e-5,1e-5],"
      "[1e-5,1e-5,1e-5,1e-5,1e-5],[1e-5,1e-5,1e-5,1e-5,1e-5]]}");
  ASSERT_EQ(tenter({"import", "arcsim", "arcsim.json", "-o", "o.json"}, folder.path()).exit_code,
            0);
  for (const double after_s : {0.05, 0.2}) {
    SCOPED_TRACE(after_s);
    interruptFit(folder, after_s);
  }
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
