// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "output_guard.h"
#include "session_forces.h"
#include "tenter/session/rest_pictures.h"
#include "tenter/session/session_export.h"
#include "tenter/session/session_reader.h"
#include "tenter/session/session_writer.h"
#include "verbs.h"

namespace tenter::app {

namespace {

namespace fs = std::filesystem;

struct Options {
  std::string session, output, target, pictures;
};

void declareSession(CLI::App& command, Options& o) {
  command.add_option("session", o.session, "Session folder")->required();
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

void declareRest(CLI::App& command, Options& o) {
  declareSession(command, o);
  command.add_option("pictures", o.pictures,
                     "Folder with CAMERA.png, as tenter rig snap writes it; without it those that "
                     "lie in the session's own rest/");
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
          {"rest_pictures", report.rest_pictures},
          {"duration_s", seconds(report.duration_ns)},
          {"closed", report.closed},
          {"ok", report.ok()},
          {"notes", report.notes},
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
  for (const std::string& note : report->notes) console.say("note: " + note);
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

Result<int> rest(const Options& o, Console& console) {
  const auto files = addRestPictures(
      o.session, o.pictures.empty() ? fs::path(o.session) / kRestFolder : fs::path(o.pictures));
  if (!files) return files.error();
  console.answer["files"] = nlohmann::json::array();
  for (const FrameFile& file : *files) {
    console.answer["files"].push_back({{"name", file.name}, {"sha256", file.sha256}});
    console.say(file.name + "  " + file.sha256);
  }
  return kDone;
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
  static const std::array kRows = {
      Verb{"info", "What a session holds",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSession, info); }},
      Verb{"verify", "Check every record and image; exit 3 if any is damaged",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSession, verify); }},
      Verb{"repair", "Cut a torn tail off, keep it beside, and say what it was",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareSession, repair); }},
      Verb{"rest", "Put pictures of the sample at rest into a session and their hashes on record",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareRest, rest); }},
      sessionReplay(),
      sessionForces(),
      Verb{"export", "Write a session for other programs",
           [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declareExport, exportTo); }}};
  return {"session", "Recorded sessions", [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
