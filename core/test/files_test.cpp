// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <stdexcept>

#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using test_support::listFolder;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kMarker = "marker.json";
constexpr const char* kOurs = "{\"format\": \"ours\"}";
const FolderKind kKind{kMarker, "ours", {"a.txt", "*.txt"}};

Result<void> buildOneFile(const fs::path& folder) {
  if (auto done = writeFileAtomically(folder / "a.txt", "a"); !done) return done;
  return writeFileAtomically(folder / kMarker, kOurs);
}

TEST(ReadFileTest, GivesEveryByteBack) {
  const TemporaryFolder folder;
  const std::string bytes("a\0\r\n\xff", 5);
  EXPECT_EQ(*readFile(folder.write("f", bytes)), bytes);
}

TEST(ReadFileTest, RefusesWhatIsNoFile) {
  const TemporaryFolder folder;
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(readFile(folder / "absent").error().message(), HasSubstr("absent: cannot be read"));
  EXPECT_THAT(readFile(folder.path()).error().reason, HasSubstr("is a folder"));
  EXPECT_THAT(readFile(pipe).error().reason, HasSubstr("not a regular file"));
  EXPECT_THAT(readFile(folder.write("long", "12345"), 4).error().reason, HasSubstr("5 bytes"));
}

TEST(WriteFileTest, ReplacesAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const fs::path file = folder / "new/deep/f.txt";
  ASSERT_TRUE(writeFileAtomically(file, "one"));
  ASSERT_TRUE(writeFileAtomically(file, "two"));
  EXPECT_EQ(slurp(file), "two");
  EXPECT_THAT(listFolder(file.parent_path()), ElementsAre("f.txt"));
}

TEST(WriteFileTest, LeavesAFolderInItsPlaceAlone) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "d");
  EXPECT_FALSE(writeFileAtomically(folder / "d", "x").ok());
  EXPECT_THAT(listFolder(folder.path()), ElementsAre("d"));
}

TEST(WriteFileTest, SaysWhenTheParentIsAFile) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("f", "");
  const auto done = writeFileAtomically(file / "below", "x");
  ASSERT_FALSE(done.ok());
  EXPECT_THAT(done.error().reason, HasSubstr("folder cannot be made"));
}

TEST(WriteFolderTest, AppearsComplete) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeFolderAtomically(folder / "out/", kKind, buildOneFile));
  EXPECT_THAT(listFolder(folder.path()), ElementsAre("out"));
  EXPECT_THAT(listFolder(folder / "out"), ElementsAre("a.txt", kMarker));
}

TEST(WriteFolderTest, FailureLeavesNothing) {
  const TemporaryFolder folder;
  const auto done = writeFolderAtomically(folder / "out", kKind, [](const fs::path& scratch) {
    EXPECT_TRUE(buildOneFile(scratch));
    return Result<void>(badInput("", "", "halfway"));
  });
  EXPECT_EQ(done.error().reason, "halfway");
  EXPECT_THAT(listFolder(folder.path()), IsEmpty());
}

TEST(WriteFolderTest, ExceptionLeavesTheOldFolderAsItWas) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeFolderAtomically(folder / "out", kKind, buildOneFile));
  const auto throwing = [](const fs::path& scratch) -> Result<void> {
    EXPECT_TRUE(writeFileAtomically(scratch / "half.txt", "x"));
    throw std::runtime_error("killed");
  };
  EXPECT_THROW((void)writeFolderAtomically(folder / "out", kKind, throwing), std::runtime_error);
  EXPECT_THAT(listFolder(folder.path()), ElementsAre("out"));
  EXPECT_THAT(listFolder(folder / "out"), ElementsAre("a.txt", kMarker));
}

TEST(WriteFolderTest, SwapsOutAFolderWithTheMarkerWhole) {
  const TemporaryFolder folder;
  folder.write("out/marker.json", kOurs);
  folder.write("out/stale.txt", "old");
  ASSERT_TRUE(writeFolderAtomically(folder / "out", kKind, buildOneFile));
  EXPECT_THAT(listFolder(folder / "out"), ElementsAre("a.txt", kMarker));
  EXPECT_THAT(listFolder(folder.path()), ElementsAre("out"));
}

