// Clips named on the command line: with a person before the colon, or without.
#include "daemon/cli/models/experiment.hpp"

#include <catch2/catch.hpp>

using namespace posed::cli;

TEST_CASE("the part before a colon is the person, unless it is a folder", "[experiment]") {
  const auto person = named_clip("ann:walks/a.bvh", "from", "walk");
  CHECK(person.subject == "ann");
  CHECK(person.file == "walks/a.bvh");
  CHECK(person.group == "from");
  CHECK(person.motion == "walk");
  for (const char* file : {"old/ann:walk.bvh", "/old:new/walk.bvh", "walk.bvh", ":walk.bvh"}) {
    const auto nobody = named_clip(file, "to", "walk");
    INFO(file);
    CHECK(nobody.subject == kOnePerson);
    CHECK(nobody.file == file);
  }
}
