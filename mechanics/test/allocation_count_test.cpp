// SPDX-License-Identifier: GPL-3.0-or-later
#include "allocation_count.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdlib>
#include <vector>

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): names that the linker
// gives.
namespace {
// Volatile, since compilers know that malloc writes no variable of the program.
thread_local volatile std::size_t count = 0;
}  // namespace

extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t items, std::size_t size);
void* __real__Znwm(std::size_t size);
void* __real__Znam(std::size_t size);
void* __wrap_malloc(std::size_t size) {
  count = count + 1;
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t items, std::size_t size) {
  count = count + 1;
  return __real_calloc(items, size);
}
void* __wrap__Znwm(std::size_t size) {
  count = count + 1;
  return __real__Znwm(size);
}
void* __wrap__Znam(std::size_t size) {
  count = count + 1;
  return __real__Znam(size);
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace tenter::test_support {

std::size_t allocationCount() { return count; }

namespace {

TEST(AllocationCount, SeesVectorsObjectsAndEigen) {
  std::size_t before = allocationCount();
  const std::vector<double> numbers(100, 1.0);
  EXPECT_GT(allocationCount(), before);
  before = allocationCount();
  const Eigen::VectorXd vector = Eigen::VectorXd::Zero(100);
  EXPECT_GT(allocationCount(), before);
  before = allocationCount();
  EXPECT_EQ(vector.sum() + numbers.front(), 1.0);
  EXPECT_EQ(allocationCount(), before);
}

}  // namespace
}  // namespace tenter::test_support
