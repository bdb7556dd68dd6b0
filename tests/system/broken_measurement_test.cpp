// SPDX-License-Identifier: GPL-3.0-or-later
// A captured measurement, broken in one place at a time: a fit refuses it and says where.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <sstream>

#include "program.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test_support::slurp;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;

/// Breaks the measurement in the folder m.
using Break = std::function<void(const TemporaryFolder&)>;

Break content(const std::string& file, const std::string& text) {
  return [=](const TemporaryFolder& folder) { folder.write("m/" + file, text); };
}

Break edited(const std::string& file, const std::function<std::string(std::string)>& edit) {
  return [=](const TemporaryFolder& folder) {
    folder.write("m/" + file, edit(slurp(folder / ("m/" + file))));
  };
}

Break replaced(const std::string& file, const std::string& from, const std::string& to) {
  return edited(file,
                [=](std::string text) { return text.replace(text.find(from), from.size(), to); });
}

Break cut(const std::string& file) {
  return edited(file, [](const std::string& text) { return text.substr(0, text.size() / 2); });
}

Break removed(const std::string& file) {
  return [=](const TemporaryFolder& folder) { fs::remove(folder / ("m/" + file)); };
}

Break header(const std::string& pointer, const json& value) {
  return edited("measurement.json", [=](const std::string& text) {
    json all = json::parse(text);
    all.at(json::json_pointer(pointer)) = value;
    return all.dump();
  });
}

Break headerWithout(const std::string& key) {
  return edited("measurement.json", [=](const std::string& text) {
    json all = json::parse(text);
    all.erase(key);
    return all.dump();
  });
}

/// Changes one line of frames.jsonl, counted from 1.
Break frame(int number, const std::function<void(json&)>& change) {
  return edited("frames.jsonl", [=](const std::string& text) {
    std::istringstream in(text);
    std::string line, all;
    for (int i = 1; std::getline(in, line); ++i) {
      json row = json::parse(line);
      if (i == number) change(row);
      all += row.dump() + "\n";
    }
    return all;
  });
}

Break frame(int number, const std::string& pointer, const json& value) {
  return frame(number, [=](json& row) { row.at(json::json_pointer(pointer)) = value; });
}

/// A rest mesh in plain text: vertices on a square of 0.1 m, and what is to be wrong with it.
std::string rest(const std::string& points, const std::string& uv, const std::string& ids) {
  const auto count = [](const std::string& text, int per_item) {
    std::istringstream in(text);
    const auto words = std::distance(std::istream_iterator<std::string>(in), {});
    return std::to_string(words / per_item);
  };
  std::string offsets;
  for (int i = 1; i <= std::stoi(count(ids, 3)); ++i) offsets += std::to_string(3 * i) + " ";
  const std::string array = "<DataArray format=\"ascii\" type=\"";
  return "<VTKFile type=\"PolyData\" version=\"0.1\"><PolyData><Piece NumberOfPoints=\"" +
         count(points, 3) + "\" NumberOfPolys=\"" + count(ids, 3) + "\"><PointData>" +
         (uv.empty()
              ? ""
              : array + "Float64\" Name=\"uv\" NumberOfComponents=\"2\">" + uv + "</DataArray>") +
         "</PointData><Points>" + array + "Float64\" NumberOfComponents=\"3\">" + points +
         "</DataArray></Points><Polys>" + array + "Int64\" Name=\"connectivity\">" + ids +
         "</DataArray>" + array + "Int64\" Name=\"offsets\">" + offsets +
         "</DataArray></Polys></Piece></PolyData></VTKFile>";
}

const std::string kPoints = "0 0 0 0.1 0 0 0.1 0.1 0 0 0.1 0";
const std::string kUv = "0 0 0.1 0 0.1 0.1 0 0.1";
const std::string kIds = "0 1 2 0 2 3";

struct Broken {
  std::string name;
  Break damage;
  std::string file, place, reason;
};
void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.name; }

