// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/redecide.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "machine_bench.h"
#include "tenter/core/files.h"
#include "tenter/session/session_writer.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::rig_test {
namespace {

using Kind = RigCommand::Kind;
using testing::HasSubstr;

/// The bench, recorded as the daemon records a rig, from the run on.
class Recorded {
 public:
  Recorded() {
    bench.enable();
    bench.command(Kind::kTare);
    bench.steps(40);
  }

  /// Runs the protocol; `each` is called before every tick, with the tick's number.
  void run(const std::function<void(int)>& each, bool close = true) {
    SessionHeader header;
    header.id = "s";
    header.start_utc = "2026-11-24T20:49:49Z";
    header.fabric = "knit-12";
    header.areal_density_kg_per_m2 = 0.2;
    header.protocol = "pull";
    header.protocol_text = benchProtocolToml();
    header.rig_configuration = benchToml();
    header.actuators = {"axis-1", "axis-2"};
    header.cells = {"cell-1", "cell-2"};
    writer_ = std::move(SessionWriter::create(session(), header)).value();
    zero_ns_ = bench.tick.time_ns + 3'000'000;
    const RigMemory before = bench.machine.memory();
    RigCommand run;
    run.kind = Kind::kRun;
    run.id = 99;
    run.protocol =
        std::make_shared<CaptureProtocol>(*parseCaptureProtocol(benchProtocolToml(), "p.toml"));
    bench.tick.commands.push_back(run);
    write(zero_ns_, RigJournal::memoryRecord(before, zero_ns_));
    for (int i = 0; i < 3000; ++i) {
      each(i);
      if (step()) break;
    }
    if (close) {
      ASSERT_TRUE(writer_->close(bench.tick.time_ns - zero_ns_).ok());
    }
    writer_.reset();
  }

  std::string session() const { return folder_ / "S"; }
  std::string journal() const { return session() + "/journal.jsonl"; }

  MachineBench bench;

 private:
  void write(std::int64_t time_ns, const RecordBody& body) {
    writer_->append(time_ns - zero_ns_, body, Commit::kGroup).value();
  }

  /// As MachineBench::step, but with the tick kept for the journal. True once the run has ended.
  bool step() {
    const RigTick asked = bench.tick;  // commands and halts; step() fills in what is read
    bench.step();
    RigTick tick = bench.tick;
    tick.commands = asked.commands;
    tick.trip = asked.trip;
    tick.halted_outside = asked.halted_outside;
    for (const RecordBody& body : journal_.tickRecords(tick)) write(tick.time_ns, body);
    for (const RecordBody& body : bench.orders.records) write(tick.time_ns, body);
    return bench.orders.run_ended;
  }

