// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "measurement_samples.h"
#include "tenter/core/mesh_io.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::HasSubstr;

/// A good measurement on disk whose files tests damage.
class Victim {
 public:
  explicit Victim(const Measurement& m) {
    if (auto done = writeMeasurement(root(), m); !done) {
      throw std::logic_error(done.error().message());
    }
  }
  fs::path root() const { return folder_ / "m"; }
  void write(const std::string& name, const std::string& content) {
    folder_.write(fs::path("m") / name, content);
  }
  void header(const std::function<void(json&)>& damage) {
    json document = json::parse(slurp(root() / "measurement.json"));
    damage(document);
    write("measurement.json", document.dump());
  }
  void line(std::size_t index, const std::function<void(json&)>& damage) {
    std::vector<std::string> all = lines();
    json document = json::parse(all[index]);
    damage(document);
    all[index] = document.dump();
    lines(all);
  }
  std::vector<std::string> lines() const {
    std::istringstream in(slurp(root() / "frames.jsonl"));
    std::vector<std::string> all;
    for (std::string text; std::getline(in, text);) all.push_back(text);
    return all;
  }
  void lines(const std::vector<std::string>& all) {
    std::string text;
    for (const std::string& one : all) text += one + "\n";
    write("frames.jsonl", text);
  }
  void mesh(const std::string& name, const std::function<void(MeshFile&)>& damage) {
    auto file = readMesh(root() / name);
    damage(*file);
    if (!writeVtp(root() / name, file->mesh, file->data)) throw std::logic_error("cannot write");
  }

 private:
  TemporaryFolder folder_;
};

enum class Kind { kCloth, kTensile, kCantilever };

struct Breakage {
  const char* name;
  Kind kind;
  std::function<void(Victim&)> damage;
  const char* file;  ///< Below the measurement's folder.
  const char* place;
  const char* reason;
};

Measurement sampleOf(Kind kind) {
  if (kind == Kind::kTensile) return samples::tensileTest();
  if (kind == Kind::kCantilever) return samples::cantileverTest();
  return samples::stretchTest();
}

class BrokenMeasurementTest : public testing::TestWithParam<Breakage> {};

TEST_P(BrokenMeasurementTest, IsRefusedWithFilePlaceAndReason) {
  Victim victim(sampleOf(GetParam().kind));
  ASSERT_TRUE(readMeasurement(victim.root()).ok());
  GetParam().damage(victim);
  const auto read = readMeasurement(victim.root());
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
  EXPECT_EQ(read.error().file, (victim.root() / GetParam().file).string());
  EXPECT_THAT(read.error().place, HasSubstr(GetParam().place));
  EXPECT_THAT(read.error().reason, HasSubstr(GetParam().reason));
}

Breakage header(const char* name, const std::function<void(json&)>& damage, const char* place,
                const char* reason, Kind kind = Kind::kCloth) {
  return {name, kind, [damage](Victim& v) { v.header(damage); }, "measurement.json", place, reason};
}

/// Damage to the second line.
Breakage frame(const char* name, const std::function<void(json&)>& damage, const char* place,
               const char* reason, Kind kind = Kind::kCloth) {
  return {name, kind, [damage](Victim& v) { v.line(1, damage); }, "frames.jsonl", place, reason};
}

Breakage mesh(const char* name, const char* file, const std::function<void(MeshFile&)>& damage,
              const char* place, const char* reason) {
  return {name, Kind::kCloth, [=](Victim& v) { v.mesh(file, damage); }, file, place, reason};
}