std::vector<Broken> brokenHeaders() {
  const std::string file = "measurement.json";
  const std::string density = "areal_density_kg_per_m2";
  return {
      {"header_empty", content(file, ""), file, "line 1", "too early"},
      {"header_cut", cut(file), file, "line", "too early"},
      {"header_binary",
       content(file, std::string("\x7f"
                                 "ELF\0\1\2",
                                 7)),
       file, "line 1", "JSON"},
      {"header_deep", content(file, std::string(100'000, '[')), file, "line 1", "deeply"},
      {"header_list", content(file, "[]"), file, "", "must be a JSON object"},
      {"header_key_twice", replaced(file, "\"fabric\":", "\"units\": \"SI\", \"fabric\":"), file,
       "units", "twice"},
      {"version_newer", header("/schema_version", 99), file, "schema_version", "newer"},
      {"units_other", header("/units", "mm"), file, "units", "SI"},
      {"density_missing", headerWithout(density), file, density, "missing"},
      {"density_text", header("/" + density, "0.31"), file, density, "number"},
      {"density_null", header("/" + density, nullptr), file, density, "null"},
      {"density_nan", replaced(file, "0.31", "NaN"), file, "line", "JSON"},
      {"density_infinity", replaced(file, "0.31", "Infinity"), file, "line", "JSON"},
      {"density_beyond_double", replaced(file, "0.31", "1e400"), file, density, "double"},
      {"density_negative", header("/" + density, -0.31), file, density, "between"},
      {"density_in_grams", header("/" + density, 61.6), file, density, "unit"},
      {"sample_in_mm", header("/sample_size_m/1", 100), file, "sample_size_m[1]", "unit"},
      {"thickness_in_mm", header("/thickness_m", 0.6), file, "thickness_m", "unit"},
      {"gravity_in_cm", header("/gravity_m_per_s2/2", -981), file, "gravity", "unit"},
      {"clip_mass_negative", header("/clips/1/mass_kg", -0.01), file, "clips[1].mass_kg",
       "between"},
      {"clip_twice", header("/clips/1/id", "top"), file, "clips[1].id", "twice"},
      {"frames_announced_too_few", header("/frame_count", 2), "frames.jsonl", "line 3",
       "more than"},
      {"frames_announced_too_many", header("/frame_count", 4), "frames.jsonl", "line 4", "missing"},
  };
}

std::vector<Broken> brokenFrames() {
  const std::string file = "frames.jsonl";
  return {
      {"frames_absent", removed(file), file, "", "read"},
      {"frames_empty", content(file, ""), file, "line 1", "missing"},
      {"frames_cut", cut(file), file, "line 2", "too early"},
      {"frame_number_twice", frame(2, "/mesh", "frames/000000.vtp"), file, "line 2: mesh",
       "000001"},
      {"frame_earlier", frame(1, "/time_ns", 9'000'000'000'000), file, "line 2: time_ns",
       "earlier"},
      {"time_negative", frame(1, "/time_ns", -1), file, "line 1: time_ns", "between"},
      {"time_fraction", frame(1, "/time_ns", 0.5), file, "line 1: time_ns", "whole"},
      {"clip_unknown", frame(1, "/clips/0/clip", "middle"), file, "line 1: clips[0].clip",
       "measurement.json"},
      {"clip_without_pose", frame(3, [](json& row) { row["clips"][0].erase("rotation"); }), file,
       "line 3: clips[0].rotation", "missing"},
      {"clip_mirrored", frame(1, "/clips/2/rotation", json::parse("[[1,0,0],[0,1,0],[0,0,-1]]")),
       file, "line 1: clips[2].rotation", "right-handed"},
      {"clip_in_mm", frame(1, "/clips/0/translation_m/0", 25), file, "clips[0].translation_m", "m"},
      {"clip_outside", frame(2, "/clips/1/outline_uv_m", json::parse("[[1,1],[1.1,1],[1.1,1.1]]")),
       file, "line 2: clips[1].outline_uv_m", "outside"},
      {"clip_crossed", frame(1, "/clips/1/outline_uv_m", json::parse("[[0,0],[1,1],[1,0],[0,1]]")),
       file, "clips[1].outline_uv_m", "convex"},
      {"vertex_beyond", frame(1, "/clips/0/clamped_vertices", {5, 100}), file,
       "clips[0].clamped_vertices[1]", "100"},
      {"vertex_held_twice", frame(1, "/clips/0/clamped_vertices", {10}), file, "clamped_vertices",
       "two clips"},
      {"cord_to_nowhere", frame(1, "/cords/0/clip", "middle"), file, "line 1: cords[0].clip",
       "middle"},
      {"cord_not_unit", frame(1, "/cords/3/direction", {2, 0, 0}), file, "cords[3].direction",
       "unit"},
      {"cord_without_direction", frame(1, "/cords/3/direction", {0, 0, 0}), file,
       "cords[3].direction", "unit"},
      {"cord_flat", frame(1, "/cords/3/direction", {1, 0}), file, "cords[3].direction",
       "2 numbers"},
      {"tension_in_mN", frame(1, "/cords/1/tension_N", 4300), file, "cords[1].tension_N",
       "newtons"},
      {"tension_pushes", frame(1, "/cords/1/tension_N", -5), file, "cords[1].tension_N", "between"},
      {"branch_other", frame(1, "/branch", "up"), file, "line 1: branch", "loading"},
  };
}

std::vector<Broken> brokenMeshes() {
  const std::string file = "rest.vtp", first = "frames/000000.vtp";
  const auto write = [&](const std::string& points, const std::string& uv, const std::string& ids) {
    return content(file, rest(points, uv, ids));
  };
  return {
      {"rest_absent", removed(file), file, "", "read"},
      {"rest_cut", cut(file), file, "VTP", "XML"},
      {"rest_binary", content(file, std::string(1000, '\xff')), file, "VTP", "XML"},
      {"rest_without_vertices", write("", "", ""), file, "Points", "no vertices"},
      {"rest_without_uv", write(kPoints, "", kIds), file, "uv", "missing"},
      {"rest_uv_in_mm", write(kPoints, "0 0 100 0 100 100 0 100", kIds), file, "extent of u",
       "metres"},
      {"rest_uv_folded", write(kPoints, "0 0 0.1 0 0.1 0.1 0.1 0", kIds), file, "triangle 1",
       "folded"},
      {"rest_in_mm", write("0 0 0 100 0 0 100 100 0 0 100 0", kUv, kIds), file, "lengths",
       "metres"},
      {"rest_vertex_twice", write(kPoints + " 0.1 0.1 0", kUv + " 0.1 0.1", "0 1 2 0 4 3"), file,
       "vertex 4", "merge"},
      {"rest_in_pieces",
       write(kPoints + " 0.3 0 0 0.4 0 0 0.4 0.1 0", kUv + " 0 0 0.1 0 0.1 0.1", kIds + " 4 5 6"),
       file, "vertex 4", "one piece"},
      {"rest_three_at_an_edge", write(kPoints + " 0 0 0.1", kUv + " 0.05 0.1", kIds + " 2 0 4"),
       file, "triangle 2", "third"},
      {"rest_sliver", write("0 0 0 0.1 0 0 0.05 0 0 0 0.1 0", kUv, kIds), file, "triangle 0",
       "no area"},
      {"rest_id", write(kPoints, kUv, "0 1 2 0 2 9"), file, "connectivity entry 5", "not have"},
      {"mesh_absent", removed(first), first, "", "read"},
      {"mesh_of_other_size", content(first, rest(kPoints, kUv, kIds)), first, "Points",
       "4 vertices"},
      {"mesh_cut", cut(first), first, "VTP", "XML"},
  };
}

class BrokenMeasurementTest : public ::testing::TestWithParam<Broken> {
 public:
  static void SetUpTestSuite() {
    sample_ = std::make_unique<TemporaryFolder>();
    const Outcome captured =
        tenter({"twin", "capture", "--fabric", "knit-12", "--protocol", "shear", "--measurement",
                "-o", "m", "--nodes", "15", "--frames", "3", "--tracked", "10", "--noise", "off"},
               sample_->path());
    ASSERT_EQ(captured.exit_code, 0) << captured.err;
    // What is broken below must be sound before, or nothing would be tested.
    const Outcome fit =
        tenter({"fit", "m", "--variant", "linear", "--nodes", "9", "--max-iterations", "1",
                "--no-law-uncertainty", "-o", "sound.json"},
               sample_->path());
    ASSERT_TRUE(fit.exit_code == 0 || fit.exit_code == 5) << fit.err;
  }
  static void TearDownTestSuite() { sample_.reset(); }

 protected:
  static std::unique_ptr<TemporaryFolder> sample_;
};
std::unique_ptr<TemporaryFolder> BrokenMeasurementTest::sample_;

TEST_P(BrokenMeasurementTest, ExitsWithThreeAndNamesFilePlaceAndReason) {
  const Broken& broken = GetParam();
  const TemporaryFolder folder;
  fs::copy(*sample_ / "m", folder / "m", fs::copy_options::recursive);
  broken.damage(folder);
  const Outcome outcome = tenter({"fit", "m", "-o", "output"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("m/" + broken.file));
  EXPECT_THAT(outcome.err, HasSubstr(broken.place));
  EXPECT_THAT(outcome.err, HasSubstr(broken.reason));
  EXPECT_EQ(test_support::listFolder(folder.path()), std::vector<std::string>{"m"});
}

const auto kName = [](const auto& of) { return of.param.name; };
INSTANTIATE_TEST_SUITE_P(Header, BrokenMeasurementTest, ::testing::ValuesIn(brokenHeaders()),
                         kName);
INSTANTIATE_TEST_SUITE_P(Frames, BrokenMeasurementTest, ::testing::ValuesIn(brokenFrames()), kName);
INSTANTIATE_TEST_SUITE_P(Meshes, BrokenMeasurementTest, ::testing::ValuesIn(brokenMeshes()), kName);

}  // namespace
}  // namespace tenter::system_test
