// SPDX-License-Identifier: GPL-3.0-or-later
// The readers of meshes: any bytes are refused with a reason, or are a mesh whose ids and lengths
// agree and that writes as itself.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "fuzz_target.h"
#include "obj_mesh.h"
#include "ply_mesh.h"
#include "vtk_mesh.h"

namespace {

void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

void check(const tenter::Result<tenter::MeshFile>& read) {
  if (!read) {
    require(!read.error().reason.empty() && read.error().file == "m", "errors have a reason");
    return;
  }
  const tenter::TriangleMesh& mesh = read->mesh;
  require(mesh.positions.allFinite(), "positions are finite");
  require(!mesh.hasUv() || mesh.uv.cols() == mesh.positions.cols(), "uv has an entry a vertex");
  for (const auto& [name, values] : read->data.point) {
    require(values.cols() == mesh.positions.cols(), "point arrays have an entry a vertex");
  }
  for (const tenter::Triangle& triangle : mesh.triangles) {
    for (const int v : triangle) require(v >= 0 && v < mesh.vertexCount(), "ids are in range");
  }
  if (!tenter::validateMesh(mesh)) return;
  const auto again = tenter::parseObj(tenter::formatObj(mesh), "m");
  require(again.ok() && again->mesh.positions == mesh.positions, "it is written as itself");
}

std::string vtp(const std::string& attributes, const std::string& arrays) {
  return "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"" + attributes +
         "><PolyData><Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" "
         "NumberOfPolys=\"2\"><PointData>" +
         arrays +
         "</PointData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
         "format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points><Polys><DataArray "
         "type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 0 2 3</DataArray><DataArray "
         "type=\"Int64\" Name=\"offsets\" format=\"ascii\">3 6</DataArray></Polys></Piece>"
         "</PolyData></VTKFile>";
}

}  // namespace

/// VTK loses an iterator of its own where values in text are too few.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:vtkArrayIteratorTemplate";
}

std::vector<std::string> fuzzSeeds() {
  tenter::TriangleMesh square;
  square.positions.resize(3, 4);
  square.positions << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0;
  square.uv = square.positions.topRows(2);
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  const std::string uv =
      "<DataArray type=\"Float32\" Name=\"uv\" NumberOfComponents=\"2\" format=\"ascii\">"
      "0 0 1 0 1 1 0 1</DataArray>";
  const std::string ply_head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property double z\nproperty uchar s\nproperty uchar t\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  return {vtp("", ""),
          vtp("", uv),
          vtp(" compressor=\"vtkZLibDataCompressor\"",
              "<DataArray type=\"Int32\" Name=\"a\" format=\"binary\">"
              "AQAAAACAAAAQAAAAEAAAAA==eJxjYGBgAAAABAAB</DataArray>"),
          tenter::formatVtp(square, {}).value(),
          tenter::formatObj(square),
          "v 0 0 0\nv 1 0 0\nvt 0 0\nv 0 1e-3 0\nf -3/1/1 -2//1 -1 # last\n",
          ply_head + "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  check(tenter::parseVtp(bytes, "m"));
  check(tenter::parseObj(bytes, "m"));
  check(tenter::parsePly(bytes, "m"));
  return 0;
}
