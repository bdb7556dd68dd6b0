// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "raw_json.h"
#include "record_codec.h"
#include "record_kinds.h"
#include "session_format.h"

namespace tenter {

namespace format = session_format;

namespace {

/// Appends "key":value pairs. Written by hand: samples come 200 times a second, and the order of
/// keys and the digits of numbers are part of the format.
class Fields {
 public:
  explicit Fields(std::string& out) : out_(out) {}

  void text(std::string_view key, const std::string& value) {
    name(key);
    quote(value);
  }
  void raw(std::string_view key, std::string_view json) {
    name(key);
    out_ += json;
  }
  void integer(std::string_view key, std::int64_t value) {
    name(key);
    put(value);
  }
  /// `put_item(i)` appends the item i.
  template <class PutItem>
  void list(std::string_view key, std::size_t size, PutItem put_item) {
    name(key);
    out_ += '[';
    for (std::size_t i = 0; i < size; ++i) {
      if (i > 0) out_ += ',';
      put_item(i);
    }
    out_ += ']';
  }
  void put(std::int64_t value) { putDigits(value); }
  /// The shortest digits that read back as the same double.
  void put(const std::optional<double>& value) {
    if (value && std::isfinite(*value)) {
      putDigits(*value);
    } else {
      out_ += "null";
    }
  }
  void quote(std::string_view value) {
    const auto replace = nlohmann::json::error_handler_t::replace;
    out_ += nlohmann::json(value).dump(-1, ' ', false, replace);
  }

