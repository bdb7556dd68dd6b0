// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::TemporaryFolder;
using ::testing::HasSubstr;

TEST(Usage, HelpListsEveryVerbAndExitsWithZero) {
  TemporaryFolder folder;
  const Outcome help = tenter({"--help"}, folder.path());
  EXPECT_EQ(help.exit_code, 0);
  for (const char* verb : {"import", "fit", "evaluate", "material", "export", "drape", "twin",
                           "correlate", "protocol", "version"}) {
    EXPECT_THAT(help.out, HasSubstr(verb));
    EXPECT_EQ(tenter({verb, "--help"}, folder.path()).exit_code, 0) << verb;
  }
}

TEST(Usage, WrongArgumentsExitWithTwo) {
  TemporaryFolder folder;
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"weave"},
      {"--colour"},
      {"fit"},
      {"fit", "a", "-o", "m.json", "--nodes", "many"},
      {"fit", "a", "-o", "m.json", "--variant", "crooked"},
      {"import"},
      {"import", "tensile", "a.csv", "-o", "m"},
      {"import", "cantilever", "--length-mm", "75", "--reach-mm", "30", "--angle-deg", "0",
       "--areal-density-kg-m2", "0.06", "-o", "m"},
      {"export", "m.json", "--to", "maya", "-o", "x"},
      {"twin", "capture", "--fabric", "denim-14"},
      {"drape", "x.obj", "--rho", "0.1", "--fix", "0", "-o", "x.vtp"}};
  for (const auto& arguments : wrong) {
    const Outcome outcome = tenter(arguments, folder.path());
    std::string shown;
    for (const auto& argument : arguments) shown += argument + " ";
    EXPECT_EQ(outcome.exit_code, 2) << shown << outcome.err;
    EXPECT_FALSE(outcome.err.empty()) << shown;
  }
  EXPECT_TRUE(test_support::listFolder(folder.path()).empty());
}

TEST(Usage, VersionAnswersWithOneJsonDocument) {
  TemporaryFolder folder;
  const Outcome outcome = tenter({"version", "--json"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_TRUE(outcome.json().contains("version"));
  EXPECT_EQ(tenter({"version", "--quiet"}, folder.path()).out, "");
}

TEST(Usage, ListsOfFabricsAndProtocols) {
  TemporaryFolder folder;
  EXPECT_EQ(tenter({"twin", "fabrics"}, folder.path()).out,
            "satin-4\nknit-12\ndenim-14\nwool-18\n");
  EXPECT_EQ(tenter({"protocol", "list"}, folder.path()).out,
            "stretch-weft\nstretch-warp\nshear\nbend-weft\nbend-warp\nbend-bias\ncomplex-shear\n"
            "corner-pull\n");
  EXPECT_EQ(tenter({"protocol", "list", "--json"}, folder.path()).json().at("protocols").size(),
            8u);
}

TEST(Usage, AnErrorIsInTheJsonAnswerToo) {
  TemporaryFolder folder;
  const Outcome outcome = tenter({"material", "check", "none.json", "--json"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(outcome.json().at("error").at("file"), "none.json");
  EXPECT_EQ(outcome.json().at("error").at("exit_code"), 3);
}

}  // namespace
}  // namespace tenter::system_test
