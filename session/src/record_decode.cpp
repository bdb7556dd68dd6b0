// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>

#include "raw_json.h"
#include "record_codec.h"
#include "record_kinds.h"
#include "session_format.h"
#include "tenter/core/json_reader.h"

namespace tenter {

namespace format = session_format;
using Json = nlohmann::json;

namespace {

/// What a decoder has: the fields, the text they came from, and what the session promised.
struct Source {
  JsonReader& in;
  const std::string& text;
  const SessionHeader& header;
};

constexpr std::array<std::string_view, 5> kStatusNames = {"ok", "stale", "over-range", "fault",
                                                          "missing"};

TensionStatus statusNamed(const std::string& name, const std::string& key, JsonReader& in) {
  const auto found = std::find(kStatusNames.begin(), kStatusNames.end(), name);
  if (found == kStatusNames.end()) in.fail(key, "is no status of a tension");
  return static_cast<TensionStatus>(found == kStatusNames.end() ? 0 : found - kStatusNames.begin());
}

std::string item(const std::string& key, std::size_t i) {
  return key + "[" + std::to_string(i) + "]";
}

/// A list of finite numbers and nulls.
std::vector<std::optional<double>> optionalNumbers(JsonReader& in, const std::string& key,
                                                   std::size_t size) {
  std::vector<std::optional<double>> values(size);
  const std::size_t found = in.arraySize(key);
  if (in.ok() && found != size) {
    in.fail(key, "has " + std::to_string(found) + " items instead of " + std::to_string(size));
  }
  if (!in.ok()) return values;
  const Json& list = in.json().at(key);
  for (std::size_t i = 0; i < size; ++i) {
    if (list[i].is_number()) values[i] = list[i].get<double>();
    if (!list[i].is_number() && !list[i].is_null()) {
      in.fail(item(key, i), "must be a number or null");
    }
  }
  return values;
}

RecordBody decodeSample(const Source& source) {
  JsonReader& in = source.in;
  SampleRecord sample;
  const std::size_t cells = source.header.cells.size();
  sample.positions_m = optionalNumbers(in, "positions_m", source.header.actuators.size());
  const auto tensions = optionalNumbers(in, "tensions_N", cells);
  const std::vector<std::string> status = in.texts("status");
  const auto ages = optionalNumbers(in, "age_ns", cells);
  if (in.ok() && status.size() != cells) in.fail("status", "has another size than tensions_N");
  if (!in.ok()) return sample;
  sample.tensions.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    TensionReading& reading = sample.tensions[i];
    reading.tension_N = tensions[i];
    reading.status = statusNamed(status[i], item("status", i), in);
    const Json& age = in.json().at("age_ns")[i];
    if (!age.is_number_integer() || *ages[i] < 0 ||
        *ages[i] > static_cast<double>(format::kMaxInteger)) {
      in.fail(item("age_ns", i), "must be a whole number that is not negative");
      return sample;
    }
    reading.age_ns = age.get<std::int64_t>();
    if (reading.status == TensionStatus::kOk && !reading.tension_N) {
      in.fail(item("tensions_N", i), "is null though its status is ok");
    }
  }
  return sample;
}

bool isSha256(const std::string& text) {
  return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

RecordBody decodeFrame(const Source& source) {
  JsonReader& in = source.in;
  FrameRecord frame;
  frame.frame = in.integer("frame", 0, format::kMaxInteger);
  const std::size_t files = in.arraySize("files");
  if (in.ok() && (files == 0 || files > format::kMaxFrameFiles)) {
    in.fail("files", "must have 1 to " + std::to_string(format::kMaxFrameFiles) + " items");
  }
  for (std::size_t i = 0; i < files && in.ok(); ++i) {
    JsonReader file_in = in.element("files", i);
    FrameFile file;
    file.name = file_in.text("name", format::kMaxName);
    file.sha256 = file_in.text("sha256", format::kMaxName);
    file.size_bytes =
        static_cast<std::uint64_t>(file_in.integer("size_bytes", 0, format::kMaxInteger));
    if (!format::isFrameFileName(file.name)) file_in.fail("name", "is no name of a frame's file");
    if (!isSha256(file.sha256)) file_in.fail("sha256", "is no SHA-256");
    frame.files.push_back(std::move(file));
  }
  return frame;
}

RecordBody decodePhase(const Source& source) {
  JsonReader& in = source.in;
  PhaseRecord phase;
  const std::string edge = in.text("edge", format::kMaxName);
  if (edge != "begin" && edge != "end") in.fail("edge", "must be \"begin\" or \"end\"");
  phase.begins = edge == "begin";
  phase.index = in.integer("index", 0, format::kMaxInteger);
  phase.cycle = in.integer("cycle", 0, format::kMaxInteger);
  phase.name = in.text("name", format::kMaxName);
  return phase;
}

RecordBody decodeOperator(const Source& source) {
  return OperatorEvent{source.in.text("action", format::kMaxName),
                       source.in.text("text", format::kMaxText)};
}

RecordBody decodeState(const Source& source) {
  return StateChange{source.in.text("from", format::kMaxName),
                     source.in.text("to", format::kMaxName),
                     source.in.text("reason", format::kMaxText)};
}

RecordBody decodeFault(const Source& source) {
  return FaultEvent{source.in.text("source", format::kMaxName),
                    source.in.text("fault", format::kMaxName),
                    source.in.text("text", format::kMaxText)};
}

/// The raw text of the object "data".
std::string dataOf(const Source& source) {
  source.in.object("data");
  const std::string_view raw = rawMember(source.text, "data");
  if (raw.empty()) source.in.fail("data", "is missing or its name has escapes");
  return std::string(raw);
}

RecordBody decodeDecision(const Source& source) {
  return Decision{source.in.text("name", format::kMaxName), dataOf(source)};
}

RecordBody decodeSession(const Source& source) {
  return SessionEvent{source.in.text("what", format::kMaxName), dataOf(source)};
}

/// A kind of record: how it is called and read. How it is written is its overload in
/// record_encode.cpp.
struct Row {
  RecordKind kind;
  RecordBody (*decode)(const Source&);
};

/// In the order of RecordBody's alternatives; the generic record comes after them.
constexpr std::array<Row, 8> kRows = {{{{"sample", ""}, decodeSample},
                                       {{"frame", ""}, decodeFrame},
                                       {{"phase", ""}, decodePhase},
                                       {{"event", "operator"}, decodeOperator},
                                       {{"event", "state"}, decodeState},
                                       {{"event", "fault"}, decodeFault},
                                       {{"event", "decision"}, decodeDecision},
                                       {{"event", "session"}, decodeSession}}};
static_assert(kRows.size() + 1 == std::variant_size_v<RecordBody>);

RecordBody decodeBody(const std::string& kind, const Source& source) {
  const std::string event = kind == "event" ? source.in.text("event", format::kMaxName) : "";
  for (const Row& row : kRows) {
    if (row.kind.kind == kind && row.kind.event == event) return row.decode(source);
  }
  if (!isGenericKind(kind)) {
    source.in.fail(event.empty() ? "kind" : "event", "is no kind of record");
    return GenericRecord{};
  }
  return GenericRecord{kind, dataOf(source)};
}

}  // namespace

std::string_view nameOf(TensionStatus status) {
  return kStatusNames.at(static_cast<std::size_t>(status));
}

RecordKind kindOf(const RecordBody& body) {
  if (const auto* generic = std::get_if<GenericRecord>(&body)) return {generic->kind, ""};
  return kRows.at(body.index()).kind;
}

bool isGenericKind(std::string_view kind) {
  if (kind.empty() || kind.size() > 64) return false;
  const bool spelled = std::all_of(kind.begin(), kind.end(),
                                   [](char c) { return format::isLowerOrDigit(c) || c == '-'; });
  return spelled && std::none_of(kRows.begin(), kRows.end(),
                                 [&](const Row& row) { return row.kind.kind == kind; });
}

bool isEvent(const RecordBody& body) { return kindOf(body).kind == "event"; }

Result<JournalRecord> decodeRecord(std::string text, const SessionHeader& header,
                                   const std::string& file, const std::string& place) {
  const auto document = parseJson(text, file, place);
  if (!document) return document.error();
  JournalRecord record;
  record.text = std::move(text);
  JsonReader in(*document, file, place);
  record.sequence = static_cast<std::uint64_t>(in.integer("seq", 0, format::kMaxInteger));
  record.time_ns = in.integer("time_ns", 0, format::kMaxInteger);
  const std::string kind = in.text("kind", format::kMaxName);
  if (in.ok()) record.body = decodeBody(kind, {in, record.text, header});
  if (!in.ok()) return in.error();
  return record;
}

}  // namespace tenter
