// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/session/session_reader.h"
#include "tenter/session/session_writer.h"

/// Sessions as a rig would record them, small enough for tests.
namespace tenter::session_samples {

inline SessionHeader header(std::size_t actuators = 2, std::size_t cells = 2) {
  SessionHeader h;
  h.id = "20261124-knit-1";
  h.who = "Textile laboratory";
  h.operator_name = "Zoë";
  h.start_utc = "2026-11-24T20:49:49.5Z";
  h.fabric = "knit-12";
  h.specimen = "A";
  h.areal_density_kg_per_m2 = 0.21;
  h.protocol = "stretch-weft";
  h.protocol_text = "[[phase]]\nname = \"load\"\t# to 2 N\n";
  h.rig_configuration = "force_limit_N = 20.0\n";
  h.calibration_ids = {{"cells", "cells-2026-11-01"}, {"cords", "cords-2026-11-02"}};
  h.temperature_degC = 20.5;
  h.relative_humidity = 0.65;
  for (std::size_t i = 0; i < actuators; ++i) h.actuators.push_back("axis-" + std::to_string(i));
  for (std::size_t i = 0; i < cells; ++i) h.cells.push_back("cell-" + std::to_string(i));
  return h;
}

/// Sample number `i` of a rig with as many channels as the header; 200 a second.
inline SampleRecord sample(const SessionHeader& h, int i) {
  SampleRecord record;
  for (std::size_t a = 0; a < h.actuators.size(); ++a) {
    record.positions_m.emplace_back(1e-5 * i + 0.001 * static_cast<double>(a));
  }
  for (std::size_t c = 0; c < h.cells.size(); ++c) {
    record.tensions.push_back(
        {0.1 * i / 3.0 + static_cast<double>(c), TensionStatus::kOk, 1'000'000});
  }
  return record;
}

inline std::int64_t timeOf(int i) { return i * std::int64_t{5'000'000}; }

/// A record of every kind but frames, which need their images.
inline std::vector<RecordBody> everyBody(const SessionHeader& h) {
  SampleRecord partial = sample(h, 7);
  partial.positions_m.back() = std::nullopt;
  partial.tensions.back() = {std::nullopt, TensionStatus::kMissing, 0};
  return {sample(h, 6),
          partial,
          PhaseRecord{1, 2, "unload \"slowly\"", false},
          OperatorEvent{"note", "tab\there, \xc3\xa9toffe, \"quoted\"\nsecond line"},
          StateChange{"Ready", "Running", "operator"},
          FaultEvent{"cell-1", "stale", "no answer for 40 ms"},
          Decision{"target", R"({ "axis" : 3,"v_m_per_s":1.50e-3, "why":"a } \" \u00e9"})"},
          SessionEvent{"note", "{}"},
          GenericRecord{"bus-trace", R"({"bytes":[1,2,3]})"}};
}

/// The images of frame `i`, of two cameras.
struct Images {
  explicit Images(int i) {
    for (const char* camera : {"left", "right"}) {
      contents.push_back(std::string("image of ") + camera + " " + std::to_string(i) +
                         std::string(100, '\0'));
    }
    list = {{"left", "png", contents[0]}, {"right", "png", contents[1]}};
  }
  std::vector<std::string> contents;
  std::vector<FrameImage> list;
};

/// All records of a session; throws std::logic_error with the message where reading fails.
inline std::vector<JournalRecord> readAll(const std::filesystem::path& folder) {
  std::vector<JournalRecord> records;
  const auto reader = std::move(SessionReader::open(folder)).value();
  while (auto record = std::move(reader->next()).value()) records.push_back(std::move(*record));
  return records;
}

/// A closed session: begin, `samples` samples, two frames, one record of every other kind, closed.
inline void writeSession(const std::filesystem::path& folder, int samples = 20) {
  const SessionHeader h = header();
  const auto writer = std::move(SessionWriter::create(folder, h)).value();
  for (int i = 0; i < samples; ++i) writer->append(timeOf(i), sample(h, i)).value();
  for (int i = 0; i < 2; ++i) writer->addFrame(timeOf(samples), Images(i).list).value();
  for (const RecordBody& body : everyBody(h)) {
    writer->append(timeOf(samples), body, Commit::kGroup).value();
  }
  if (auto done = writer->close(timeOf(samples)); !done) {
    throw std::logic_error(done.error().message());
  }
}

}  // namespace tenter::session_samples
