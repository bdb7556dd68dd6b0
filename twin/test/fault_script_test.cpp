// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/fault_script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tenter/core/toml_document.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/twin/fault_schedule.h"

namespace tenter {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr int kAxes = 8;

std::string script(const std::string& keys) {
  return "schema_version = 1\n[[fault]]\n" + keys + "\n";
}

FaultScript parsed(const std::string& keys, bool tcp = true) {
  auto result = parseFaultScript(script(keys), "s.toml", {kAxes, tcp});
  EXPECT_TRUE(result.ok()) << result.error().message();
  return *std::move(result);
}

std::string refusal(const std::string& toml, bool tcp = true) {
  const auto result = parseFaultScript(toml, "s.toml", {kAxes, tcp});
  if (result) return "";
  EXPECT_EQ(result.error().kind, ErrorKind::kBadInput);
  return result.error().message();
}

std::vector<std::string> bySchema(const std::string& toml) {
  return test_support::schemaErrors(
      *jsonOfToml(toml, "s.toml"),
      test_support::sourceFolder() / "docs/formats/fault-script.schema.json");
}

TEST(FaultScript, EveryKindIsReadAndInTheSchema) {
  for (const bool axis : {true, false}) {
    for (const std::string& kind : axis ? axisFaultNames() : cellFaultNames()) {
      std::string keys = "kind = \"" + kind + "\"\nat_s = 1.0\ndevice = \"";
      keys += axis ? "axis-8\"" : "cell-8\"";
      if (kind == "slow") keys += "\ndelay_ms = 30.0";
      if (kind == "added-force") keys += "\nadded_N = 15.0";
      const FaultScript read = parsed(keys, false);
      EXPECT_EQ(read.faults.at(0).deviceName(), axis ? "axis-8" : "cell-8");
      EXPECT_THAT(bySchema(script(keys)), IsEmpty()) << kind;
    }
  }
}

TEST(FaultScript, EveryFaultOfACameraIsReadAndInTheSchema) {
  for (const std::string& kind : cameraFaultNames()) {
    std::string keys = "device = \"camera-4\"\nat_s = 1.0\nkind = \"" + kind + "\"";
    if (kind == "lost-packets") keys += "\nlost_percent = 0.5";
    if (kind == "defocused") keys += "\nblur_px = 2.0";
    const auto read = parseFaultScript(script(keys), "s.toml", {kAxes, true, 4});
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->faults.at(0).deviceName(), "camera-4");
    EXPECT_THAT(bySchema(script(keys)), IsEmpty()) << kind;
    const auto& fault = std::get<CameraFault>(read->faults.at(0).kind);
    EXPECT_EQ(fault.other, 0);  // the next one, from the beginning again
    EXPECT_DOUBLE_EQ(fault.lost_share, kind == "lost-packets" ? 0.005 : 0.0);
  }
}

TEST(FaultScript, WhatACameraDoesNotHaveIsRefused) {
  const auto refusalOf = [](const std::string& keys, int cameras = 4) {
    const auto read = parseFaultScript(script("device = \"camera-2\"\n" + keys), "s.toml",
                                       {kAxes, true, cameras});
    return read ? "" : read.error().message();
  };
  const std::string when = "at_s = 1.0\n";
  EXPECT_THAT(refusalOf(when + "kind = \"frozen\"", 0), HasSubstr("no device"));
  EXPECT_THAT(refusalOf(when + "kind = \"stall\""), HasSubstr("lost-packets"));
  EXPECT_THAT(refusalOf(when + "kind = \"lost-packets\""), HasSubstr("lost_percent"));
  EXPECT_THAT(refusalOf(when + "kind = \"swapped\"\nwith = \"camera-2\""), HasSubstr("with"));
  EXPECT_THAT(refusalOf(when + "kind = \"swapped\"\nwith = \"camera-9\""), HasSubstr("with"));
  EXPECT_THAT(refusalOf(when + "kind = \"frozen\"\ncount = 2"), HasSubstr("count"));
  EXPECT_THAT(refusalOf(when + "kind = \"frozen\"\nblur_px = 2.0"), HasSubstr("defocused"));
  EXPECT_THAT(refusalOf("force_N = 1.0\nkind = \"frozen\""), HasSubstr("force_N"));
}

