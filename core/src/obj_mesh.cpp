// SPDX-License-Identifier: GPL-3.0-or-later
#include "obj_mesh.h"

#include <cmath>
#include <sstream>
#include <vector>

#include "text_scan.h"

namespace tenter {

namespace {

class ObjReader {
 public:
  explicit ObjReader(const std::string& file) : file_(file) {}

  Result<MeshFile> read(std::string_view content) {
    while (!content.empty()) {
      ++line_;
      std::string_view line = nextLine(content);
      const std::string_view keyword = nextWord(line);
      Result<void> done;
      if (keyword == "v") done = readCoordinates(line, 3, positions_);
      if (keyword == "vt") done = readCoordinates(line, 2, texture_);
      if (keyword == "f") done = readFace(line);
      if (!done) return done.error();
    }
    return finish();
  }

 private:
  Error failure(const std::string& reason, const std::string& advice = "") const {
    return badInput(file_, "line " + std::to_string(line_), reason, advice);
  }

  Result<void> readCoordinates(std::string_view line, int count, std::vector<double>& out) {
    for (int i = 0; i < count; ++i) {
      const auto value = parseNumber<double>(nextWord(line));
      if (!value || !std::isfinite(*value)) {
        return failure("needs " + std::to_string(count) + " finite numbers");
      }
      out.push_back(*value);
    }
    return {};
  }

  /// One-based or, if negative, counted back from the last; as zero-based. Ids ahead of the list
  /// are checked at the end.
  static std::optional<int> zeroBased(std::string_view word, std::size_t known) {
    const auto id = parseNumber<int>(word);
    if (!id || *id == 0) return std::nullopt;
    const int index = *id > 0 ? *id - 1 : static_cast<int>(known) + *id;
    if (index < 0) return std::nullopt;
    return index;
  }

  Result<void> readFace(std::string_view line) {
    std::vector<int> corners;
    for (std::string_view word = nextWord(line); !word.empty(); word = nextWord(line)) {
      if (word.front() == '#') break;
      const auto slash = word.find('/');
      const auto vertex = zeroBased(word.substr(0, slash), positions_.size() / 3);
      if (!vertex) return failure("\"" + std::string(word.substr(0, 40)) + "\" is no vertex id");
      corners.push_back(*vertex);
      if (slash == std::string_view::npos) continue;
      std::string_view rest = word.substr(slash + 1);
      rest = rest.substr(0, rest.find('/'));
      if (rest.empty()) continue;
      const auto texture = zeroBased(rest, texture_.size() / 2);
      if (!texture) return failure("\"" + std::string(word.substr(0, 40)) + "\" has no such vt");
      uses_.push_back({*vertex, *texture, line_});
    }
    if (corners.size() < 3) return failure("a face needs three vertices");
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      triangles_.push_back({corners[0], corners[i], corners[i + 1]});
      triangle_lines_.push_back(line_);
    }
    return {};
  }

  Result<MeshFile> finish() {
    const auto vertices = static_cast<int>(positions_.size() / 3);
    if (vertices == 0) return badInput(file_, "whole file", "the mesh has no vertices");
    if (triangles_.empty()) return badInput(file_, "whole file", "the mesh has no faces");
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      for (const int v : triangles_[t]) {
        line_ = triangle_lines_[t];
        if (v >= vertices) {
          return failure("names vertex " + std::to_string(v + 1) + " of " +
                         std::to_string(vertices));
        }
      }
    }
    MeshFile out;
    out.mesh.positions = Eigen::Map<const Points3>(positions_.data(), 3, vertices);
    out.mesh.triangles = std::move(triangles_);
    if (auto done = assignUv(out.mesh); !done) return done.error();
    return out;
  }

  /// Material coordinates only if every vertex has exactly one `vt`; a seam (two on one vertex)
  /// leaves none.
  Result<void> assignUv(TriangleMesh& mesh) {
    std::vector<int> chosen(static_cast<std::size_t>(mesh.vertexCount()), -1);
    bool seam = false;
    for (const auto& use : uses_) {
      if (use.texture >= static_cast<int>(texture_.size() / 2)) {
        line_ = use.line;
        return failure("names a vt that the file does not have");
      }
      int& slot = chosen[static_cast<std::size_t>(use.vertex)];
      seam = seam || (slot >= 0 && !sameUv(slot, use.texture));
      slot = use.texture;
    }
    for (const int texture : chosen) seam = seam || texture < 0;
    if (seam) return {};
    mesh.uv.resize(2, mesh.vertexCount());
    for (int v = 0; v < mesh.vertexCount(); ++v) {
      mesh.uv.col(v) = uvOf(chosen[static_cast<std::size_t>(v)]);
    }
    return {};
  }

  Vec2 uvOf(int texture) const {
    return Eigen::Map<const Vec2>(texture_.data() + 2 * static_cast<std::ptrdiff_t>(texture));
  }
  bool sameUv(int a, int b) const { return a == b || uvOf(a) == uvOf(b); }

  struct TextureUse {
    int vertex, texture, line;
  };

  std::string file_;
  int line_ = 0;
  std::vector<double> positions_, texture_;
  std::vector<Triangle> triangles_;
  std::vector<int> triangle_lines_;
  std::vector<TextureUse> uses_;
};

}  // namespace

Result<MeshFile> parseObj(std::string_view content, const std::string& file) {
  return ObjReader(file).read(content);
}

std::string formatObj(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    const Vec3 x = mesh.positions.col(v);
    out << "v " << x.x() << ' ' << x.y() << ' ' << x.z() << '\n';
  }
  const bool has_uv = mesh.hasUv();
  for (int v = 0; has_uv && v < mesh.vertexCount(); ++v) {
    out << "vt " << mesh.uv(0, v) << ' ' << mesh.uv(1, v) << '\n';
  }
  for (const Triangle& triangle : mesh.triangles) {
    out << 'f';
    for (const int v : triangle) {
      out << ' ' << v + 1;
      if (has_uv) out << '/' << v + 1;
    }
    out << '\n';
  }
  return out.str();
}

}  // namespace tenter
