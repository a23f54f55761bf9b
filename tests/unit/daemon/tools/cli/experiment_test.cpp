// Clips named on the command line: with a person before the colon, or without.
#include "daemon/tools/style/experiment.hpp"

#include <catch2/catch.hpp>

#include <algorithm>

#include "tests/support/shared.hpp"

using namespace posed::tools;

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

TEST_CASE("the experiments that ship name twelve walkers in two styles", "[experiment]") {
  for (const char* name : {"sato-2011.toml", "acted-walks.toml"}) {
    const auto experiment =
        read_experiment(posed::test::source_dir() / "config/experiments" / name);
    INFO(name);
    REQUIRE(experiment);
    REQUIRE(experiment->targets.size() == 1);
    CHECK(experiment->mode == posed::style::TrainMode::kPaper);
    CHECK(experiment->clips.size() == 12);
    CHECK(std::ranges::count(experiment->clips, experiment->targets[0], &ExperimentClip::group) ==
          6);
    for (const ExperimentClip& clip : experiment->clips) CHECK(clip.motion == "walk");
  }
}