  test_support::TemporaryFolder folder_;
  std::unique_ptr<SessionWriter> writer_;
  RigJournal journal_;
  std::int64_t zero_ns_ = 0;
};

Redecider decided(const std::string& session) {
  Redecider redecider;
  const auto summary = replaySession(session, {}, redecider);
  EXPECT_TRUE(summary.ok()) << summary.error().message();
  return redecider;
}

std::string recordedEvents(const std::string& session) {
  EventLog log;
  EXPECT_TRUE(replaySession(session, {}, log).ok());
  return log.text();
}

void expectTheSame(const Recorded& recorded, const char* what) {
  const Redecider again = decided(recorded.session());
  EXPECT_TRUE(again.decided());
  EXPECT_TRUE(again.identical());
  EXPECT_EQ(again.text(), recordedEvents(recorded.session()));
  EXPECT_THAT(again.text(), HasSubstr(what));
  EXPECT_GT(again.ticks(), 100U);
}

TEST(Redecider, DecidesANormalRunAgainByteForByte) {
  Recorded recorded;
  recorded.run([](int) {});
  expectTheSame(recorded, "\"how\":\"done\"");
}

TEST(Redecider, DecidesEveryKindOfEndAgain) {
  struct Case {
    const char* what;
    std::function<void(MachineBench&, int)> disturb;
  };
  const auto at = [](int tick, const std::function<void(MachineBench&)>& act) {
    return [tick, act](MachineBench& bench, int i) {
      if (i == tick) act(bench);
    };
  };
  const auto command = [](Kind kind) {
    return [kind](MachineBench& bench) {
      RigCommand order;
      order.kind = kind;
      bench.tick.commands.push_back(order);
    };
  };
  const std::vector<Case> cases{
      {"\"how\":\"aborted\"", at(150, command(Kind::kAbort))},
      {"operator's stop", at(150, command(Kind::kStop))},
      {"operator's stop", at(150, [](auto& b) { b.tick.halted_outside = true; })},
      {"absolute-force", at(150,
                            [](auto& b) {
                              b.tick.trip = ForceTrip{1, 6.123456789012345};
                            })},
      {"absolute-force", at(150, [](auto& b) { b.extra_N = 7.1; })},
      {"silence", at(150, [](auto& b) { b.stale_cell = 1; })},
      {"timeout", at(150, [](auto& b) { b.mute_axis = 0; })},
      {"following-error", at(150, [](auto& b) { b.stuck = 1; })},
      {"emergency stop", at(150, [](auto& b) { b.tick.emergency_stop = true; })},
      {"lease-lost", at(150, [](auto& b) { b.tick.operator_gone = true; })},
      {"not-written", at(150, [](auto& b) { b.tick.recorder_fault = "no space \"left\""; })},
      {"late-tick", at(150, [](auto& b) { b.tick.time_ns += 300'000'000; })},
      {"refused", at(150, command(Kind::kTare))}};
  for (const Case& end : cases) {
    Recorded recorded;
    recorded.run([&](int i) { end.disturb(recorded.bench, i); });
    SCOPED_TRACE(end.what);
    expectTheSame(recorded, end.what);
  }
}

TEST(Redecider, PausesAndResumesAgain) {
  Recorded recorded;
  recorded.run([&](int i) {
    RigCommand order;
    order.kind = i == 100 ? Kind::kPause : Kind::kResume;
    if (i == 100 || i == 180) recorded.bench.tick.commands.push_back(order);
  });
  expectTheSame(recorded, "\"to\":\"paused\"");
}

TEST(Redecider, ADecisionThatDoesNotFollowIsFound) {
  Recorded recorded;
  recorded.run([](int) {});
  // As somebody may do who writes a true checksum too: here another session's header.
  auto text = readFile(recorded.session() + "/session.json").value();
  const auto limit = text.find("slope_N_per_s = 30.0");
  ASSERT_NE(limit, std::string::npos);
  text.replace(limit, 20, "slope_N_per_s = 0.50");
  ASSERT_TRUE(writeFileAtomically(recorded.session() + "/session.json", text).ok());
  const Redecider again = decided(recorded.session());
  ASSERT_TRUE(again.decided());
  EXPECT_FALSE(again.identical());
  EXPECT_GT(again.firstDifference(), 2U);
  EXPECT_THAT(again.text(), HasSubstr("force-slope"));
}

TEST(Redecider, ASessionThatBreaksOffIsFollowedToItsEnd) {
  Recorded recorded;
  recorded.run([](int) {}, false);
  // The last tick's events are lost.
  auto text = readFile(recorded.journal()).value();
  const auto last = text.rfind("\"kind\":\"sample\"");
  text.resize(text.find('\n', last) + 1);
  ASSERT_TRUE(writeFileAtomically(recorded.journal(), text).ok());
  const Redecider again = decided(recorded.session());
  EXPECT_TRUE(again.decided());
  EXPECT_TRUE(again.identical());
}

TEST(Redecider, HostileInputsAreNamed) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {"rig-memory", "{}"},
      {"rig-memory", R"({"state":"asleep"})"},
      {"rig-input", R"({"axes":[],"cells":[]})"},
      {"rig-halt", R"({"halted_outside":true,"trip":{"cell":2,"gross_N":1.0}})"},
      {"rig-command", R"({"command":"dance"})"}};
  for (const auto& [kind, data] : cases) {
    const RigConfig config = *parseRecordedRigConfig(benchToml());
    RigJournalReader reader(config, nullptr);
    JournalRecord record;
    record.body = GenericRecord{kind, data};
    const auto taken = reader.take(record);
    ASSERT_FALSE(taken.ok()) << kind << data;
    EXPECT_THAT(taken.error().message(), HasSubstr("journal.jsonl")) << kind;
  }
}

}  // namespace
}  // namespace tenter::rig_test