 private:
  void name(std::string_view key) {
    if (!out_.empty() && out_.back() != '{') out_ += ',';
    out_ += '"';
    out_ += key;
    out_ += "\":";
  }
  template <class Number>
  void putDigits(Number value) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    out_.append(digits.data(), end);
  }
  std::string& out_;
};

Error refused(const std::string& field, const std::string& reason) {
  return badInput("", field, reason);
}

Result<void> checkText(const std::string& field, const std::string& value, std::size_t limit) {
  if (value.size() <= limit) return {};
  return refused(field, "is longer than " + std::to_string(limit) + " characters");
}

Result<void> checkData(const std::string& data) {
  if (isJsonObjectOnOneLine(data)) return {};
  return refused("data", "is not a JSON object on one line");
}

std::string place(const char* list, std::size_t i) {
  return std::string(list) + "[" + std::to_string(i) + "]";
}

Result<void> checkSample(const SampleRecord& sample, const SessionHeader& header) {
  if (sample.positions_m.size() != header.actuators.size()) {
    return refused("positions_m", "has another size than the session's actuators");
  }
  if (sample.tensions.size() != header.cells.size()) {
    return refused("tensions_N", "has another size than the session's cells");
  }
  for (std::size_t i = 0; i < sample.tensions.size(); ++i) {
    const TensionReading& reading = sample.tensions[i];
    const bool has_number = reading.tension_N && std::isfinite(*reading.tension_N);
    if (reading.status == TensionStatus::kOk && !has_number) {
      return refused(place("tensions_N", i), "is ok but no finite number");
    }
    if (reading.age_ns < 0 || reading.age_ns > format::kMaxInteger) {
      return refused(place("age_ns", i), "must lie between 0 and 2^53");
    }
  }
  return {};
}

Result<void> encode(Fields& out, const SampleRecord& sample, const SessionHeader& header) {
  if (auto done = checkSample(sample, header); !done) return done;
  const auto& tensions = sample.tensions;
  out.list("positions_m", sample.positions_m.size(),
           [&](std::size_t i) { out.put(sample.positions_m[i]); });
  out.list("tensions_N", tensions.size(), [&](std::size_t i) { out.put(tensions[i].tension_N); });
  out.list("status", tensions.size(),
           [&](std::size_t i) { out.quote(nameOf(tensions[i].status)); });
  out.list("age_ns", tensions.size(), [&](std::size_t i) { out.put(tensions[i].age_ns); });
  return {};
}

Result<void> encode(Fields& out, const FrameRecord& frame, const SessionHeader& /*header*/) {
  out.integer("frame", frame.frame);
  std::string files;
  for (const FrameFile& file : frame.files) {
    if (!format::isFrameFileName(file.name)) return refused("files", "no name of a frame's file");
    files += files.empty() ? "{" : ",{";
    Fields item(files);
    item.text("name", file.name);
    item.text("sha256", file.sha256);
    item.integer("size_bytes", static_cast<std::int64_t>(file.size_bytes));
    files += '}';
  }
  out.raw("files", "[" + files + "]");
  return {};
}

Result<void> encode(Fields& out, const PhaseRecord& phase, const SessionHeader& /*header*/) {
  if (phase.index < 0 || phase.cycle < 0) return refused("index", "must not be negative");
  if (auto done = checkText("name", phase.name, format::kMaxName); !done) return done;
  out.text("edge", phase.begins ? "begin" : "end");
  out.integer("index", phase.index);
  out.integer("cycle", phase.cycle);
  out.text("name", phase.name);
  return {};
}

Result<void> encode(Fields& out, const OperatorEvent& event, const SessionHeader& /*header*/) {
  if (auto done = checkText("action", event.action, format::kMaxName); !done) return done;
  if (auto done = checkText("text", event.text, format::kMaxText); !done) return done;
  out.text("action", event.action);
  out.text("text", event.text);
  return {};
}

Result<void> encode(Fields& out, const StateChange& change, const SessionHeader& /*header*/) {
  if (auto done = checkText("from", change.from, format::kMaxName); !done) return done;
  if (auto done = checkText("to", change.to, format::kMaxName); !done) return done;
  if (auto done = checkText("reason", change.reason, format::kMaxText); !done) return done;
  out.text("from", change.from);
  out.text("to", change.to);
  out.text("reason", change.reason);
  return {};
}

Result<void> encode(Fields& out, const FaultEvent& event, const SessionHeader& /*header*/) {
  if (auto done = checkText("source", event.source, format::kMaxName); !done) return done;
  if (auto done = checkText("fault", event.fault, format::kMaxName); !done) return done;
  if (auto done = checkText("text", event.text, format::kMaxText); !done) return done;
  out.text("source", event.source);
  out.text("fault", event.fault);
  out.text("text", event.text);
  return {};
}

Result<void> encode(Fields& out, const Decision& decision, const SessionHeader& /*header*/) {
  if (auto done = checkText("name", decision.name, format::kMaxName); !done) return done;
  if (auto done = checkData(decision.data); !done) return done;
  out.text("name", decision.name);
  out.raw("data", decision.data);
  return {};
}

Result<void> encode(Fields& out, const SessionEvent& event, const SessionHeader& /*header*/) {
  if (auto done = checkText("what", event.what, format::kMaxName); !done) return done;
  if (auto done = checkData(event.data); !done) return done;
  out.text("what", event.what);
  out.raw("data", event.data);
  return {};
}

Result<void> encode(Fields& out, const GenericRecord& record, const SessionHeader& /*header*/) {
  if (!isGenericKind(record.kind)) return refused("kind", "is taken or has other characters");
  if (auto done = checkData(record.data); !done) return done;
  out.raw("data", record.data);
  return {};
}

}  // namespace

Result<std::string> encodeRecord(std::int64_t time_ns, const RecordBody& body,
                                 const SessionHeader& header) {
  if (time_ns < 0 || time_ns > format::kMaxInteger) {
    return refused("time_ns", "must lie between 0 and 2^53");
  }
  std::string text;
  text.reserve(512);
  Fields out(text);
  out.integer("time_ns", time_ns);
  const RecordKind kind = kindOf(body);
  out.text("kind", std::string(kind.kind));
  if (!kind.event.empty()) out.text("event", std::string(kind.event));
  const auto done = std::visit([&](const auto& b) { return encode(out, b, header); }, body);
  if (!done) return done.error();
  text += '}';
  if (text.size() > format::kMaxLine_bytes - 64) return refused("", "is too long for one record");
  return text;
}

std::string withSequence(std::uint64_t sequence, std::string_view encoded) {
  std::string text = "{\"seq\":" + std::to_string(sequence) + ",";
  text += encoded;
  return text;
}

std::string_view withoutSequence(std::string_view text) {
  constexpr std::string_view kPrefix = "{\"seq\":";
  const std::size_t comma = text.find(',');
  if (!text.starts_with(kPrefix) || comma == std::string_view::npos) return text;
  return text.substr(comma + 1);
}

}  // namespace tenter