INSTANTIATE_TEST_SUITE_P(
    Header, BrokenMeasurementTest,
    testing::Values(
        header(
            "missing_density", [](json& j) { j.erase("areal_density_kg_per_m2"); },
            "areal_density_kg_per_m2", "is missing"),
        header(
            "density_in_grams", [](json& j) { j["areal_density_kg_per_m2"] = 150; },
            "areal_density_kg_per_m2", "between 0.005 and 5"),
        header(
            "negative_density", [](json& j) { j["areal_density_kg_per_m2"] = -0.1; },
            "areal_density_kg_per_m2", "is -0.1"),
        header(
            "null_thickness", [](json& j) { j["thickness_m"] = nullptr; }, "thickness_m", "null"),
        header(
            "sample_in_millimetres",
            [](json& j) {
              j["sample_size_m"] = {100, 100};
            },
            "sample_size_m[0]", "is 100"),
        header(
            "tiny_sample",
            [](json& j) {
              j["sample_size_m"] = {0.1, 1e-4};
            },
            "sample_size_m[1]", "is 0.0001"),
        header(
            "gravity_in_millimetres",
            [](json& j) {
              j["gravity_m_per_s2"] = {0, 0, -9806.65};
            },
            "gravity_m_per_s2", "20 m/s^2"),
        header(
            "gravity_of_two",
            [](json& j) {
              j["gravity_m_per_s2"] = {0, -9.8};
            },
            "gravity_m_per_s2", "2 numbers instead of 3"),
        header(
            "negative_mass", [](json& j) { j["clips"][1]["mass_kg"] = -0.05; }, "clips[1].mass_kg",
            "is -0.05"),
        header(
            "mass_in_grams", [](json& j) { j["clips"][0]["mass_kg"] = 51; }, "clips[0].mass_kg",
            "is 51"),
        header(
            "clip_twice", [](json& j) { j["clips"][1]["id"] = "left"; }, "clips[1].id",
            "appears twice"),
        header(
            "rotation_sigma_in_degrees", [](json& j) { j["clip_rotation_sigma_rad"] = 1.5; },
            "clip_rotation_sigma_rad", "is 1.5"),
        header(
            "newer_version", [](json& j) { j["schema_version"] = 99; }, "schema_version", "newer"),
        header(
            "version_zero", [](json& j) { j["schema_version"] = 0; }, "schema_version", "is 0"),
        header(
            "other_format", [](json& j) { j["format"] = "tenter-material"; }, "format",
            "instead of"),
        header(
            "imperial", [](json& j) { j["units"] = "inch"; }, "units", "SI"),
        header(
            "no_kind", [](json& j) { j.erase("cantilever"); }, "tensile", "neither",
            Kind::kCantilever),
        header(
            "no_frames", [](json& j) { j["frame_count"] = 0; }, "frame_count", "is 0"),
        header(
            "absurd_frames", [](json& j) { j["frame_count"] = 1e15; }, "frame_count", "whole"),
        header(
            "rest_elsewhere", [](json& j) { j["rest_mesh"] = "../../secret.vtp"; }, "rest_mesh",
            "must be"),
        header(
            "angle_in_degrees", [](json& j) { j["tensile"]["angle_rad"] = 45; },
            "tensile.angle_rad", "is 45", Kind::kTensile),
        header(
            "no_strips", [](json& j) { j["tensile"]["strips"] = 0; }, "tensile.strips", "is 0",
            Kind::kTensile),
        header(
            "length_in_millimetres", [](json& j) { j["tensile"]["length_m"] = 97; },
            "tensile.length_m", "is 97", Kind::kTensile),
        Breakage{"truncated_header", Kind::kCloth,
                 [](Victim& v) {
                   const std::string text = slurp(v.root() / "measurement.json");
                   v.write("measurement.json", text.substr(0, text.size() / 2));
                 },
                 "measurement.json", "line ", "ends too early"},
        Breakage{"empty_header", Kind::kCloth, [](Victim& v) { v.write("measurement.json", ""); },
                 "measurement.json", "line 1", "ends too early"},
        Breakage{"no_header", Kind::kCloth,
                 [](Victim& v) { fs::remove(v.root() / "measurement.json"); }, "measurement.json",
                 "", "cannot be read"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Frames, BrokenMeasurementTest,
    testing::Values(
        frame(
            "out_of_order", [](json& j) { j["time_ns"] = 3'000'000'000; }, "line 3: time_ns",
            "earlier"),
        frame(
            "negative_time", [](json& j) { j["time_ns"] = -1; }, "line 2: time_ns", "is -1"),
        frame(
            "fractional_time", [](json& j) { j["time_ns"] = 0.5; }, "line 2: time_ns", "whole"),
        frame(
            "unknown_branch", [](json& j) { j["branch"] = "sideways"; }, "line 2: branch",
            "must be"),
        frame(
            "missing_tension", [](json& j) { j["cords"][0].erase("tension_N"); },
            "line 2: cords[0].tension_N", "is missing"),
        frame(
            "tension_in_millinewtons", [](json& j) { j["cords"][1]["tension_N"] = 5000; },
            "line 2: cords[1].tension_N", "is 5000"),
        frame(
            "pushing_cord", [](json& j) { j["cords"][1]["tension_N"] = -5; },
            "line 2: cords[1].tension_N", "is -5"),
        frame(
            "negative_sigma", [](json& j) { j["cords"][0]["tension_sigma_N"] = -0.1; },
            "line 2: cords[0].tension_sigma_N", "is -0.1"),
        frame(
            "long_direction",
            [](json& j) {
              j["cords"][0]["direction"] = {1, 1, 0};
            },
            "line 2: cords[0].direction", "unit vector"),
        frame(
            "attachment_in_millimetres",
            [](json& j) {
              j["cords"][0]["attachment_m"] = {50, 0, 0};
            },
            "line 2: cords[0].attachment_m", "10 m"),
        frame(
            "cord_twice", [](json& j) { j["cords"][1]["cord"] = "west"; }, "line 2: cords[1].cord",
            "appears twice"),
        frame(
            "cord_of_no_clip", [](json& j) { j["cords"][1]["clip"] = "top"; },
            "line 2: cords[1].clip", "no clip of this frame"),
        frame(
            "unknown_clip", [](json& j) { j["clips"][0]["clip"] = "top"; }, "line 2: clips[0].clip",
            "not in measurement.json"),
        frame(
            "same_clip_twice", [](json& j) { j["clips"][1]["clip"] = "left"; },
            "line 2: clips[1].clip", "appears twice"),
        frame(
            "skewed_rotation",
            [](json& j) {
              j["clips"][0]["rotation"][0] = {1, 0.1, 0};
            },
            "line 2: clips[0].rotation", "not a rotation"),
        frame(
            "mirrored_rotation",
            [](json& j) {
              j["clips"][0]["rotation"] = {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
            },
            "line 2: clips[0].rotation", "right-handed"),
        frame(
            "rotation_of_two_rows", [](json& j) { j["clips"][0]["rotation"].erase(2); },
            "line 2: clips[0].rotation", "2 rows"),
        frame(
            "clip_far_away",
            [](json& j) {
              j["clips"][1]["translation_m"] = {100, 50, 0};
            },
            "line 2: clips[1].translation_m", "10 m"),
        frame(
            "clamped_out_of_range",
            [](json& j) { j["clips"][0]["clamped_vertices"].push_back(16); },
            "line 2: clips[0].clamped_vertices[4]", "vertex 16 of a rest mesh with 16"),
        frame(
            "clamped_negative", [](json& j) { j["clips"][0]["clamped_vertices"][0] = -1; },
            "line 2: clips[0].clamped_vertices[0]", "is -1"),
        frame(
            "clamped_twice", [](json& j) { j["clips"][0]["clamped_vertices"][1] = 0; },
            "line 2: clips[0].clamped_vertices[1]", "appears twice"),
        frame(
            "held_by_two_clips", [](json& j) { j["clips"][1]["clamped_vertices"][0] = 0; },
            "line 2: clips[1].clamped_vertices[0]", "two clips"),
        frame(
            "clip_outside_the_mesh",
            [](json& j) {
              for (json& corner : j["clips"][1]["outline_uv_m"]) {
                corner[0] = corner[0].get<double>() + 0.05;
              }
            },
            "line 2: clips[1].outline_uv_m", "outside the mesh"),
        frame(
            "crossed_outline",
            [](json& j) {
              std::swap(j["clips"][1]["outline_uv_m"][0], j["clips"][1]["outline_uv_m"][1]);
            },
            "line 2: clips[1].outline_uv_m", "convex"),
        frame(
            "outline_of_two",
            [](json& j) {
              j["clips"][1]["outline_uv_m"] = {{0, 0}, {1, 0}};
            },
            "line 2: clips[1].outline_uv_m", "convex"),
        frame(
            "mesh_elsewhere", [](json& j) { j["mesh"] = "frames/000000.vtp"; }, "line 2: mesh",
            "must be"),
        frame(
            "displacement_beyond_length", [](json& j) { j["tensile"]["displacement_m"] = 1.0; },
            "line 2: tensile.displacement_m", "is 1", Kind::kTensile),
        frame(
            "no_tensile", [](json& j) { j.erase("tensile"); }, "line 2: tensile", "is missing",
            Kind::kTensile),
        frame(
            "force_is_text", [](json& j) { j["tensile"]["force_N"] = "4.2"; },
            "line 2: tensile.force_N", "a number", Kind::kTensile),
        Breakage{"chord_longer_than_strip", Kind::kCantilever,
                 [](Victim& v) { v.header([](json& j) { j["cantilever"]["length_m"] = 0.07; }); },
                 "frames.jsonl", "line 1: cantilever.drop_m", "farther apart"},
        Breakage{"truncated_line", Kind::kCloth,
                 [](Victim& v) {
                   auto all = v.lines();
                   all[1].resize(40);
                   v.lines(all);
                 },
                 "frames.jsonl", "line 2, column", "ends too early"},
        Breakage{"nan_literal", Kind::kTensile,
                 [](Victim& v) {
                   auto all = v.lines();
                   all[2] = R"({"time_ns":0,"branch":"loading","tensile":{"force_N":NaN}})";
                   v.lines(all);
                 },
                 "frames.jsonl", "line 3, column", "not valid JSON"},
        Breakage{"line_missing", Kind::kCloth,
                 [](Victim& v) {
                   auto all = v.lines();
                   all.pop_back();
                   v.lines(all);
                 },
                 "frames.jsonl", "line 3", "is missing"},
        Breakage{"line_too_many", Kind::kCloth,
                 [](Victim& v) {
                   auto all = v.lines();
                   all.push_back(all.back());
                   v.lines(all);
                 },
                 "frames.jsonl", "line 4", "more than the 3"},
        Breakage{"no_frames_file", Kind::kCloth,
                 [](Victim& v) { fs::remove(v.root() / "frames.jsonl"); }, "frames.jsonl", "",
                 "cannot be read"}),
    [](const auto& test) { return std::string(test.param.name); });

const char* const kFrameMesh = "frames/000001.vtp";

INSTANTIATE_TEST_SUITE_P(
    Meshes, BrokenMeasurementTest,
    testing::Values(
        mesh(
            "rest_without_uv", "rest.vtp", [](MeshFile& f) { f.mesh.uv.resize(2, 0); }, "uv",
            "is missing"),
        mesh(
            "rest_in_millimetres", "rest.vtp", [](MeshFile& f) { f.mesh.positions *= 1000; },
            "ratio", "is 1000"),
        mesh(
            "uv_in_millimetres", "rest.vtp", [](MeshFile& f) { f.mesh.uv *= 1000; }, "extent of u",
            "is 100"),
        mesh(
            "rest_flipped_triangle", "rest.vtp",
            [](MeshFile& f) { std::swap(f.mesh.triangles[2][0], f.mesh.triangles[2][1]); },
            "triangle", "other way round"),
        mesh(
            "rest_folded_uv", "rest.vtp",
            [](MeshFile& f) { f.mesh.uv.col(5).swap(f.mesh.uv.col(6)); }, "triangle", "folded"),
        mesh(
            "rest_duplicate_vertex", "rest.vtp",
            [](MeshFile& f) {
              const TriangleMesh one = f.mesh;
              f.mesh.positions.conservativeResize(3, 32);
              f.mesh.positions.rightCols(16) = one.positions;
              f.mesh.uv.conservativeResize(2, 32);
              f.mesh.uv.rightCols(16) = one.uv;
              for (const auto& [a, b, c] : one.triangles) {
                f.mesh.triangles.push_back({a + 16, b + 16, c + 16});
              }
            },
            "vertex 16", "exactly where vertex 0"),
        mesh(
            "rest_disconnected", "rest.vtp",
            [](MeshFile& f) {
              f.mesh.triangles.erase(f.mesh.triangles.begin() + 6, f.mesh.triangles.begin() + 12);
            },
            "vertex", "not connected"),
        mesh(
            "frame_vertex_count", kFrameMesh,
            [](MeshFile& f) {
              f.mesh = samples::squareSheet(5);
              f.data = {};
            },
            "Points", "25 vertices but the rest mesh has 16"),
        mesh(
            "frame_other_triangles", kFrameMesh,
            [](MeshFile& f) { std::swap(f.mesh.triangles[0], f.mesh.triangles[1]); }, "Polys",
            "other triangles"),
        mesh(
            "frame_no_sigma", kFrameMesh, [](MeshFile& f) { f.data.point.erase("sigma_m"); },
            "sigma_m", "is missing"),
        mesh(
            "frame_sigma_nan", kFrameMesh,
            [](MeshFile& f) { f.data.point["sigma_m"](0, 3) = std::nan(""); }, "sigma_m",
            "not finite"),
        mesh(
            "frame_sigma_negative", kFrameMesh,
            [](MeshFile& f) { f.data.point["sigma_m"](0, 3) = -1e-5; }, "vertex 3", "sigma_m"),
        mesh(
            "frame_sigma_axes_two", kFrameMesh,
            [](MeshFile& f) { f.data.point["sigma_axes_m"] = Eigen::MatrixXd::Ones(2, 16); },
            "sigma_axes_m", "has 2 components instead of 3"),
        mesh(
            "frame_sigma_axes_negative", kFrameMesh,
            [](MeshFile& f) {
              f.data.point["sigma_axes_m"] = Eigen::MatrixXd::Constant(3, 16, 1e-5);
              f.data.point["sigma_axes_m"](2, 3) = -1e-5;
            },
            "vertex 3", "sigma_axes_m"),
        mesh(
            "frame_valid_half", kFrameMesh, [](MeshFile& f) { f.data.point["valid"](0, 2) = 0.5; },
            "vertex 2", "0 or 1"),
        mesh(
            "frame_in_millimetres", kFrameMesh, [](MeshFile& f) { f.mesh.positions *= 1000; },
            "vertex", "10 m"),
        mesh(
            "frame_nan", kFrameMesh, [](MeshFile& f) { f.mesh.positions(2, 3) = std::nan(""); },
            "Points", "not finite"),
        Breakage{"rest_truncated", Kind::kCloth,
                 [](Victim& v) {
                   const std::string text = slurp(v.root() / "rest.vtp");
                   v.write("rest.vtp", text.substr(0, text.size() / 2));
                 },
                 "rest.vtp", "VTP", "VTK cannot read"},
        Breakage{"rest_absent", Kind::kCloth, [](Victim& v) { fs::remove(v.root() / "rest.vtp"); },
                 "rest.vtp", "", "cannot be read"},
        Breakage{"frame_absent", Kind::kCloth, [](Victim& v) { fs::remove(v.root() / kFrameMesh); },
                 kFrameMesh, "", "cannot be read"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(BrokenMeasurementFolderTest, IsNamed) {
  const TemporaryFolder folder;
  EXPECT_THAT(readMeasurement(folder / "absent").error().reason, HasSubstr("No such file"));
  EXPECT_THAT(readMeasurement(folder.write("file", "")).error().reason, HasSubstr("not a folder"));
  EXPECT_THAT(readMeasurement(folder.path()).error().file, HasSubstr("measurement.json"));
}

}  // namespace
}  // namespace tenter