TEST(FaultScript, WhatIsWrongIsNamed) {
  const std::string good = "device = \"axis-1\"\nkind = \"stall\"\n";
  struct Case {
    std::string toml;
    const char* reason;
  };
  const std::vector<Case> cases{
      {"", "schema_version"},
      {"schema_version = 1", "fault"},
      {"schema_version = 1\nfault = []", "1 to 1000 times"},
      {"nonsense", "s.toml"},
      {script(good), "exactly one of"},
      {script(good + "at_s = 1.0\nphase = \"idle\""), "exactly one of"},
      {script(good + "at_s = -1.0"), "fault[0].at_s"},
      {script(good + "at_s = 1.0\nfor_s = 1.0\ncount = 2"), "either count or for_s"},
      {script(good + "at_s = 1.0\ncolour = 2"), "colour"},
      {script(good + "phase = \"sleeping\""), "no such phase"},
      {script(good + "after = \"nothing\""), "called \"nothing\""},
      {script(good + "at_s = 1.0\ndelay_s = [2.0, 1.0]"), "shortest, longest"},
      {script(good + "at_s = 1.0\ndelay_ms = 2.0"), "belongs to"},
      {script(good + "at_s = 1.0\nadded_N = 2.0"), "belongs to"},
      {script("device = \"axis-9\"\nkind = \"stall\"\nat_s = 1.0"), "axis-9"},
      {script("device = \"axis-1x\"\nkind = \"stall\"\nat_s = 1.0"), "axis-1x"},
      {script("device = \"cell-\"\nkind = \"stuck\"\nat_s = 1.0"), "cell-"},
      {script("device = \"a\"\nkind = \"stuck\"\nat_s = 1.0"), "\"a\""},
      {script("device = \"cell-1\"\nkind = \"stall\"\nat_s = 1.0"), "a cell has no fault"},
      {script("device = \"axis-1\"\nkind = \"stuck\"\nat_s = 1.0"), "an axis has no fault"},
      {script("device = \"cell-1\"\nkind = \"bad-crc\"\nat_s = 1.0"), "Modbus TCP has no"},
      {script("device = \"axis-1\"\nkind = \"jammed\"\nat_s = 1.0\ncount = 3"), "lasts"},
      {script("device = \"axis-1\"\nkind = \"slow\"\nat_s = 1.0"), "delay_ms"},
      {script(good + "name = \"a\"\nat_s = 1.0\n[[fault]]\n" + good + "name = \"a\"\nat_s = 1.0"),
       "another fault has it"}};
  for (const Case& wrong : cases) {
    EXPECT_THAT(refusal(wrong.toml), HasSubstr(wrong.reason)) << wrong.toml;
  }
  EXPECT_THAT(bySchema(script(good)), Not(IsEmpty()));
  EXPECT_THAT(bySchema(script("device = \"axis-1\"\nkind = \"stuck\"\nat_s = 1.0")),
              Not(IsEmpty()));
}

/// A rig of two axes that does what it is told, looked at every 10 ms.
class Play {
 public:
  explicit Play(const std::string& keys) : schedule(parsed(keys)) {
    now.positions_m.assign(kAxes, 0.0);
    now.tensions_N.assign(kAxes, 0.0);
    now.homing.assign(kAxes, false);
  }
  void run(double span_s, double speed_m_per_s = 0.0, int moving = 2) {
    for (double end_s = time_s + span_s; time_s < end_s; time_s += kStep_s) {
      for (int i = 0; i < moving; ++i) {
        now.positions_m[static_cast<std::size_t>(i)] += speed_m_per_s * kStep_s;
      }
      for (const FaultAction& action : schedule.step(time_s, now)) {
        events.push_back((action.begins ? "+" : "-") + schedule.script().faults[action.fault].name);
        times_s.push_back(time_s);
      }
    }
  }
  static constexpr double kStep_s = 0.01;
  FaultSchedule schedule;
  RigSnapshot now;
  std::vector<std::string> events;
  std::vector<double> times_s;
  double time_s = 0.0;
};

