// A file is written completely or not at all.
#include "proto/frame/whole_file.hpp"

#include <catch2/catch.hpp>

#include <iterator>
#include <ostream>

#include "tests/support/file_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed {
namespace {

std::size_t files_in(const std::filesystem::path& folder) {
  const std::filesystem::directory_iterator entries(folder);
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

}  // namespace

TEST_CASE("a file that cannot be written to its end leaves what was there, and nothing beside it") {
  const test::TempFolder folder;
  const auto path = folder.write("take.bvh", "before");
  const auto failed = write_whole_file(path, [](std::ostream& out) {
    out << "half";
    out.setstate(std::ios::badbit);
  });
  CHECK_FALSE(failed);
  CHECK(test::file_text(path) == "before");
  CHECK(files_in(folder.path()) == 1);
  REQUIRE(write_whole_file(path, [](std::ostream& out) { out << "after"; }));
  CHECK(test::file_text(path) == "after");
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("a symbolic link is kept: the file that it names is replaced") {
  const test::TempFolder folder;
  const auto path = folder.write("take.bvh", "before");
  const auto link = folder.path() / "link.bvh";
  std::filesystem::create_symlink(path, link);
  REQUIRE(write_whole_file(link, [](std::ostream& out) { out << "after"; }));
  CHECK(std::filesystem::is_symlink(link));
  CHECK(test::file_text(path) == "after");
}

TEST_CASE("a file in a folder that does not exist is an error that names it") {
  const test::TempFolder folder;
  const auto done =
      write_whole_file(folder.path() / "no/take.bvh", [](std::ostream& out) { out << "x"; });
  REQUIRE_FALSE(done);
  CHECK(done.error().file.ends_with("no/take.bvh"));
}

}  // namespace posed
