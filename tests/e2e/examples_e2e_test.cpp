// The patches of this repository apply to this tree: those that CONTRIBUTING.md shows as examples,
// and the faults that the tests must find.
#include <cstdlib>
#include <filesystem>
#include <string>

#include <catch2/catch.hpp>

#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

// `patches`: their names in a folder beside this one.
bool applies(const std::string& folder, const std::string& patches) {
  const std::string command = "cd '" + (source_dir() / "tests" / folder).string() + "' && cat " +
                              patches + " | git -C ../.. apply --check -";
  return std::system(command.c_str()) == 0;
}

}  // namespace

TEST_CASE("the examples of CONTRIBUTING.md apply", "[examples]") {
  CHECK(applies("examples", "stage.diff"));
  CHECK(applies("examples", "stage.diff model.diff"));
  CHECK(applies("examples", "format.diff"));
  CHECK(applies("examples", "glove.diff"));
  CHECK(applies("examples", "parameter.diff"));
  CHECK_FALSE(applies("examples", "model.diff"));  // it changes what stage.diff adds
}

TEST_CASE("the planted faults apply", "[examples]") {
  int faults = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() / "tests/faults")) {
    if (entry.path().extension() != ".diff") continue;
    INFO(entry.path());
    CHECK(applies("faults", entry.path().filename().string()));
    ++faults;
  }
  CHECK(faults >= 6);
}

}  // namespace posed::test
