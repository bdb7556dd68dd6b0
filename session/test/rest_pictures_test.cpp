// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/rest_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session_samples.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::readAll;
using session_samples::timeOf;
using session_samples::writeSession;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class RestPicturesTest : public testing::Test {
 protected:
  void SetUp() override {
    writeSession(session_);
    folder_.write("snap/left.png", "left at rest");
    folder_.write("snap/right.png", "right at rest");
    folder_.write("snap/notes.txt", "no picture");
  }
  SessionReport report() const { return verifySession(session_).value(); }

  TemporaryFolder folder_;
  fs::path session_ = folder_ / "s", snap_ = folder_ / "snap";
};

TEST_F(RestPicturesTest, AreCopiedAndOnRecord) {
  const SessionReport before = report();
  const auto files = addRestPictures(session_, snap_);
  ASSERT_TRUE(files.ok()) << files.error().message();
  ASSERT_THAT(*files, SizeIs(2));
  EXPECT_EQ((*files)[0].name, "rest/left.png");
  EXPECT_EQ(slurp(session_ / "rest/right.png"), "right at rest");
  EXPECT_FALSE(fs::exists(session_ / "rest/notes.txt"));
  const SessionReport after = report();
  EXPECT_THAT(after.problems, IsEmpty());
  EXPECT_THAT(after.notes, IsEmpty());
  EXPECT_EQ(after.rest_pictures, 2u);
  EXPECT_TRUE(after.closed);
  EXPECT_EQ(after.records, before.records + 2) << "the pictures, and closed again";
  EXPECT_EQ(after.duration_ns, before.duration_ns) << "the session's time stands still";
  int found = 0;
  for (const JournalRecord& record : readAll(session_)) {
    const auto named = restPicturesIn(record.body);
    ASSERT_TRUE(named.ok());
    if (named->has_value()) ++found;
  }
  EXPECT_EQ(found, 1);
}

TEST_F(RestPicturesTest, VerifySeesWhatHappenedToThem) {
  ASSERT_TRUE(addRestPictures(session_, snap_).ok());
  folder_.write("s/rest/left.png", "left at resT");
  EXPECT_THAT(report().problems, ElementsAre(HasSubstr("rest/left.png: has another SHA-256")));
  folder_.write("s/rest/left.png", "left");
  EXPECT_THAT(report().problems, ElementsAre(HasSubstr("bytes instead of")));
  fs::remove(session_ / "rest/left.png");
  EXPECT_THAT(report().problems, ElementsAre(HasSubstr("rest/left.png: cannot be read")));
}

TEST_F(RestPicturesTest, AnOlderSessionIsWholeAndSaysWhatIsNotKnown) {
  folder_.write("s/rest/left.png", "left at rest");
  EXPECT_THAT(report().problems, IsEmpty());
  EXPECT_THAT(report().notes, ElementsAre(HasSubstr("rest/left.png: no record has its SHA-256")));
  // Its own pictures can be put on record where they lie.
  ASSERT_TRUE(addRestPictures(session_, session_ / kRestFolder).ok());
  EXPECT_THAT(report().notes, IsEmpty());
  EXPECT_EQ(report().rest_pictures, 1u);
}

TEST_F(RestPicturesTest, RefusesWhatWouldNotBeTheSamplesPictures) {
  EXPECT_THAT(addRestPictures(session_, folder_ / "absent").error().message(),
              HasSubstr("cannot be listed"));
  folder_.write("empty/readme.txt", "");
  EXPECT_THAT(addRestPictures(session_, folder_ / "empty").error().message(),
              HasSubstr("holds no picture"));
  folder_.write("s/rest/left.png", "another");
  EXPECT_THAT(addRestPictures(session_, snap_).error().message(), HasSubstr("another picture"));
  fs::remove_all(session_ / kRestFolder);
  ASSERT_TRUE(addRestPictures(session_, snap_).ok());
  EXPECT_THAT(addRestPictures(session_, snap_).error().message(), HasSubstr("already"));
}

TEST_F(RestPicturesTest, ATornSessionIsNotTouched) {
  folder_.write("s/journal.jsonl", slurp(session_ / "journal.jsonl") + "torn");
  EXPECT_THAT(addRestPictures(session_, snap_).error().message(), HasSubstr("torn"));
  EXPECT_FALSE(fs::exists(session_ / kRestFolder));
}

TEST_F(RestPicturesTest, ARecordThatLeadsElsewhereIsAProblem) {
  const auto writer = std::move(SessionWriter::amend(session_)).value();
  const GenericRecord record{
      "rest", R"({"files":[{"name":"rest/../session.json","sha256":"00","size_bytes":1}]})"};
  ASSERT_TRUE(writer->append(timeOf(20), record).ok());
  EXPECT_THAT(report().problems, ElementsAre(HasSubstr("is no picture at rest")));
}

}  // namespace
}  // namespace tenter
