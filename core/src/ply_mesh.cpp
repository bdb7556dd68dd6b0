// SPDX-License-Identifier: GPL-3.0-or-later
#include "ply_mesh.h"

#include <array>
#include <cmath>
#include <map>

#include "ply_source.h"

namespace tenter {

namespace {

constexpr int kMaxListLength = 1000;

/// Names that programs give to material coordinates.
constexpr std::array<std::array<const char*, 2>, 2> kUvNames{{{"u", "v"}, {"s", "t"}}};

bool isFaceList(const PlyElement& element, const PlyProperty& property) {
  return element.name == "face" && property.count_type &&
         (property.name == "vertex_indices" || property.name == "vertex_index");
}

class PlyMeshReader {
 public:
  PlyMeshReader(PlySource source, const std::string& file) : source_(source), file_(file) {}

  Result<void> readElement(const PlyElement& element) {
    for (std::int64_t item = 0; item < element.count; ++item) {
      if (element.properties.empty()) break;
      for (const PlyProperty& property : element.properties) {
        const std::string complaint = readProperty(element, property);
        if (complaint.empty()) continue;
        const std::string place =
            element.name + " " + std::to_string(item) + ", property " + property.name;
        return badInput(file_, place, complaint);
      }
    }
    if (element.name == "vertex") vertices_ = element.count;
    return {};
  }

  Result<MeshFile> assemble() {
    if (vertices_ == 0) return badInput(file_, "element vertex", "the mesh has no vertices");
    if (triangles_.empty()) return badInput(file_, "element face", "the mesh has no faces");
    for (const Triangle& triangle : triangles_) {
      for (const int v : triangle) {
        if (v < vertices_) continue;
        return badInput(file_, "element face",
                        "names vertex " + std::to_string(v) + " of " + std::to_string(vertices_));
      }
    }
    MeshFile out;
    out.mesh.positions.resize(3, vertices_);
    constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
      if (!takeColumn(kAxes[static_cast<std::size_t>(axis)], out.mesh.positions, axis)) {
        return badInput(file_, "element vertex",
                        std::string("has no ") + kAxes[static_cast<std::size_t>(axis)]);
      }
    }
    takeUv(out.mesh);
    for (const auto& [name, values] : columns_) {
      out.data.point[name] = Eigen::Map<const Eigen::RowVectorXd>(values.data(), vertices_);
    }
    out.mesh.triangles = std::move(triangles_);
    return out;
  }

 private:
  /// What is wrong, or an empty text; so does addPolygon.
  std::string readProperty(const PlyElement& element, const PlyProperty& property) {
    int count = 1;
    if (property.count_type) {
      const auto length = source_.next(*property.count_type);
      if (!length || !(*length >= 0.0) || *length > kMaxListLength) {
        return "has a wrong list length, or the file is cut off";
      }
      count = static_cast<int>(*length);
    }
    std::vector<double> values;
    for (int i = 0; i < count; ++i) {
      const auto value = source_.next(property.type);
      if (!value) return "is missing or is not a number";
      if (!std::isfinite(*value)) return "is not a finite number";
      values.push_back(*value);
    }
    if (isFaceList(element, property)) return addPolygon(values);
    if (element.name == "vertex" && !property.count_type) {
      columns_[property.name].push_back(values.front());
    }
    return "";
  }

  std::string addPolygon(const std::vector<double>& corners) {
    if (corners.size() < 3) return "has fewer than three vertices";
    std::vector<int> ids;
    for (const double corner : corners) {
      if (!(corner >= 0.0 && corner <= INT32_MAX) || corner != std::floor(corner)) {
        return "is no vertex id";
      }
      ids.push_back(static_cast<int>(corner));
    }
    for (std::size_t i = 1; i + 1 < ids.size(); ++i) {
      triangles_.push_back({ids[0], ids[i], ids[i + 1]});
    }
    return "";
  }

  template <class Matrix>
  bool takeColumn(const std::string& name, Matrix& out, Eigen::Index row) {
    const auto found = columns_.find(name);
    if (found == columns_.end()) return false;
    out.row(row) = Eigen::Map<const Eigen::RowVectorXd>(found->second.data(), vertices_);
    columns_.erase(found);
    return true;
  }

  void takeUv(TriangleMesh& mesh) {
    for (const auto& names : kUvNames) {
      if (!columns_.contains(names[0]) || !columns_.contains(names[1])) continue;
      mesh.uv.resize(2, vertices_);
      takeColumn(names[0], mesh.uv, 0);
      takeColumn(names[1], mesh.uv, 1);
      return;
    }
  }

  PlySource source_;
  std::string file_;
  std::int64_t vertices_ = 0;
  std::map<std::string, std::vector<double>> columns_;
  std::vector<Triangle> triangles_;
};

}  // namespace

Result<MeshFile> parsePly(std::string_view content, const std::string& file) {
  const auto header = takePlyHeader(content, file);
  if (!header) return header.error();
  PlyMeshReader reader(PlySource(content, header->encoding), file);
  for (const PlyElement& element : header->elements) {
    if (auto done = reader.readElement(element); !done) return done.error();
  }
  return reader.assemble();
}

}  // namespace tenter
