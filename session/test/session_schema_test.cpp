// SPDX-License-Identifier: GPL-3.0-or-later
// What is written, what the documents say of it, and what the reader in Python makes of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "journal_line.h"
#include "record_codec.h"
#include "session_samples.h"
#include "tenter/session/rest_pictures.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using session_samples::header;
using session_samples::readAll;
using session_samples::writeSession;
using test_support::schemaErrors;
using test_support::slurp;
using test_support::sourceFolder;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const fs::path kFormats = sourceFolder() / "docs/formats";
const fs::path kHeaderSchema = kFormats / "session.schema.json";
const fs::path kRecordSchema = kFormats / "journal-record.schema.json";

TEST(SessionSchemaTest, WrittenSessionsAreValid) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  // Opened again, so that there is a "resumed" record too.
  folder.write("s/journal.jsonl", slurp(folder / "s/journal.jsonl") + "torn");
  ASSERT_TRUE(SessionWriter::repair(folder / "s").ok());
  folder.write("snap/left.png", "picture");
  ASSERT_TRUE(addRestPictures(folder / "s", folder / "snap").ok());
  EXPECT_THAT(schemaErrors(json::parse(slurp(folder / "s/session.json")), kHeaderSchema),
              IsEmpty());
  for (const JournalRecord& record : readAll(folder / "s")) {
    EXPECT_THAT(schemaErrors(json::parse(record.text), kRecordSchema), IsEmpty()) << record.text;
  }
}

TEST(SessionSchemaTest, SeesWhatIsWrong) {
  const json good = json::parse(sessionHeaderJson(header()).value());
  for (const auto& [field, value] : good.items()) {
    json damaged = good;
    damaged[field] = {{"not", "this"}};
    if (field != "calibration_ids") {
      EXPECT_THAT(schemaErrors(damaged, kHeaderSchema), Not(IsEmpty())) << field;
    }
  }
  for (const char* record : {R"({"seq":1,"time_ns":2})", R"({"seq":1,"time_ns":2,"kind":"sample"})",
                             R"({"seq":-1,"time_ns":2,"kind":"trace","data":{}})",
                             R"({"seq":1,"time_ns":2,"kind":"event","event":"party","data":{}})",
                             R"({"seq":1,"time_ns":2,"kind":"frame","frame":0,"files":[]})",
                             R"({"seq":1,"time_ns":2,"kind":"rest","data":{}})",
                             R"({"seq":1,"time_ns":2,"kind":"rest","data":{"files":[]}})",
                             R"({"seq":1,"time_ns":2,"kind":"trace","data":7})"}) {
    EXPECT_THAT(schemaErrors(json::parse(record), kRecordSchema), Not(IsEmpty())) << record;
  }
}

TEST(SessionFormatPageTest, ItsExampleIsALineOfAJournal) {
  std::istringstream page(slurp(kFormats / "session.md"));
  int examples = 0;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("{\"seq\":")) continue;
    ++examples;
    const auto record = unsealed(line);
    ASSERT_TRUE(record.has_value()) << line;
    EXPECT_TRUE(decodeRecord(std::string(*record), header(), "", "").ok()) << line;
  }
  EXPECT_EQ(examples, 1);
}

/// Output of the reader in Python.
std::string readWithPython(const fs::path& session) {
  const fs::path script = kFormats / "python/read_session.py";
  const std::string command = "PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -I -S '" +
                              script.string() + "' '" + session.string() + "' 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return "cannot start";
  std::string output;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) output += static_cast<char>(c);
  if (const int status = pclose(pipe); status != 0) output += "exit " + std::to_string(status);
  return output;
}

TEST(SessionPythonTest, TheReaderSeesTheSameNumbers) {
  if (!fs::exists("/usr/bin/python3")) GTEST_SKIP() << "/usr/bin/python3 is not installed";
  const TemporaryFolder folder;
  writeSession(folder / "s");
  folder.write("s/journal.jsonl", slurp(folder / "s/journal.jsonl") + "torn");
  std::istringstream in(readWithPython(folder / "s"));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "knit-12, stretch-weft: 33 records, 4 bytes cut");
  for (int i = 0; i < 20; ++i) {
    const SampleRecord expected = session_samples::sample(header(), i);
    std::int64_t time_ns = -1;
    std::string position[2], tension[2], status[2];
    in >> time_ns >> position[0] >> position[1] >> tension[0] >> tension[1] >> status[0] >>
        status[1];
    EXPECT_EQ(time_ns, session_samples::timeOf(i));
    EXPECT_EQ(std::strtod(position[1].c_str(), nullptr), *expected.positions_m[1]);
    EXPECT_EQ(std::strtod(tension[0].c_str(), nullptr), *expected.tensions[0].tension_N);
    EXPECT_EQ(status[1], "ok");
  }
}

TEST(SessionPythonTest, TheReaderSeesDamage) {
  if (!fs::exists("/usr/bin/python3")) GTEST_SKIP() << "/usr/bin/python3 is not installed";
  const TemporaryFolder folder;
  writeSession(folder / "s");
  folder.write("snap/left.png", "picture");
  ASSERT_TRUE(addRestPictures(folder / "s", folder / "snap").ok());
  EXPECT_THAT(readWithPython(folder / "s"), Not(HasSubstr("problem")));
  folder.write("s/rest/left.png", "altered");
  std::string journal = slurp(folder / "s/journal.jsonl");
  journal[journal.find("\"seq\":4") + 2] ^= 1;
  folder.write("s/journal.jsonl", journal);
  folder.write("s/frames/000000-left.png", "other");
  const std::string output = readWithPython(folder / "s");
  EXPECT_THAT(output, HasSubstr("34 records, 0 bytes cut"));
  EXPECT_THAT(output, HasSubstr("problem: rest/left.png: has another SHA-256"));
  EXPECT_THAT(output, HasSubstr("problem: line 5: its CRC does not fit"));
  EXPECT_THAT(output, HasSubstr("problem: frames/000000-left.png: has another SHA-256"));
}

}  // namespace
}  // namespace tenter
