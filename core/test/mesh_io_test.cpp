// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "measurement_samples.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

using test_support::listFolder;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr unsigned kSeed = 20240607;

TriangleMesh bumpySheet(int nodes) {
  TriangleMesh mesh = samples::squareSheet(nodes);
  std::mt19937 random(kSeed);
  std::normal_distribution<double> bump(0.0, 1e-3);
  for (int v = 0; v < mesh.vertexCount(); ++v) mesh.positions(2, v) = bump(random);
  return mesh;
}

TEST(VtpTest, RoundTripsEveryBit) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = bumpySheet(60);  // Several compressed blocks.
  MeshData data;
  data.point["sigma_m"] = Eigen::MatrixXd::Random(1, mesh.vertexCount());
  data.point["velocity"] = Eigen::MatrixXd::Random(3, mesh.vertexCount());
  data.cell["stress"] = Eigen::MatrixXd::Random(2, static_cast<int>(mesh.triangles.size()));
  ASSERT_TRUE(writeVtp(folder / "m.vtp", mesh, data));
  const auto read = readMesh(folder / "m.vtp");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->mesh.positions, mesh.positions);
  EXPECT_EQ(read->mesh.triangles, mesh.triangles);
  EXPECT_EQ(read->mesh.uv, mesh.uv);
  EXPECT_EQ(read->data.point, data.point);
  EXPECT_EQ(read->data.cell, data.cell);
  EXPECT_THAT(listFolder(folder.path()), ElementsAre("m.vtp"));
}

TEST(ObjTest, RoundTripsEveryBit) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = bumpySheet(5);
  ASSERT_TRUE(writeObj(folder / "m.obj", mesh));
  const auto read = readMesh(folder / "m.obj");
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->mesh.positions, mesh.positions);
  EXPECT_EQ(read->mesh.triangles, mesh.triangles);
  EXPECT_EQ(read->mesh.uv, mesh.uv);
}

TEST(ObjTest, ReadsPolygonsNegativeIdsAndKeepsFileOrder) {
  const TemporaryFolder folder;
  const auto read = readMesh(folder.write("m.OBJ",
                                          "# note\nmtllib x.mtl\nv 9 9 9\nv 0 0 0\r\nv 1 0 0 1\n"
                                          "v 1 1 0\nv 0 1 0\nvn 0 0 1\nf -4//1 -3//1 -2//1 -1//1\n"
                                          "f 2 3 1 # fan\n"));
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_THAT(read->mesh.triangles,
              ElementsAre(Triangle{1, 2, 3}, Triangle{1, 3, 4}, Triangle{1, 2, 0}));
  EXPECT_EQ(read->mesh.positions.col(0), Vec3(9, 9, 9));
  EXPECT_FALSE(read->mesh.hasUv());
}

TEST(ObjTest, ASeamLeavesNoMaterialCoordinates) {
  const TemporaryFolder folder;
  const std::string vertices =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  const auto whole = readMesh(folder.write("a.obj", vertices + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"));
  const auto seam = readMesh(folder.write("b.obj", vertices + "f 1/1 2/2 3/3\nf 1/2 3/3 4/4\n"));
  const auto partial = readMesh(folder.write("c.obj", vertices + "f 1/1 2/2 3/3\nf 1 3 4\n"));
  EXPECT_TRUE(whole->mesh.hasUv());
  EXPECT_FALSE(seam->mesh.hasUv());
  EXPECT_FALSE(partial->mesh.hasUv());
}

TEST(VtpTest, ReadsWhatParaViewWrites) {
  // Appended base64, big-endian, zlib: as other programs set their writers.
  const TemporaryFolder folder;
  const std::string packed =
      "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"BigEndian\" header_type=\"UInt64\" "
      "compr"
      "essor=\"vtkZLibDataCompressor\"><PolyData><Piece NumberOfPoints=\"3\" "
      "NumberOfPolys=\"1\"><Poi"
      "nts><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" "
      "offset=\"0\"/></Poi"
      "nts><Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"appended\" "
      "offset=\"68\"/><D"
      "ataArray type=\"Int64\" Name=\"offsets\" format=\"appended\" "
      "offset=\"132\"/></Polys></Piece></P"
      "olyData><AppendedData encoding=\"base64\">_AAAAAAAAAAEAAAAAAAAASAAAAAAAAAAAAAAAAAAAABI=eNp"
      "jYMAO7D8w4AXo8gBKKAJfAAAAAAAAAAEAAAAAAAAAGAAAAAAAAAAAAAAAAAAAAA8=eNpjYEABjFCaCQAAIwAEAAA"
      "AAAAAAAEAAAAAAAAACAAAAAAAAAAAAAAAAAAAAAw=eNpjYAADZgAACwAE</AppendedData></VTKFile>";
  const auto read = readMesh(folder.write("m.vtp", packed));
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->mesh.positions.col(1), Vec3(1, 0, 0));
  EXPECT_THAT(read->mesh.triangles, ElementsAre(Triangle{0, 1, 2}));
  std::string damaged = packed;
  damaged[damaged.find('_') + 7] = '/';
  EXPECT_THAT(readMesh(folder.write("n.vtp", damaged)).error().reason,
              testing::HasSubstr("compressed blocks"));
}

template <class T>
void appendBytes(std::string& out, T value, bool big_endian) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  out += bytes;
}

