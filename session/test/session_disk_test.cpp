// SPDX-License-Identifier: GPL-3.0-or-later
// Disks that are full or may not be written: errors come back, and the session stays whole.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "child_process.h"
#include "journal_file.h"
#include "posix_file.h"
#include "session_samples.h"
#include "tenter/session/session_export.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::header;
using session_samples::Images;
using session_samples::inChild;
using session_samples::sample;
using session_samples::timeOf;
using test_support::TemporaryFolder;

constexpr const char* kCannotMount = "cannot mount";
constexpr int kManySamples = 100'000;

/// Appends samples until one is refused; the message of the refusal, or "" if none came.
std::string fillWithSamples(SessionWriter& writer) {
  for (int i = 0; i < kManySamples; ++i) {
    const auto done = writer.append(timeOf(i), sample(writer.header(), i));
    if (!done) return done.error().message();
  }
  return "";
}

/// Problems that `verify` sees, one a line.
std::string problemsOf(const fs::path& session) {
  const auto report = verifySession(session);
  if (!report) return report.error().message();
  std::string text = report->cut_bytes == 0 ? "" : "torn\n";
  for (const std::string& problem : report->problems) text += problem + "\n";
  return text;
}

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

/// A file system of that size in a mount namespace of this process alone.
bool mountSmallDisk(const fs::path& place, const std::string& size) {
  fs::create_directories(place);
  return unshare(CLONE_NEWNS) == 0 &&
         mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("tmpfs", place.c_str(), "tmpfs", 0, ("size=" + size).c_str()) == 0;
}

TEST(SessionDiskTest, ALimitOfFileSizeCutsNoRecordInHalf) {
  const TemporaryFolder folder;
  const fs::path session = folder / "s";
  const std::string complaint = inChild([&]() -> std::string {
    std::signal(SIGXFSZ, SIG_IGN);
    auto writer = std::move(SessionWriter::create(session, header())).value();
    rlimit old{};
    getrlimit(RLIMIT_FSIZE, &old);
    const rlimit small{fs::file_size(session / "journal.jsonl") + 10'001, old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const std::string refusal = fillWithSamples(*writer);
    if (!contains(refusal, "File too large")) return "refused with: " + refusal;
    if (auto text = problemsOf(session); !text.empty()) return "while full: " + text;
    const std::string large(20'000, 'x');
    const FrameImage image{"left", "png", large};
    if (writer->addFrame(0, {&image, 1})) return "stored an image past the limit";
    if (!fs::is_empty(session / "frames")) return "left half an image";
    setrlimit(RLIMIT_FSIZE, &old);
    if (!writer->append(0, sample(writer->header(), 0))) return "does not go on";
    if (!writer->close(0)) return "does not close";
    return problemsOf(session);
  });
  EXPECT_EQ(complaint, "");
  EXPECT_TRUE(verifySession(session)->closed);
}

std::string onAFullDisk(const fs::path& disk) {
  if (!mountSmallDisk(disk, "4m")) return kCannotMount;
  const fs::path session = disk / "s";
  auto writer = std::move(SessionWriter::create(session, header())).value();
  const std::string refusal = fillWithSamples(*writer);
  if (!contains(refusal, "No space left")) return "refused with: " + refusal;
  if (writer->addFrame(0, Images(0).list)) return "stored an image on a full disk";
  if (!fs::is_empty(session / "frames")) return "left half an image";
  // The reserve is there for this.
  for (int i = 0; i < 100; ++i) {
    if (!writer->append(0, FaultEvent{"disk", "full", refusal})) return "cannot say why it stops";
  }
  if (auto done = writer->close(0); !done) return "cannot close: " + done.error().message();
  if (!verifySession(session)->closed) return "is not closed";
  const auto exported = exportSessionToHdf5(session, disk / "s.h5");
  if (exported.ok()) return "exported to a full disk";
  if (fs::exists(disk / "s.h5")) return "left half an export";
  if (std::distance(fs::directory_iterator(disk), fs::directory_iterator()) != 1)
    return "left litter";
  return problemsOf(session);
}

TEST(SessionDiskTest, AFullDiskStillTakesTheReason) {
  const TemporaryFolder folder;
  const std::string complaint = inChild([&] { return onAFullDisk(folder / "disk"); });
  if (complaint == kCannotMount) GTEST_SKIP() << "needs the right to mount";
  EXPECT_EQ(complaint, "");
}

std::string untilThereIsRoomAgain(const fs::path& disk) {
  if (!mountSmallDisk(disk, "4m")) return kCannotMount;
  const fs::path session = disk / "s", ballast = disk / "ballast";
  auto writer = std::move(SessionWriter::create(session, header())).value();
  if (!writeNewFile(ballast, std::string(2'000'000, 'x'))) return "no room for the ballast";
  if (fillWithSamples(*writer).empty()) return "was never full";
  const std::uint64_t records = writer->records();
  fs::remove(ballast);
  if (writer->append(0, sample(writer->header(), 0)).value() != records) return "lost a number";
  if (!writer->addFrame(0, Images(0).list)) return "takes no image";
  if (!writer->close(0)) return "does not close";
  return problemsOf(session);
}

TEST(SessionDiskTest, GoesOnOnceThereIsRoom) {
  const TemporaryFolder folder;
  const std::string complaint = inChild([&] { return untilThereIsRoomAgain(folder / "disk"); });
  if (complaint == kCannotMount) GTEST_SKIP() << "needs the right to mount";
  EXPECT_EQ(complaint, "");
}

std::string onAReadOnlyDisk(const fs::path& disk) {
  if (!mountSmallDisk(disk, "4m")) return kCannotMount;
  session_samples::writeSession(disk / "s");
  if (mount(nullptr, disk.c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr) != 0) {
    return kCannotMount;
  }
  const auto resumed = SessionWriter::resume(disk / "s");
  if (resumed.ok() || !contains(resumed.error().message(), "Read-only")) return "resumed";
  if (SessionWriter::create(disk / "t", header()).ok()) return "created";
  return problemsOf(disk / "s");
}

TEST(SessionDiskTest, AReadOnlyDiskCanBeReadAndSaysSo) {
  const TemporaryFolder folder;
  const std::string complaint = inChild([&] { return onAReadOnlyDisk(folder / "disk"); });
  if (complaint == kCannotMount) GTEST_SKIP() << "needs the right to mount";
  EXPECT_EQ(complaint, "");
}

TEST(SessionDiskTest, AClosedSessionGivesItsReserveBack) {
  const TemporaryFolder folder;
  session_samples::writeSession(folder / "s", 2);
  struct stat status {};
  ASSERT_EQ(stat((folder / "s/journal.jsonl").c_str(), &status), 0);
  EXPECT_LT(512 * status.st_blocks, JournalFile::kReserve_bytes);
}

}  // namespace
}  // namespace tenter