TEST(WriteFolderTest, RefusesSomebodyElsesFolder) {
  const TemporaryFolder folder;
  folder.write("out/thesis.doc", "dear");
  const auto never = [](const fs::path&) -> Result<void> { throw std::logic_error("called"); };
  const auto done = writeFolderAtomically(folder / "out", kKind, never);
  EXPECT_THAT(done.error().reason, HasSubstr("was not written by tenter"));
  EXPECT_EQ(slurp(folder / "out/thesis.doc"), "dear");
}

TEST(WriteFolderTest, RefusesAFolderThatHoldsMoreThanItsKind) {
  const TemporaryFolder folder;
  folder.write("out/marker.json", kOurs);
  folder.write("out/thesis.doc", "dear");
  const auto done = writeFolderAtomically(folder / "out", kKind, buildOneFile);
  EXPECT_THAT(done.error().reason, HasSubstr("'thesis.doc'"));
  EXPECT_EQ(slurp(folder / "out/thesis.doc"), "dear");
}

TEST(WriteFolderTest, RefusesAMarkerOfAnotherProgram) {
  const TemporaryFolder folder;
  folder.write("out/marker.json", "{}");
  const auto done = writeFolderAtomically(folder / "out", kKind, buildOneFile);
  EXPECT_THAT(done.error().reason, HasSubstr("was not written by tenter"));
  EXPECT_EQ(slurp(folder / "out/marker.json"), "{}");
}

TEST(WriteFolderTest, RefusesTheWorkingFolderAndThoseAbove) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "above/here");
  const fs::path before = fs::current_path();
  fs::current_path(folder / "above/here");
  for (const char* name : {".", "..", "../here", "./"}) {
    const auto done = writeFolderAtomically(name, kKind, buildOneFile);
    EXPECT_THAT(done.ok() ? "" : done.error().reason, HasSubstr("in which you work")) << name;
  }
  EXPECT_TRUE(fs::equivalent(fs::current_path(), folder / "above/here"));
  EXPECT_TRUE(writeFolderAtomically("out", kKind, buildOneFile).ok());
  fs::current_path(before);
  EXPECT_THAT(listFolder(folder / "above/here"), ElementsAre("out"));
}

TEST(WriteFolderTest, FillsAnEmptyFolder) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "out");
  ASSERT_TRUE(writeFolderAtomically(folder / "out", kKind, buildOneFile));
  EXPECT_THAT(listFolder(folder / "out"), ElementsAre("a.txt", kMarker));
}

TEST(Sha256Test, MatchesThePublishedExamples) {
  // FIPS 180-4 examples.
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Sha256Test, OfAFolderDependsOnNamesAndContents) {
  const TemporaryFolder folder;
  folder.write("one/a", "x");
  folder.write("one/b/c", "y");
  folder.write("two/a", "x");
  folder.write("two/b/c", "y");
  EXPECT_EQ(*sha256OfPath(folder / "one"), *sha256OfPath(folder / "two"));
  const std::string before = *sha256OfPath(folder / "two");
  fs::rename(folder / "two/a", folder / "two/a2");
  EXPECT_NE(*sha256OfPath(folder / "two"), before);
  EXPECT_EQ(*sha256OfPath(folder / "one/a"), sha256("x"));
}

TEST(Sha256Test, LinksInALoopEnd) {
  const TemporaryFolder folder;
  folder.write("d/a", "x");
  fs::create_directory_symlink(folder / "d", folder / "d/loop");
  fs::create_symlink(folder / "self", folder / "self");
  EXPECT_TRUE(sha256OfPath(folder / "d").ok());
  EXPECT_FALSE(sha256OfPath(folder / "self").ok());
  EXPECT_FALSE(sha256OfPath(folder / "absent").ok());
}

}  // namespace
}  // namespace tenter