std::string binaryPly(bool big_endian) {
  std::string out = "ply\nformat binary_";
  out += big_endian ? "big" : "little";
  out +=
      "_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty float z\n"
      "property float s\nproperty float t\nelement face 1\n"
      "property list uchar int vertex_indices\nproperty uchar red\nend_header\n";
  for (int v = 0; v < 4; ++v) {
    const double x = v == 1 || v == 2 ? 0.1 : 0.0, y = v >= 2 ? 0.1 : 0.0;
    appendBytes(out, x, big_endian);
    appendBytes(out, y, big_endian);
    for (const float value : {0.5F, static_cast<float>(x), static_cast<float>(y)}) {
      appendBytes(out, value, big_endian);
    }
  }
  appendBytes(out, std::uint8_t{4}, big_endian);
  for (const int id : {0, 1, 2, 3}) appendBytes(out, id, big_endian);
  appendBytes(out, std::uint8_t{255}, big_endian);
  return out;
}

TEST(PlyTest, ReadsBothByteOrdersInDoublePrecision) {
  const TemporaryFolder folder;
  for (const bool big_endian : {false, true}) {
    const auto read = readMesh(folder.write("m.ply", binaryPly(big_endian)));
    ASSERT_TRUE(read.ok()) << read.error().message();
    EXPECT_EQ(read->mesh.positions.col(2), Vec3(0.1, 0.1, 0.5));
    EXPECT_THAT(read->mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
    EXPECT_TRUE(read->mesh.hasUv());
  }
}

TEST(PlyTest, ReadsText) {
  const TemporaryFolder folder;
  const auto read = readMesh(folder.write(
      "m.ply",
      "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nproperty float u\nproperty float v\nproperty float q\n"
      "element face 1\nproperty list uchar int vertex_index\nend_header\n"
      "0 0 0 0 0 7\n1 0 0 2 0 8\n0 1 0 0 2 9\n3 0 1 2\n"));
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(read->mesh.uv.col(1), Vec2(2, 0));
  EXPECT_EQ(read->data.point.at("q"), Eigen::RowVector3d(7, 8, 9));
}

TEST(MeshIoTest, EveryTruncationOfAVtpIsRefusedQuietly) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeVtp(folder / "m.vtp", bumpySheet(4)));
  const std::string whole = slurp(folder / "m.vtp");
  const std::size_t useful = whole.rfind("</PolyData>");
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  for (std::size_t length = 0; length < useful; length += 37) {
    EXPECT_FALSE(readMesh(folder.write("t.vtp", whole.substr(0, length))).ok()) << length;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

/// Damaged bytes may still be a mesh; what counts is that nothing crashes, hangs or prints.
TEST(MeshIoTest, DamagedBytesNeverCrashOrPrint) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeVtp(folder / "m.vtp", bumpySheet(4)));
  ASSERT_TRUE(writeObj(folder / "m.obj", bumpySheet(3)));
  folder.write("m.ply", binaryPly(false));
  std::mt19937 random(kSeed);
  int refused = 0;
  testing::internal::CaptureStderr();
  for (const std::string name : {"m.vtp", "m.obj", "m.ply"}) {
    const std::string whole = slurp(folder / name);
    std::uniform_int_distribution<std::size_t> place(0, whole.size() - 1);
    std::uniform_int_distribution<int> byte(0, 255);
    for (int round = 0; round < 300; ++round) {
      std::string damaged = whole;
      for (int i = 0; i <= round % 3; ++i) damaged[place(random)] = static_cast<char>(byte(random));
      const auto read = readMesh(folder.write("d" + name, damaged));
      if (read.ok()) continue;
      ++refused;
      EXPECT_FALSE(read.error().place.empty()) << read.error().message();
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(refused, 300);
}

TEST(MeshIoTest, WritingArraysOfAnotherLengthIsACallersBug) {
  const TemporaryFolder folder;
  MeshData data;
  data.point["short"] = Eigen::MatrixXd::Zero(1, 2);
  EXPECT_THROW((void)writeVtp(folder / "m.vtp", bumpySheet(3), data), std::invalid_argument);
}

TEST(PvdTest, ListsStepsAndEscapesNames) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writePvd(folder / "m.pvd", {{0.0, "a.vtp"}, {0.5, "b&\"c\".vtp"}}));
  const std::string text = slurp(folder / "m.pvd");
  EXPECT_THAT(text, HasSubstr("timestep=\"0.5\" part=\"0\" file=\"b&amp;&quot;c&quot;.vtp\""));
}

}  // namespace
}  // namespace tenter
