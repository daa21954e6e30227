#include "daemon/config/changed_keys.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using Keys = std::vector<std::string>;

TEST(ChangedKeys, CommentsOrderAndBlanksAreNoChange) {
  EXPECT_EQ(changed_keys("[a]\nx = 1\ny = [1, 2]\n", "# new\n[a]\ny = [ 1,2 ]\nx=1"), Keys{});
}

TEST(ChangedKeys, AnotherValueANewKeyAndAVanishedKeyAreNamed) {
  EXPECT_EQ(changed_keys("[a]\nx = 1\ngone = true\n", "[a]\nx = 2\nnew = 'n'\n"),
            (Keys{"a.gone", "a.new", "a.x"}));
}

TEST(ChangedKeys, TablesOfAListAreCountedFromOne) {
  EXPECT_EQ(changed_keys("[[camera]]\nfx = 1.0\n[[camera]]\nfx = 2.0\n",
                         "[[camera]]\nfx = 1.0\n[[camera]]\nfx = 3.0\n"),
            Keys{"camera[2].fx"});
}

TEST(ChangedKeys, AListOfNumbersIsOneValue) {
  EXPECT_EQ(changed_keys("cpus = [1, 2]", "cpus = [1, 3]"), Keys{"cpus"});
}

}  // namespace
}  // namespace tubed
