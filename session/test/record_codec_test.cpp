// SPDX-License-Identifier: GPL-3.0-or-later
#include "record_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "raw_json.h"
#include "record_kinds.h"
#include "session_samples.h"

namespace tenter {
namespace {

using testing::HasSubstr;

const SessionHeader kHeader = session_samples::header();

std::string encoded(const RecordBody& body) {
  return withSequence(12, encodeRecord(34, body, kHeader).value());
}

Result<JournalRecord> decoded(const std::string& text) {
  return decodeRecord(text, kHeader, "journal.jsonl", "line 5");
}

TEST(RecordCodecTest, EveryKindComesBackByteForByte) {
  for (const RecordBody& body : session_samples::everyBody(kHeader)) {
    const std::string text = encoded(body);
    const auto record = decoded(text);
    ASSERT_TRUE(record.ok()) << record.error().message();
    EXPECT_EQ(record->sequence, 12u);
    EXPECT_EQ(record->time_ns, 34);
    EXPECT_EQ(record->body.index(), body.index()) << text;
    // A record that reads as something else would be written as something else.
    EXPECT_EQ(encoded(record->body), text);
    EXPECT_EQ(text.find('\n'), std::string::npos);
    EXPECT_EQ(text.find('\t'), std::string::npos);
  }
}

TEST(RecordCodecTest, FramesComeBack) {
  const FrameRecord frame{3, {{"frames/000003-left.png", std::string(64, 'a'), 17}}};
  const auto record = decoded(encoded(frame));
  ASSERT_TRUE(record.ok()) << record.error().message();
  const auto& back = std::get<FrameRecord>(record->body);
  EXPECT_EQ(back.frame, 3);
  ASSERT_EQ(back.files.size(), 1u);
  EXPECT_EQ(back.files[0].name, frame.files[0].name);
  EXPECT_EQ(back.files[0].sha256, frame.files[0].sha256);
  EXPECT_EQ(back.files[0].size_bytes, 17u);
}

TEST(RecordCodecTest, NumbersSurviveToTheLastBit) {
  SampleRecord sample = session_samples::sample(kHeader, 1);
  for (const double value : {0.1, 1.0 / 3.0, -0.0, 5e-324, 1.7976931348623157e308, 123456789.0}) {
    sample.positions_m[0] = value;
    const auto record = decoded(encoded(sample));
    ASSERT_TRUE(record.ok()) << record.error().message();
    EXPECT_EQ(*std::get<SampleRecord>(record->body).positions_m[0], value);
  }
}

TEST(RecordCodecTest, WhatIsNotANumberIsNull) {
  SampleRecord sample = session_samples::sample(kHeader, 1);
  sample.positions_m[1] = std::numeric_limits<double>::infinity();
  sample.tensions[0] = {std::nan(""), TensionStatus::kFault, 5};
  const auto record = decoded(encoded(sample));
  ASSERT_TRUE(record.ok()) << record.error().message();
  const auto& back = std::get<SampleRecord>(record->body);
  EXPECT_FALSE(back.positions_m[1].has_value());
  EXPECT_FALSE(back.tensions[0].tension_N.has_value());
  EXPECT_EQ(back.tensions[0].status, TensionStatus::kFault);
  EXPECT_EQ(back.tensions[0].age_ns, 5);
}

TEST(RecordCodecTest, TextThatIsNotUtf8IsReplacedNotRefused) {
  // What a device says in its trouble must not keep the fault from the journal.
  const auto record = decoded(encoded(FaultEvent{"cell-1", "garbled", "\xff\xfe"}));
  ASSERT_TRUE(record.ok()) << record.error().message();
  EXPECT_EQ(std::get<FaultEvent>(record->body).text, "\xef\xbf\xbd\xef\xbf\xbd");
}

TEST(RecordCodecTest, RefusesToWriteWhatItCouldNotRead) {
  SampleRecord nan_but_ok = session_samples::sample(kHeader, 1);
  nan_but_ok.tensions[1].tension_N = std::nan("");
  SampleRecord short_sample = session_samples::sample(kHeader, 1);
  short_sample.positions_m.pop_back();
  SampleRecord negative_age = session_samples::sample(kHeader, 1);
  negative_age.tensions[0].age_ns = -1;
  const std::vector<RecordBody> bodies = {
      nan_but_ok,
      short_sample,
      negative_age,
      PhaseRecord{-1, 0, "load", true},
      Decision{"d", "not json"},
      Decision{"d", "[1]"},
      Decision{"d", "{\n}"},
      Decision{"d", "{\"text\":\"\xff\"}"},
      Decision{"d", "{} {}"},
      Decision{std::string(201, 'x'), "{}"},
      GenericRecord{"event", "{}"},
      GenericRecord{"sample", "{}"},
      GenericRecord{"Upper", "{}"},
      GenericRecord{"", "{}"},
      OperatorEvent{"note", std::string(5000, 'x')},
      FrameRecord{0, {{"../../etc/passwd", std::string(64, 'a'), 1}}},
  };
  for (const RecordBody& body : bodies) {
    EXPECT_FALSE(encodeRecord(0, body, kHeader).ok()) << encodeRecord(0, body, kHeader).value();
  }
  EXPECT_FALSE(encodeRecord(-1, Decision{"d", "{}"}, kHeader).ok());
}

TEST(RecordCodecTest, RefusesLinesThatCannotBe) {
  const std::string head = R"({"seq":1,"time_ns":2,"kind":)";
  const std::string file =
      R"({"name":"frames/000000-a.png","sha256":")" + std::string(64, 'a') + R"(","size_bytes":1})";
  const std::vector<std::pair<std::string, const char*>> lines = {
      {"", "JSON"},
      {"[]", "object"},
      {"{}", "seq"},
      {R"({"seq":-1,"time_ns":2,"kind":"phase"})", "seq"},
      {R"({"seq":1.5,"time_ns":2,"kind":"phase"})", "seq"},
      {R"({"seq":1,"time_ns":-2,"kind":"phase"})", "time_ns"},
      {R"({"seq":1,"time_ns":1e300,"kind":"phase"})", "time_ns"},
      {head + R"("Weird"})", "kind"},
      {head + R"("event"})", "event"},
      {head + R"("event","event":"party"})", "event"},
      {head + R"("bus-trace"})", "data"},
      {head + R"("bus-trace","data":3})", "data"},
      {head + R"("bus-trace","d\u0061ta":{}})", "data"},
      {head +
           R"("sample","positions_m":[1],"tensions_N":[1,2],"status":["ok","ok"],"age_ns":[0,0]})",
       "positions_m"},
      {head +
           R"("sample","positions_m":[1,"x"],"tensions_N":[1,2],"status":["ok","ok"],"age_ns":[0,0]})",
       "positions_m[1]"},
      {head +
           R"("sample","positions_m":[1,2],"tensions_N":[1,null],"status":["ok","ok"],"age_ns":[0,0]})",
       "tensions_N[1]"},
      {head + R"("sample","positions_m":[1,2],"tensions_N":[1,2],"status":["ok"],"age_ns":[0,0]})",
       "status"},
      {head +
           R"("sample","positions_m":[1,2],"tensions_N":[1,2],"status":["ok","fine"],"age_ns":[0,0]})",
       "status[1]"},
      {head +
           R"("sample","positions_m":[1,2],"tensions_N":[1,2],"status":["ok","ok"],"age_ns":[0,null]})",
       "age_ns[1]"},
      {head +
           R"("sample","positions_m":[1,2],"tensions_N":[1,2],"status":["ok","ok"],"age_ns":[0,-1]})",
       "age_ns[1]"},
      {head + R"("frame","frame":0,"files":[]})", "files"},
      {head + R"("frame","frame":0,"files":[{"name":"frames/../x","sha256":"","size_bytes":1}]})",
       "files[0].name"},
      {head +
           R"("frame","frame":0,"files":[{"name":"frames/000000-a.png","sha256":"q","size_bytes":1}]})",
       "files[0].sha256"},
      {head + R"("frame","frame":-1,"files":[)" + file + "]}", "frame"},
      {head + R"("phase","edge":"middle","index":0,"cycle":0,"name":""})", "edge"},
  };
  for (const auto& [line, place] : lines) {
    const auto record = decoded(line);
    ASSERT_FALSE(record.ok()) << line;
    EXPECT_THAT(record.error().message(), HasSubstr("journal.jsonl: line 5")) << line;
    EXPECT_THAT(record.error().message(), HasSubstr(place)) << line;
  }
  EXPECT_TRUE(decoded(head + R"("frame","frame":0,"files":[)" + file + "]}").ok());
}

TEST(RecordCodecTest, KeysThatAreNotKnownAreSkipped) {
  const auto record =
      decoded(R"({"new":[1,{"data":0}],"kind":"event","event":"decision","time_ns":2,"name":"n",)"
              R"("data" : { "a" : "}" } ,"seq":1})");
  ASSERT_TRUE(record.ok()) << record.error().message();
  EXPECT_EQ(std::get<Decision>(record->body).data, R"({ "a" : "}" })");
}

TEST(RawMemberTest, GivesTheBytesOfAValue) {
  EXPECT_EQ(rawMember(R"({"a":1,"b": [ 1 , "]" ] ,"c":"x"})", "b"), R"([ 1 , "]" ])");
  EXPECT_EQ(rawMember(R"({"a":{"b":1},"b":2})", "b"), "2");
  EXPECT_EQ(rawMember(R"({"a":"\"b\":3","b":-1e3})", "b"), "-1e3");
  EXPECT_EQ(rawMember(R"({"a":1})", "b"), "");
  EXPECT_EQ(rawMember("{}", "b"), "");
}

TEST(RecordKindTest, EventsAreWhatReplaysCompare) {
  EXPECT_TRUE(isEvent(Decision{}));
  EXPECT_TRUE(isEvent(StateChange{}));
  EXPECT_FALSE(isEvent(SampleRecord{}));
  EXPECT_FALSE(isEvent(PhaseRecord{}));
  EXPECT_FALSE(isEvent(GenericRecord{"event-like", "{}"}));
}

}  // namespace
}  // namespace tenter
