// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/core/files.h"
#include "tenter/session/replay.h"
#include "verbs.h"
#ifdef TENTER_HARDWARE
#include "tenter/rig/redecide.h"
#endif

namespace tenter::app {

namespace {

constexpr const char* kAsFastAsItGoes = "max";

struct Options {
  std::string session, output, speed = kAsFastAsItGoes;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("session", o.session, "Session folder")->required();
  command.add_option("--speed", o.speed, "Recorded seconds per second, or max")
      ->capture_default_str();
  command.add_option("--log", o.output, "File for the events and decisions, one a line");
}

Result<double> speedOf(const std::string& text) {
  if (text == kAsFastAsItGoes) return std::numeric_limits<double>::infinity();
  double speed = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), speed);
  if (error == std::errc{} && end == text.data() + text.size() && std::isfinite(speed) &&
      speed > 0.0) {
    return speed;
  }
  return usageError("--speed " + text + ": must be a number above 0, or max");
}

/// What the rig's state machine decides from the recorded inputs; without the rig's module, and in
/// sessions without inputs, the events as they were recorded.
class Decisions {
 public:
#ifdef TENTER_HARDWARE
  RecordConsumer& consumer() { return log_; }
  bool decided() const { return log_.decided(); }
  bool identical() const { return log_.identical(); }
  std::uint64_t firstDifference() const { return log_.firstDifference(); }

 private:
  Redecider log_;

 public:
#else
  RecordConsumer& consumer() { return log_; }
  bool decided() const { return false; }
  bool identical() const { return true; }
  std::uint64_t firstDifference() const { return 0; }

 private:
  EventLog log_;

 public:
#endif
  const std::string& text() const { return log_.text(); }
  std::uint64_t lines() const { return log_.lines(); }
};

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

std::string secondsText(double time_s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", time_s);
  return text;
}

void say(const Decisions& log, const ReplaySummary& summary, const Options& o, Console& console) {
  const double recorded_s = seconds(summary.recorded_ns);
  console.answer = {{"records", summary.records},
                    {"logged", log.lines()},
                    {"log", o.output},
                    {"decided", log.decided()},
                    {"identical", log.identical()},
                    {"cut_bytes", summary.cut_bytes},
                    {"recorded_s", recorded_s},
                    {"wall_s", summary.wall_s},
                    {"speed", recorded_s / std::max(summary.wall_s, 1e-9)},
                    {"interrupted", summary.interrupted}};
  if (summary.cut_bytes > 0) {
    console.warn(o.session + ": its last " + std::to_string(summary.cut_bytes) +
                 " bytes are torn and were left out");
  }
  if (summary.interrupted) console.warn("interrupted: the log ends early");
  console.say(std::to_string(summary.records) + " records, " + secondsText(recorded_s) + " in " +
              secondsText(summary.wall_s) + "; " + std::to_string(log.lines()) + " events, " +
              (log.decided() ? "decided again" : "as recorded"));
}

Result<int> replay(const Options& o, Console& console) {
  const auto speed = speedOf(o.speed);
  if (!speed) return speed.error();
  if (!o.output.empty()) {
    if (auto free = checkOutputFile(o.output, "\"kind\":\"event\""); !free) return free.error();
  }
  Decisions log;
  Progress progress(console);
  ReplayOptions options;
  options.speed = *speed;
  options.interrupted = interrupted;
  options.progress = [&](std::int64_t time_ns) {
    progress.show(-1.0, "replaying, " + secondsText(seconds(time_ns)));
  };
  const auto summary = replaySession(o.session, options, log.consumer());
  if (!summary) return summary.error();
  if (!o.output.empty()) {
    if (auto done = writeFileAtomically(o.output, log.text()); !done) return done.error();
  }
  say(log, *summary, o, console);
  if (summary->interrupted) return static_cast<int>(ErrorKind::kNotConverged);
  if (log.identical()) return kDone;
  console.warn(o.session + ": event " + std::to_string(log.firstDifference()) +
               " is not what follows from the recorded inputs");
  return static_cast<int>(ErrorKind::kBadInput);
}

}  // namespace

Verb sessionReplay() {
  return {"replay", "Decide again from the recorded inputs, and log the events",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, replay); }};
}

}  // namespace tenter::app
