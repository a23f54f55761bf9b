// Which files of a folder `eval natural` takes for its corpus.
#include "daemon/tools/style/natural_clips.hpp"

#include <catch2/catch.hpp>

#include <filesystem>

#include "daemon/tools/command/ranks.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "tests/support/has.hpp"
#include "tests/support/permission.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::tools {
namespace {

namespace fs = std::filesystem;

// Four walkers in folders of their own.
struct WalkerFolders {
  test::TempFolder folder;

  WalkerFolders() {
    fs::permissions(folder.path(), fs::perms::others_read | fs::perms::others_exec,
                    fs::perm_options::add);
    for (std::uint32_t person = 1; person <= 4; ++person) {
      fs::create_directory(of(person));
      const auto clip = motion::make_walker({.person = person, .seconds = 4.0});
      REQUIRE(clip::write_bvh(*clip, of(person) / "walk.bvh"));
    }
  }
  [[nodiscard]] fs::path of(std::uint32_t person) const {
    return folder.path() / std::to_string(person);
  }
  Result<NaturalClips> read() const {
    ThreadTasks tasks(1);
    return read_natural_clips(
        {.clip = of(1) / "walk.bvh", .corpus = folder.path(), .skeleton = {}, .hand = {}}, tasks,
        {});
  }
};

}  // namespace

TEST_CASE("a corpus is read with all its folders, or the one that is shut is named", "[natural]") {
  const WalkerFolders walkers;
  const auto all = walkers.read();
  REQUIRE(all);
  CHECK(all->corpus.size() == 3);
  CHECK(all->left_out.size() == 1);  // the clip itself
  for (std::uint32_t shut = 2; shut <= 4; ++shut) {
    fs::permissions(walkers.of(shut), fs::perms::none);
    const auto cut = [&] {
      const test::AsNobody nobody;
      return walkers.read();
    }();
    fs::permissions(walkers.of(shut), fs::perms::owner_all);
    REQUIRE_FALSE(cut);
    CHECK(test::has(cut.error().text(), walkers.of(shut).string() + ": cannot be read: "));
    fs::permissions(walkers.of(shut), fs::perms::others_all, fs::perm_options::add);
  }
}

}  // namespace posed::tools
