// The patches that CONTRIBUTING.md shows as examples apply to this tree.
#include <cstdlib>
#include <string>

#include <catch2/catch.hpp>

#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

bool applies(const std::string& patches) {
  const std::string command = "cd '" + source_dir().string() + "/tests/examples' && cat " +
                              patches + " | git -C ../.. apply --check -";
  return std::system(command.c_str()) == 0;
}

}  // namespace

TEST_CASE("the examples of CONTRIBUTING.md apply", "[examples]") {
  CHECK(applies("stage.diff"));
  CHECK(applies("stage.diff model.diff"));
  CHECK(applies("format.diff"));
  CHECK_FALSE(applies("model.diff"));  // it changes what stage.diff adds
}

}  // namespace posed::test
