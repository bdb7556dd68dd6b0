// SPDX-License-Identifier: GPL-3.0-or-later
// `tenter session …` as users type it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.h"
#include "tenter/session/session_writer.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

namespace fs = std::filesystem;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;

class SessionCommand : public testing::Test {
 protected:
  void SetUp() override {
    SessionHeader h;
    h.id = "s1";
    h.start_utc = "2026-11-24T20:49:49Z";
    h.fabric = "knit-12";
    h.areal_density_kg_per_m2 = 0.2;
    h.protocol = "stretch-weft";
    h.actuators = {"a"};
    h.cells = {"c"};
    const auto writer = std::move(SessionWriter::create(folder_ / "S", h)).value();
    writer->append(0, StateChange{"Ready", "Running", "operator"}).value();
    for (int i = 1; i <= kSamples; ++i) {
      const SampleRecord sample{{0.001 * i}, {{0.1 * i, TensionStatus::kOk, 0}}};
      writer->append(i * kPeriod_ns, sample).value();
    }
    const FrameImage image{"left", "png", "pixels"};
    writer->addFrame(kSamples * kPeriod_ns, {&image, 1}).value();
    writer->append(kSamples * kPeriod_ns, Decision{"stop", R"({"v_m_per_s":0.0e0})"}).value();
    ASSERT_TRUE(writer->close(kSamples * kPeriod_ns).ok());
  }
  Outcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "session");
    return tenter(arguments, folder_.path());
  }

  static constexpr int kSamples = 40;
  static constexpr std::int64_t kPeriod_ns = 5'000'000;
  TemporaryFolder folder_;
};

TEST_F(SessionCommand, InfoSaysWhatIsInIt) {
  const Outcome outcome = run({"info", "S", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json().at("fabric"), "knit-12");
  EXPECT_EQ(outcome.json().at("samples"), kSamples);
  EXPECT_EQ(outcome.json().at("frames"), 1);
  EXPECT_EQ(outcome.json().at("closed"), true);
  EXPECT_NEAR(outcome.json().at("duration_s").get<double>(), 0.2, 1e-9);
  EXPECT_THAT(run({"info", "S"}).out, HasSubstr("40 samples, 1 frames"));
}

TEST_F(SessionCommand, VerifyAnswersWithItsFiveKeys) {
  const Outcome outcome = run({"verify", "S", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("frames"), 1);
  EXPECT_EQ(answer.at("records"), kSamples + 5);
  EXPECT_EQ(answer.at("cut_bytes"), 0);
  EXPECT_EQ(answer.at("ok"), true);
  EXPECT_THAT(answer.at("problems"), IsEmpty());
}

TEST_F(SessionCommand, VerifyNamesDamageAndExitsWithThree) {
  folder_.write("S/frames/000000-left.png", "pixelz");
  const Outcome outcome = run({"verify", "S", "--json"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(outcome.json().at("ok"), false);
  EXPECT_THAT(outcome.json().at("problems")[0].get<std::string>(), HasSubstr("000000-left.png"));
  EXPECT_THAT(run({"verify", "S"}).out, HasSubstr("problem: frames/000000-left.png"));
}

TEST_F(SessionCommand, ATornSessionIsToldAndRepaired) {
  folder_.write("S/journal.jsonl", slurp(folder_ / "S/journal.jsonl") + "{\"seq\":");
  const Outcome torn = run({"verify", "S", "--json"});
  EXPECT_EQ(torn.exit_code, 0);
  EXPECT_EQ(torn.json().at("cut_bytes"), 7);
  const Outcome repaired = run({"repair", "S", "--json"});
  ASSERT_EQ(repaired.exit_code, 0) << repaired.err;
  EXPECT_EQ(repaired.json().at("cut_bytes"), 7);
  EXPECT_TRUE(fs::exists(folder_ / "S" / repaired.json().at("report").get<std::string>()));
  const Outcome whole = run({"verify", "S", "--json"});
  EXPECT_EQ(whole.json().at("ok"), true);
  EXPECT_EQ(whole.json().at("repairs"), 1);
}

TEST_F(SessionCommand, ReplayLogsTheSameBytesAtEverySpeed) {
  const Outcome quick = run({"replay", "S", "--speed", "max", "--log", "max.jsonl", "--json"});
  ASSERT_EQ(quick.exit_code, 0) << quick.err;
  EXPECT_EQ(quick.json().at("logged"), 4);
  const Outcome paced = run({"replay", "S", "--speed", "2", "--log", "paced.jsonl", "--json"});
  ASSERT_EQ(paced.exit_code, 0) << paced.err;
  EXPECT_GE(paced.json().at("wall_s").get<double>(), 0.1);
  const std::string log = slurp(folder_ / "max.jsonl");
  EXPECT_EQ(log, slurp(folder_ / "paced.jsonl"));
  EXPECT_THAT(log, HasSubstr(R"("name":"stop","data":{"v_m_per_s":0.0e0}})"));
  // A log of before may be replaced, a file of somebody else's not.
  EXPECT_EQ(run({"replay", "S", "--log", "max.jsonl"}).exit_code, 0);
  folder_.write("thesis.doc", "dear");
  EXPECT_EQ(run({"replay", "S", "--log", "thesis.doc"}).exit_code, 3);
  EXPECT_EQ(slurp(folder_ / "thesis.doc"), "dear");
}

TEST_F(SessionCommand, ExportWritesHdf5) {
  const Outcome outcome = run({"export", "S", "--to", "hdf5", "-o", "S.h5"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(slurp(folder_ / "S.h5").starts_with("\x89HDF"));
  EXPECT_EQ(run({"export", "S", "--to", "hdf5", "-o", "S.h5"}).exit_code, 0) << "again";
}

TEST_F(SessionCommand, WrongUseAndWrongFoldersAreToldApart) {
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(run({"verify"}).exit_code, 2);
  for (const char* speed : {"0", "-1", "fast", "nan", "inf", "1x", ""}) {
    EXPECT_EQ(run({"replay", "S", "--speed", speed}).exit_code, 2) << speed;
  }
  EXPECT_EQ(run({"export", "S", "--to", "matlab", "-o", "x"}).exit_code, 2);
  for (const char* verb : {"info", "verify", "repair", "replay"}) {
    const Outcome outcome = run({verb, "absent"});
    EXPECT_EQ(outcome.exit_code, 3) << verb;
    EXPECT_THAT(outcome.err, HasSubstr("absent/session.json")) << verb;
  }
  EXPECT_EQ(run({"export", "absent", "--to", "hdf5", "-o", "x.h5"}).exit_code, 3);
  EXPECT_FALSE(fs::exists(folder_ / "x.h5"));
}

}  // namespace
}  // namespace tenter::system_test
