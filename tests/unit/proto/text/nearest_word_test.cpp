#include "proto/text/nearest_word.hpp"

#include <catch2/catch.hpp>

namespace posed {
namespace {

TEST_CASE("a mistyped word has a nearest one") {
  CHECK(nearest("walkr", {"run", "walk"}) == "walk");
  CHECK(nearest("elephant", {"run", "walk"}).empty());
  // Two swapped letters are one mistake, so they win over two others.
  CHECK(nearest("--form", {"--force", "--from"}) == "--from");
  CHECK(nearest("wlak", {"flag", "walk"}) == "walk");
  CHECK(nearest("", {}).empty());
}

}  // namespace
}  // namespace posed
