// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/core/files.h"
#include "tenter/session/replay.h"
#include "tenter/session/session_export.h"
#include "tenter/session/session_reader.h"
#include "tenter/session/session_writer.h"
#include "verbs.h"

namespace tenter::app {

namespace {

constexpr const char* kAsFastAsItGoes = "max";

struct Options {
  std::string session, output, target, speed = kAsFastAsItGoes;
};

void declareSession(CLI::App& command, Options& o) {
  command.add_option("session", o.session, "Session folder")->required();
}

void declareReplay(CLI::App& command, Options& o) {
  declareSession(command, o);
  command.add_option("--speed", o.speed, "Recorded seconds per second, or max")
      ->capture_default_str();
  command.add_option("--log", o.output, "File for the events and decisions, one a line");
}

void declareExport(CLI::App& command, Options& o) {
  std::string targets;
  for (const SessionExport& target : sessionExports()) {
    targets += "\n  " + std::string(target.id) + ": " + std::string(target.description);
  }
  declareSession(command, o);
  command.add_option("--to", o.target, "Format:" + targets)->required();
  command.add_option("-o,--output", o.output, "File to write")->required();
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

std::string secondsText(double time_s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", time_s);
  return text;
}

nlohmann::json countsOf(const SessionReport& report) {
  return {{"frames", report.frames},
          {"records", report.records},
          {"samples", report.samples},
          {"events", report.events},
          {"cut_bytes", report.cut_bytes},
          {"cut_records", report.cut_records},
          {"repairs", report.repairs},
          {"stray_files", report.stray_files},
          {"duration_s", seconds(report.duration_ns)},
          {"closed", report.closed},
          {"ok", report.ok()},
          {"problems", report.problems}};
}

void sayCounts(const SessionReport& report, Console& console) {
  console.say(std::to_string(report.records) + " records: " + std::to_string(report.samples) +
              " samples, " + std::to_string(report.frames) + " frames, " +
              std::to_string(report.events) + " events, " +
              secondsText(seconds(report.duration_ns)) + (report.closed ? "" : ", not closed"));
  if (report.cut_bytes > 0) {
    console.say("cut off: " + std::to_string(report.cut_bytes) + " bytes, " +
                std::to_string(report.cut_records) +
                " records begun in them; repairs: " + std::to_string(report.repairs));
  }
  if (report.stray_files > 0) {
    console.say(std::to_string(report.stray_files) + " files in frames/ without a record");
  }
}

Result<int> info(const Options& o, Console& console) {
  const auto header = readSessionHeader(o.session);
  if (!header) return header.error();
  const auto report = inspectSession(o.session);
  if (!report) return report.error();
  console.answer = countsOf(*report);
  console.answer.erase("ok");  // Only `verify` can say that.
  console.answer.update({{"id", header->id},
                         {"who", header->who},
                         {"operator", header->operator_name},
                         {"start_utc", header->start_utc},
                         {"fabric", header->fabric},
                         {"specimen", header->specimen},
                         {"areal_density_kg_per_m2", header->areal_density_kg_per_m2},
                         {"protocol", header->protocol},
                         {"calibration_ids", header->calibration_ids},
                         {"actuators", header->actuators},
                         {"cells", header->cells}});
  console.say(header->id + ": " + header->fabric + " (" + header->specimen + "), " +
              header->protocol + ", " + header->start_utc + ", " + header->operator_name);
  sayCounts(*report, console);
  return kDone;
}

Result<int> verify(const Options& o, Console& console) {
  const auto report = verifySession(o.session);
  if (!report) return report.error();
  console.answer = countsOf(*report);
  sayCounts(*report, console);
  for (const std::string& problem : report->problems) console.say("problem: " + problem);
  console.say(o.session + (report->ok() ? ": ok" : ": damaged"));
  return report->ok() ? kDone : static_cast<int>(ErrorKind::kBadInput);
}

Result<int> repair(const Options& o, Console& console) {
  const auto report = SessionWriter::repair(o.session);
  if (!report) return report.error();
  console.answer = {{"cut_bytes", report->cut_bytes},
                    {"cut_records", report->cut_records},
                    {"offset_bytes", report->offset_bytes},
                    {"line_end_added", report->newline_added},
                    {"stray_files", report->stray_files},
                    {"damaged_lines", report->damaged_lines},
                    {"report", report->report}};
  console.say(report->report.empty()
                  ? o.session + ": nothing was torn"
                  : o.session + ": cut " + std::to_string(report->cut_bytes) + " bytes, moved " +
                        std::to_string(report->stray_files.size()) + " files; all kept in " +
                        report->report);
  return kDone;
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

Result<int> replay(const Options& o, Console& console) {
  const auto speed = speedOf(o.speed);
  if (!speed) return speed.error();
  if (!o.output.empty()) {
    if (auto free = checkOutputFile(o.output, "\"kind\":\"event\""); !free) return free.error();
  }
  EventLog log;
  Progress progress(console);
  ReplayOptions options;
  options.speed = *speed;
  options.interrupted = interrupted;
  options.progress = [&](std::int64_t time_ns) {
    progress.show(-1.0, "replaying, " + secondsText(seconds(time_ns)));
  };
  const auto summary = replaySession(o.session, options, log);
  if (!summary) return summary.error();
  if (!o.output.empty()) {
    if (auto done = writeFileAtomically(o.output, log.text()); !done) return done.error();
  }
  const double recorded_s = seconds(summary->recorded_ns);
  const double factor = recorded_s / std::max(summary->wall_s, 1e-9);
  console.answer = {{"records", summary->records},
                    {"logged", log.lines()},
                    {"log", o.output},
                    {"cut_bytes", summary->cut_bytes},
                    {"recorded_s", recorded_s},
                    {"wall_s", summary->wall_s},
                    {"speed", factor},
                    {"interrupted", summary->interrupted}};
  if (summary->cut_bytes > 0) {
    console.warn(o.session + ": its last " + std::to_string(summary->cut_bytes) +
                 " bytes are torn and were left out");
  }
  if (summary->interrupted) console.warn("interrupted: the log ends early");
  console.say(std::to_string(summary->records) + " records, " + secondsText(recorded_s) + " in " +
              secondsText(summary->wall_s) + "; " + std::to_string(log.lines()) + " events");
  return summary->interrupted ? static_cast<int>(ErrorKind::kNotConverged) : kDone;
}

Result<int> exportTo(const Options& o, Console& console) {
  const auto target = findSessionExport(o.target);
  if (!target) return target.error();
  if (auto free = checkOutputFile(o.output, (*target)->marker); !free) return free.error();
  if (auto done = (*target)->write(o.session, o.output); !done) return done.error();
  console.answer = {{"file", o.output}, {"to", o.target}};
  console.say(o.output + ": written");
  return kDone;
}

}  // namespace

Verb sessionVerb() {
  static constexpr std::array kRows = {
      Verb{"info", "What a session holds",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSession, info); }},
      Verb{"verify", "Check every record and image; exit 3 if any is damaged",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSession, verify); }},
      Verb{"repair", "Cut a torn tail off, keep it beside, and say what it was",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSession, repair); }},
      Verb{"replay", "Go through the records in their order and log the events",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareReplay, replay); }},
      Verb{"export", "Write a session for other programs",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareExport, exportTo); }}};
  return {"session", "Recorded sessions", [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
