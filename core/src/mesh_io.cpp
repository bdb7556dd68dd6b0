// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/mesh_io.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "obj_mesh.h"
#include "ply_mesh.h"
#include "tenter/core/files.h"
#include "vtk_mesh.h"

namespace tenter {

namespace {

std::string lowerExtension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

std::string escapedXml(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

Result<MeshFile> readMesh(const std::filesystem::path& file) {
  const std::string extension = lowerExtension(file);
  const std::string name = file.string();
  const bool known = extension == ".obj" || extension == ".ply" || extension == ".vtp";
  if (!known) {
    return badInput(name, "", "is no OBJ, PLY or VTP file by its name",
                    "convert it, or name it .obj, .ply or .vtp");
  }
  const auto content = readFile(file);
  if (!content) return content.error();
  if (extension == ".obj") return parseObj(*content, name);
  if (extension == ".ply") return parsePly(*content, name);
  return parseVtp(*content, name);
}

Result<void> writeVtp(const std::filesystem::path& file, const TriangleMesh& mesh,
                      const MeshData& data) {
  for (const auto& [name, values] : data.point) {
    require(values.cols() == mesh.positions.cols(), "point array of another length: " + name);
  }
  for (const auto& [name, values] : data.cell) {
    require(values.cols() == static_cast<Eigen::Index>(mesh.triangles.size()),
            "cell array of another length: " + name);
  }
  const auto content = formatVtp(mesh, data);
  if (!content) return content.error().in(file.string());
  return writeFileAtomically(file, *content);
}

Result<void> writeObj(const std::filesystem::path& file, const TriangleMesh& mesh) {
  return writeFileAtomically(file, formatObj(mesh));
}

Result<void> writePvd(const std::filesystem::path& file,
                      const std::vector<std::pair<double, std::string>>& steps) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n";
  for (const auto& [time_s, name] : steps) {
    out << "    <DataSet timestep=\"" << time_s << "\" part=\"0\" file=\"" << escapedXml(name)
        << "\"/>\n";
  }
  out << "  </Collection>\n</VTKFile>\n";
  return writeFileAtomically(file, out.str());
}

}  // namespace tenter