TEST(FaultSchedule, PhasesAreToldByWhatMoves) {
  RigPhaseWatch watch;
  RigSnapshot now{{0.0, 0.0}, {0.0, 0.0}, {false, false}};
  double time_s = 0.0;
  const auto see = [&](double way_0_m, double way_1_m) {
    RigPhase phase{};
    for (int i = 0; i < 30; ++i) {
      now.positions_m[0] += way_0_m;
      now.positions_m[1] += way_1_m;
      phase = watch.see(time_s += 0.01, now);
    }
    return rigPhaseName(phase);
  };
  EXPECT_EQ(see(0, 0), "idle");
  EXPECT_EQ(see(1e-5, 0), "jog");
  EXPECT_EQ(see(1e-5, 1e-5), "loading");
  EXPECT_EQ(see(-1e-5, -1e-5), "unloading");
  now.tensions_N[1] = 0.2;
  EXPECT_EQ(see(0, 0), "holding");
  now.homing[0] = true;
  EXPECT_EQ(see(-1e-5, 0), "homing");
  // From target to target an axis stands still for a moment.
  now.homing[0] = false;
  see(1e-5, 1e-5);
  EXPECT_EQ(watch.see(time_s + 0.05, now), RigPhase::kLoading);
}

TEST(FaultSchedule, BeginsAndEndsByTheClock) {
  Play play("name = \"a\"\ndevice = \"cell-1\"\nkind = \"silence\"\nat_s = 0.5\nfor_s = 0.2");
  play.run(2.0);
  EXPECT_THAT(play.events, ElementsAre("+a", "-a"));
  EXPECT_NEAR(play.times_s.at(0), 0.5, 0.011);
  EXPECT_NEAR(play.times_s.at(1), 0.7, 0.021);
}

TEST(FaultSchedule, BeginsWithAPhaseAsOftenAsAsked) {
  for (const auto& [times, begun] : {std::pair{1, 1}, {2, 2}, {0, 3}}) {
    Play play("device = \"cell-1\"\nkind = \"silence\"\nphase = \"loading\"\ntimes = " +
              std::to_string(times));
    for (int i = 0; i < 3; ++i) {
      play.run(0.3);
      play.run(0.3, 1e-3);
    }
    EXPECT_EQ(play.events.size(), static_cast<std::size_t>(begun)) << times;
  }
}

TEST(FaultSchedule, BeginsAtAForceAPositionOrAfterAnother) {
  Play play(
      "name = \"f\"\ndevice = \"axis-2\"\nkind = \"jammed\"\nforce_N = 0.5\nfor_s = "
      "0.1\n[[fault]]\n"
      "name = \"p\"\ndevice = \"axis-1\"\nkind = \"stall\"\nposition_m = 0.001\n[[fault]]\n"
      "name = \"g\"\ndevice = \"axis-1\"\nkind = \"unplug\"\nafter = \"f\"\ndelay_s = 0.3\nfor_s = "
      "1.0");
  play.run(0.5);
  EXPECT_THAT(play.events, IsEmpty());
  play.now.tensions_N[1] = 0.6;
  play.run(1.0);
  EXPECT_THAT(play.events, ElementsAre("+f", "-f", "+g"));
  EXPECT_NEAR(play.times_s.at(2) - play.times_s.at(1), 0.3, 0.021);
  play.run(2.0, 1e-3);
  EXPECT_THAT(play.events, ElementsAre("+f", "-f", "+g", "-g", "+p"));
}

TEST(FaultSchedule, RandomDelaysComeFromTheSeed) {
  const std::string keys =
      "device = \"cell-1\"\nkind = \"silence\"\nat_s = 0.1\ndelay_s = [0.0, 1.0]";
  Play one(keys), other(keys);
  one.run(2.0);
  other.run(2.0);
  EXPECT_EQ(one.times_s, other.times_s);
  auto another = parseFaultScript("seed = 9\n" + script(keys), "s.toml", {kAxes, true});
  FaultSchedule schedule(*std::move(another));
  double begun_s = -1.0;
  for (double t = 0.0; t < 2.0; t += Play::kStep_s) {
    if (!schedule.step(t, one.now).empty()) begun_s = t;
  }
  EXPECT_GT(std::abs(begun_s - one.times_s.at(0)), 0.02);
}

}  // namespace
}  // namespace tenter
