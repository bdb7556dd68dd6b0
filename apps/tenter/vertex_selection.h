// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/core/mesh.h"

namespace tenter::app {

/// Vertices named on the command line: "0,99", "4-17", "box:x0,y0,z0,x1,y1,z1" (all inside the box
/// [m]); several join. Sorted, each once. Usage error that quotes what it cannot read; an id beyond
/// the mesh, or a box without vertices, is one too.
Result<std::vector<int>> selectVertices(const std::vector<std::string>& selections,
                                        const TriangleMesh& mesh);

/// "x,y,z".
Result<std::vector<double>> parseNumbers(const std::string& text, std::size_t count,
                                         const std::string& option);

}  // namespace tenter::app
