// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace tenter::test_support {

/// Memory that this thread has asked for so far, in calls of malloc, calloc and operator new from
/// the code under test and its header libraries (Eigen). The linker routes them here: see
/// CMakeLists.txt.
std::size_t allocationCount();

}  // namespace tenter::test_support
