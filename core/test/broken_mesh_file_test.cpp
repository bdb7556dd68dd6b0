// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tenter/core/mesh_io.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

struct BrokenFile {
  const char* name;
  std::string file;
  std::string content;
  const char* place;
  const char* reason;
};

class BrokenMeshFileTest : public testing::TestWithParam<BrokenFile> {};

TEST_P(BrokenMeshFileTest, IsRefusedWithFilePlaceAndReason) {
  const TemporaryFolder folder;
  const auto read = readMesh(folder.write(GetParam().file, GetParam().content));
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
  EXPECT_EQ(read.error().file, (folder / GetParam().file).string());
  EXPECT_THAT(read.error().place, HasSubstr(GetParam().place));
  EXPECT_THAT(read.error().reason, HasSubstr(GetParam().reason));
}

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

std::string obj(const std::string& more) { return kTriangle + more; }

std::string ply(const std::string& vertices, const std::string& faces,
                const std::string& count = "3") {
  return "ply\nformat ascii 1.0\nelement vertex " + count +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
         "property list uchar int vertex_indices\nend_header\n" +
         vertices + faces;
}

/// An ASCII VTP of three vertices and the given polygons.
std::string vtp(const std::string& points, const std::string& ids, const std::string& offsets,
                const std::string& extra = "", const std::string& count = "3") {
  const std::string array =
      "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">";
  const std::string whole = "<DataArray type=\"Int64\" format=\"ascii\" Name=\"";
  return "<?xml version=\"1.0\"?><VTKFile type=\"PolyData\" version=\"1.0\" "
         "byte_order=\"LittleEndian\" header_type=\"UInt64\"><PolyData><Piece NumberOfPoints=\"" +
         count +
         "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
         (offsets.empty() ? "0" : "1") + "\">" + extra + "<Points>" + array + points +
         "</DataArray></Points><Polys>" + whole + "connectivity\">" + ids + "</DataArray>" + whole +
         "offsets\">" + offsets + "</DataArray></Polys></Piece></PolyData></VTKFile>";
}

const char* const kPoints = "0 0 0 1 0 0 0 1 0";
const char* const kThree = "0 0 0\n1 0 0\n0 1 0\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

/// Three vertices in plain text, and an array of packed data.
std::string packedVtp(const std::string& data) {
  const std::string array =
      "<PointData><DataArray type=\"Float64\" Name=\"uv\" NumberOfComponents=\"2\" "
      "format=\"binary\">";
  const std::string whole = vtp(kPoints, "0 1 2", "3", array + data + "</DataArray></PointData>");
  return replaced(whole, "header_type=\"UInt64\"",
                  "header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\"");
}

TEST(MeshFileTest, TheUndamagedFilesAreRead) {
  const TemporaryFolder folder;
  EXPECT_TRUE(readMesh(folder.write("a.obj", obj("f 1 2 3\n"))).ok());
  EXPECT_TRUE(readMesh(folder.write("a.ply", ply(kThree, "3 0 1 2\n"))).ok());
  const auto read = readMesh(folder.write("a.vtp", vtp(kPoints, "0 1 2", "3")));
  EXPECT_TRUE(read.ok()) << read.error().message();
}

TEST(MeshFileTest, UnknownExtensionsAndAbsentFilesAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(readMesh(folder.write("a.stl", "")).error().reason, HasSubstr("OBJ, PLY or VTP"));
  EXPECT_THAT(readMesh(folder / "none.vtp").error().reason, HasSubstr("cannot be read"));
}

