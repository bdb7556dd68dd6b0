// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace tenter {
namespace {

TEST(ErrorTest, MessageLeavesOutWhatIsEmpty) {
  EXPECT_EQ(badInput("a.obj", "line 3", "is short", "cut again").message(),
            "a.obj: line 3: is short (cut again)");
  EXPECT_EQ(badInput("a.obj", "", "is short").message(), "a.obj: is short");
  EXPECT_EQ(badInput("", "line 3", "is short").message(), "line 3: is short");
  EXPECT_EQ(notConverged("is far away").message(), "is far away");
}

TEST(ErrorTest, KindsAreTheExitCodes) {
  EXPECT_EQ(static_cast<int>(usageError("no file").kind), 2);
  EXPECT_EQ(static_cast<int>(badInput("", "", "").kind), 3);
  EXPECT_EQ(static_cast<int>(notConverged("").kind), 5);
}

TEST(ErrorTest, InRenamesTheFileOnly) {
  const Error error = badInput("x", "row 2", "why", "how").in("y");
  EXPECT_EQ(error.message(), "y: row 2: why (how)");
}

TEST(ResultTest, HoldsAValueThatMovesOut) {
  Result<std::unique_ptr<int>> result(std::make_unique<int>(7));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(**std::move(result), 7);
}

TEST(ResultTest, ReadingTheValueOfAnErrorIsACallersBug) {
  const Result<int> result = badInput("f", "", "bad");
  EXPECT_FALSE(result);
  EXPECT_EQ(result.error().reason, "bad");
  EXPECT_THROW(static_cast<void>(result.value()), std::logic_error);
}

TEST(ResultTest, VoidIsOkUnlessItHasAnError) {
  EXPECT_TRUE(Result<void>().ok());
  EXPECT_FALSE(Result<void>(usageError("x")).ok());
}

TEST(RequireTest, ThrowsForCallersBugs) {
  EXPECT_NO_THROW(require(true, "fine"));
  EXPECT_THROW(require(false, "not fine"), std::invalid_argument);
}

}  // namespace
}  // namespace tenter
