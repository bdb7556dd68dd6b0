// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "measurement_samples.h"
#include "tenter/test_support/data.h"
#include "tenter/test_support/json_schema.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test_support::schemaErrors;
using test_support::slurp;
using test_support::sourceFolder;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const fs::path kFormats = sourceFolder() / "docs/formats";

std::vector<json> framesOf(const fs::path& measurement) {
  std::istringstream in(slurp(measurement / "frames.jsonl"));
  std::vector<json> frames;
  for (std::string line; std::getline(in, line);) frames.push_back(json::parse(line));
  return frames;
}

TEST(MeasurementSchemaTest, WrittenFoldersAreValid) {
  const TemporaryFolder folder;
  for (const Measurement& m :
       {samples::stretchTest(), samples::tensileTest(), samples::cantileverTest()}) {
    ASSERT_TRUE(writeMeasurement(folder / "m", m).ok());
    const json header = json::parse(slurp(folder / "m/measurement.json"));
    EXPECT_THAT(schemaErrors(header, kFormats / "measurement.schema.json"), IsEmpty());
    for (const json& frame : framesOf(folder / "m")) {
      EXPECT_THAT(schemaErrors(frame, kFormats / "frames.schema.json"), IsEmpty());
    }
  }
}

TEST(MeasurementSchemaTest, SeesWhatIsWrong) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeMeasurement(folder / "m", samples::stretchTest()).ok());
  const json header = json::parse(slurp(folder / "m/measurement.json"));
  const json frame = framesOf(folder / "m")[0];
  for (const char* field : {"format", "areal_density_kg_per_m2", "clips", "frame_count"}) {
    json damaged = header;
    damaged.erase(field);
    EXPECT_THAT(schemaErrors(damaged, kFormats / "measurement.schema.json"), Not(IsEmpty()))
        << field;
  }
  json damaged = frame;
  damaged["cords"][0]["tension_N"] = "strong";
  EXPECT_THAT(schemaErrors(damaged, kFormats / "frames.schema.json"), Not(IsEmpty()));
}

/// Output of a command, with its exit status.
std::pair<std::string, int> run(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {"cannot start", -1};
  std::string output;
  std::array<char, 4096> buffer{};
  while (fgets(buffer.data(), static_cast<int>(buffer.size()), pipe) != nullptr) {
    output += buffer.data();
  }
  return {output, pclose(pipe)};
}

TEST(MeasurementPythonTest, TheReaderSeesTheSameNumbers) {
  const std::string python = "/usr/bin/python3";
  if (run(python + " -c 'import numpy'").second != 0) {
    GTEST_SKIP() << python << " with numpy is not installed";
  }
  const TemporaryFolder folder;
  constexpr int kNodes = 60;  // Arrays of several compressed blocks.
  const Measurement m = samples::stretchTest(kNodes, 2);
  ASSERT_TRUE(writeMeasurement(folder / "m", m).ok());
  const fs::path script = kFormats / "python/read_measurement.py";
  const auto [output, status] = run("PYTHONDONTWRITEBYTECODE=1 " + python + " '" + script.string() +
                                    "' '" + (folder / "m").string() + "'");
  ASSERT_EQ(status, 0) << output;
  std::istringstream in(output);
  std::string first;
  std::getline(in, first);
  EXPECT_EQ(first, "test cloth, stretch-weft: 2 frames");
  // numpy sums in another order: 10,800 numbers below 0.11 differ by less than this.
  constexpr double kSummation = 1e-9;
  for (const MeasurementFrame& frame : m.frames) {
    std::int64_t time_ns = -1, valid = -1;
    double points = 0.0, sigma = 0.0;
    std::string cord, rest;
    in >> time_ns >> points >> sigma >> valid >> cord;
    std::getline(in, rest);
    EXPECT_EQ(time_ns, frame.time_ns);
    EXPECT_NEAR(points, frame.positions.sum(), kSummation);
    EXPECT_NEAR(sigma, frame.position_sigma_m.sum(), kSummation);
    EXPECT_EQ(valid, kNodes * kNodes - 1);
    EXPECT_EQ(std::strtod(cord.substr(cord.find('=') + 1).c_str(), nullptr),
              frame.cords[0].tension_N);
  }
}

}  // namespace
}  // namespace tenter