INSTANTIATE_TEST_SUITE_P(
    Obj, BrokenMeshFileTest,
    testing::Values(
        BrokenFile{"obj_empty", "m.obj", "", "whole file", "no vertices"},
        BrokenFile{"obj_no_faces", "m.obj", kTriangle, "whole file", "no faces"},
        BrokenFile{"obj_short_vertex", "m.obj", "v 1 2\n", "line 1", "3 finite numbers"},
        BrokenFile{"obj_nan", "m.obj", obj("v nan 0 0\n"), "line 4", "3 finite numbers"},
        BrokenFile{"obj_words", "m.obj", obj("v a b c\n"), "line 4", "3 finite numbers"},
        BrokenFile{"obj_id_zero", "m.obj", obj("f 0 1 2\n"), "line 4", "no vertex id"},
        BrokenFile{"obj_id_text", "m.obj", obj("f 1 2 x\n"), "line 4", "no vertex id"},
        BrokenFile{"obj_id_far_back", "m.obj", obj("f 1 2 -9\n"), "line 4", "no vertex id"},
        BrokenFile{"obj_id_beyond", "m.obj", obj("f 1 2 4\n"), "line 4", "names vertex 4 of 3"},
        BrokenFile{"obj_two_corners", "m.obj", obj("f 1 2\n"), "line 4", "three vertices"},
        BrokenFile{"obj_absent_vt", "m.obj", obj("f 1/1 2/1 3/1\n"), "line 4", "names a vt"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Ply, BrokenMeshFileTest,
    testing::Values(
        BrokenFile{"ply_empty", "m.ply", "", "line 1", "does not say"},
        BrokenFile{"ply_no_end", "m.ply", "ply\nformat ascii 1.0\n", "header", "no end"},
        BrokenFile{"ply_no_format", "m.ply", "ply\nend_header\n", "line 2", "without a format"},
        BrokenFile{"ply_format", "m.ply", "ply\nformat morse 1.0\n", "line 2", "unknown format"},
        BrokenFile{"ply_huge", "m.ply", ply("", "", "99999999999"), "line 3", "100 million"},
        BrokenFile{"ply_count", "m.ply", ply("", "", "-3"), "line 3", "a count"},
        BrokenFile{"ply_truncated", "m.ply", ply("0 0 0\n1 0 0\n", ""), "vertex 2, property x",
                   "is missing"},
        BrokenFile{"ply_nan", "m.ply", ply("0 0 0\n1 nan 0\n0 1 0\n", "3 0 1 2\n"),
                   "vertex 1, property y", "not a finite"},
        BrokenFile{"ply_id", "m.ply", ply(kThree, "3 0 1 3\n"), "element face", "names vertex 3"},
        BrokenFile{"ply_id_negative", "m.ply", ply(kThree, "3 0 1 -1\n"), "face 0", "no vertex id"},
        BrokenFile{"ply_two_corners", "m.ply", ply(kThree, "2 0 1\n"), "face 0",
                   "fewer than three"},
        BrokenFile{"ply_list", "m.ply", ply(kThree, "-1 0 1\n"), "face 0", "list length"},
        BrokenFile{"ply_type", "m.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty z x\n",
                   "line 4", "unknown type"},
        BrokenFile{"ply_twice", "m.ply",
                   "ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 2\nend_header\n",
                   "line 4", "repeats"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Vtp, BrokenMeshFileTest,
    testing::Values(
        BrokenFile{"vtp_empty", "m.vtp", "", "VTP", "VTK cannot read"},
        BrokenFile{"vtp_text", "m.vtp", "no xml at all", "VTP", "VTK cannot read"},
        BrokenFile{"vtp_no_cells", "m.vtp", vtp(kPoints, "", ""), "Polys", "no polygons"},
        BrokenFile{"vtp_nan", "m.vtp", vtp("0 0 0 1 nan 0 0 1 0", "0 1 2", "3"), "Points",
                   "not finite"},
        BrokenFile{"vtp_id", "m.vtp", vtp(kPoints, "0 1 3", "3"), "connectivity entry 2",
                   "does not have"},
        BrokenFile{"vtp_id_negative", "m.vtp", vtp(kPoints, "0 1 -1", "3"), "connectivity entry 2",
                   "does not have"},
        BrokenFile{"vtp_offset", "m.vtp", vtp(kPoints, "0 1 2", "7"), "VTP", "not long enough"},
        BrokenFile{"vtp_two_corners", "m.vtp", vtp(kPoints, "0 1", "2"), "polygon 0",
                   "fewer than three"},
        BrokenFile{"vtp_huge_count", "m.vtp", vtp(kPoints, "0 1 2", "3", "", "999999999999999"),
                   "NumberOfPoints", "more than the file can hold"},
        BrokenFile{"vtp_large_count", "m.vtp", vtp(kPoints, "0 1 2", "3", "", "4000"), "VTP",
                   "too short"},
        BrokenFile{"vtp_negative_count", "m.vtp", vtp(kPoints, "0 1 2", "3", "", "-4"),
                   "NumberOfPoints", "no count"},
        BrokenFile{"vtp_short_array", "m.vtp",
                   vtp(kPoints, "0 1 2", "3",
                       "<PointData><DataArray type=\"Float64\" Name=\"a\" format=\"ascii\">1 "
                       "2</DataArray></PointData>"),
                   "VTP", "too short"},
        BrokenFile{"vtp_uv_of_three", "m.vtp",
                   vtp(kPoints, "0 1 2", "3",
                       "<PointData><DataArray type=\"Float64\" Name=\"uv\" "
                       "NumberOfComponents=\"3\" format=\"ascii\">1 2 3 4 5 6 7 8 "
                       "9</DataArray></PointData>"),
                   "uv", "two components"},
        BrokenFile{"vtp_text_array", "m.vtp",
                   vtp(kPoints, "0 1 2", "3",
                       "<PointData><DataArray type = 'String' Name=\"a\" format=\"ascii\">65 66"
                       "</DataArray></PointData>"),
                   "array \"a\"", "text"},
        BrokenFile{"vtp_entity", "m.vtp",
                   vtp(kPoints, "0 1 2", "3",
                       "<PointData><DataArray type=\"&#83;tring\" Name=\"a\" "
                       "format=\"ascii\">65 66</DataArray></PointData>"),
                   "byte", "entities"},
        BrokenFile{"vtp_quoted_bracket", "m.vtp",
                   vtp(kPoints, "0 1 2", "3",
                       "<PointData><DataArray Name=\"a>b\" type=\"Float64\" format=\"ascii\">1 2 3"
                       "</DataArray></PointData>"),
                   "array", "does not end"},
        BrokenFile{"vtp_single_quotes", "m.vtp",
                   replaced(vtp(kPoints, "0 1 2", "3"), "NumberOfPoints=\"3\"",
                            "NumberOfPoints = '99999999999'"),
                   "NumberOfPoints", "more than the file can hold"},
        // Blocks that VTK would look up without asking: no block but a last one, half a header,
        // and a packed size that is missing.
        BrokenFile{"vtp_no_block_but_bytes", "m.vtp", packedVtp("AAAAAACAAAABAAAA"), "array \"uv\"",
                   "compressed blocks"},
        BrokenFile{"vtp_half_header", "m.vtp", packedVtp("AQAAAACA"), "array \"uv\"",
                   "compressed blocks"},
        BrokenFile{"vtp_too_many_blocks", "m.vtp", packedVtp("/////wCAAAAAAAAA"), "array \"uv\"",
                   "compressed blocks"},
        BrokenFile{"vtp_no_packed_size", "m.vtp", packedVtp("AQAAAACAAAAwAAAA"), "array \"uv\"",
                   "compressed blocks"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tenter
