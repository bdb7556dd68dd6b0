// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace tenter {

/// First degree of freedom of each vertex, -1 if it is held: free vertices come first among a
/// ClothSystem's degrees of freedom, in order, three each.
inline std::vector<int> firstDofs(int vertices, const std::vector<int>& held) {
  std::vector<int> first(static_cast<std::size_t>(vertices), 0);
  for (const int v : held) first[static_cast<std::size_t>(v)] = -1;
  int next = 0;
  for (int& dof : first) {
    if (dof < 0) continue;
    dof = next;
    next += 3;
  }
  return first;
}

/// Coordinates (3 a vertex) in the order of those degrees of freedom.
inline std::vector<int> freeCoordinates(int vertices, const std::vector<int>& held) {
  const std::vector<int> first = firstDofs(vertices, held);
  std::vector<int> free;
  for (int v = 0; v < vertices; ++v)
    for (int a = 0; a < 3 && first[static_cast<std::size_t>(v)] >= 0; ++a)
      free.push_back(3 * v + a);
  return free;
}

}  // namespace tenter
