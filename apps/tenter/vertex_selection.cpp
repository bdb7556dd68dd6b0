// SPDX-License-Identifier: GPL-3.0-or-later
#include "vertex_selection.h"

#include <charconv>
#include <cmath>
#include <set>
#include <string_view>

namespace tenter::app {

namespace {

constexpr std::string_view kBox = "box:";
constexpr const char* kForms = "use ids from 0 as 0,99, ranges as 4-17, or box:x0,y0,z0,x1,y1,z1";

std::vector<std::string_view> pieces(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <class Number>
bool parse(std::string_view text, Number& value) {
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  return code == std::errc() && end == text.data() + text.size();
}

Result<void> addRange(std::string_view piece, int vertex_count, std::set<int>& chosen) {
  const auto dash = piece.find('-');
  int first = 0, last = 0;
  const bool ok = dash == std::string_view::npos
                      ? parse(piece, first) && parse(piece, last)
                      : parse(piece.substr(0, dash), first) && parse(piece.substr(dash + 1), last);
  if (!ok || first > last || first < 0) {
    return usageError("--fix: cannot read '" + std::string(piece) + "'", kForms);
  }
  if (last >= vertex_count) {
    return usageError("--fix: there is no vertex " + std::to_string(last) + "; the mesh has 0 to " +
                      std::to_string(vertex_count - 1));
  }
  for (int id = first; id <= last; ++id) chosen.insert(id);
  return {};
}

Result<void> addBox(const std::string& selection, const TriangleMesh& mesh, std::set<int>& chosen) {
  const auto numbers = parseNumbers(selection.substr(kBox.size()), 6, "--fix box:");
  if (!numbers) return numbers.error();
  const Eigen::Map<const Vec3> a(numbers->data()), b(numbers->data() + 3);
  const Eigen::AlignedBox3d box(a.cwiseMin(b), a.cwiseMax(b));
  bool any = false;
  for (int id = 0; id < mesh.vertexCount(); ++id) {
    if (!box.contains(mesh.positions.col(id))) continue;
    chosen.insert(id);
    any = true;
  }
  if (!any) return usageError("--fix: no vertex lies in " + selection, "coordinates are in metres");
  return {};
}

}  // namespace

Result<std::vector<double>> parseNumbers(const std::string& text, std::size_t count,
                                         const std::string& option) {
  std::vector<double> numbers;
  for (const std::string_view piece : pieces(text, ',')) {
    double value = 0.0;
    if (!parse(piece, value) || !std::isfinite(value)) {
      return usageError(option + ": cannot read '" + std::string(piece) + "'");
    }
    numbers.push_back(value);
  }
  if (numbers.size() == count) return numbers;
  return usageError(option + ": needs " + std::to_string(count) +
                    " numbers with commas between, not " + std::to_string(numbers.size()));
}

Result<std::vector<int>> selectVertices(const std::vector<std::string>& selections,
                                        const TriangleMesh& mesh) {
  std::set<int> chosen;
  for (const std::string& selection : selections) {
    if (selection.starts_with(kBox)) {
      if (auto ok = addBox(selection, mesh, chosen); !ok) return ok.error();
      continue;
    }
    for (const std::string_view piece : pieces(selection, ',')) {
      if (auto ok = addRange(piece, mesh.vertexCount(), chosen); !ok) return ok.error();
    }
  }
  return std::vector<int>(chosen.begin(), chosen.end());
}

}  // namespace tenter::app
