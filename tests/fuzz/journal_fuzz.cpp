// SPDX-License-Identifier: GPL-3.0-or-later
// The reader of journals: any bytes are lines, good or bad, and what reads as a record writes as
// itself.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "fuzz_target.h"
#include "journal_line.h"
#include "record_codec.h"

namespace {

tenter::SessionHeader header() {
  tenter::SessionHeader h;
  h.actuators = {"a", "b"};
  h.cells = {"c"};
  return h;
}

void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// The lines of `bytes` follow each other without gaps and end where the bytes end.
void scan(std::string_view bytes) {
  std::size_t at = 0;
  tenter::JournalScanner scanner([&](char* buffer, std::size_t size) {
    const std::size_t count = std::min(size, bytes.size() - at);
    std::copy_n(bytes.data() + at, count, buffer);
    at += count;
    return tenter::Result<std::size_t>(count);
  });
  std::uint64_t end = 0;
  while (const auto line = scanner.next().value()) {
    require(line->offset_bytes == end, "lines touch");
    require(line->size_bytes > 0, "lines have a size");
    end += line->size_bytes;
  }
  require(end == bytes.size(), "no byte is left over");
}

/// A fuzzer does not guess CRCs, so records are also tried without.
void decode(std::string_view text) {
  static const tenter::SessionHeader kHeader = header();
  const auto record = tenter::decodeRecord(std::string(text), kHeader, "journal.jsonl", "line 1");
  if (!record) {
    require(!record.error().reason.empty(), "errors have a reason");
    return;
  }
  const auto encoded = tenter::encodeRecord(record->time_ns, record->body, kHeader);
  if (!encoded) return;  // Such as control characters between the keys of `data`.
  const std::string written = tenter::withSequence(record->sequence, *encoded);
  const auto again = tenter::decodeRecord(written, kHeader, "", "");
  require(again.ok(), "what was written can be read");
  require(tenter::encodeRecord(again->time_ns, again->body, kHeader).value() == *encoded,
          "and is written the same");
}

}  // namespace

std::vector<std::string> fuzzSeeds() {
  std::vector<std::string> seeds = {
      R"({"seq":1,"time_ns":5,"kind":"sample","positions_m":[0.1,null],"tensions_N":[1e-3],"status":["ok"],"age_ns":[0]})",
      R"({"seq":2,"time_ns":5,"kind":"frame","frame":0,"files":[{"name":"frames/000000-a.png","sha256":"e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855","size_bytes":0}]})",
      R"({"seq":3,"time_ns":5,"kind":"phase","edge":"end","index":1,"cycle":0,"name":"load"})",
      R"({"seq":4,"time_ns":5,"kind":"event","event":"state","from":"Ready","to":"Running","reason":"\u00e9"})",
      R"({"seq":5,"time_ns":5,"kind":"event","event":"decision","name":"d","data":{ "v":[1.50,"}"] }})",
      R"({"seq":6,"time_ns":5,"kind":"trace","data":{}})",
      ""};
  std::string journal;
  for (const std::string& record : seeds) tenter::appendSealed(journal, record);
  seeds.push_back(journal);
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  scan(bytes);
  decode(bytes);
  return 0;
}
