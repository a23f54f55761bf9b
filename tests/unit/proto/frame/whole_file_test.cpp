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

TEST_CASE("a file that somebody else made meanwhile is kept, and so is what was to be written") {
  const test::TempFolder folder;
  const auto path = folder.path() / "take.bvh";
  never_replace(path);
  folder.write("take.bvh", "theirs");
  const auto refused = write_whole_file(path, [](std::ostream& out) { out << "ours"; });
  REQUIRE_FALSE(refused);
  CHECK(test::file_text(path) == "theirs");
  const std::string& sentence = refused.error().message;
  CHECK(test::file_text(sentence.substr(sentence.rfind(' ') + 1)) == "ours");
  std::filesystem::remove(path);
  for (const char* text : {"first", "second"}) {  // its own file it may write again
    REQUIRE(write_whole_file(path, [&](std::ostream& out) { out << text; }));
    CHECK(test::file_text(path) == text);
  }
}

TEST_CASE("a link is written through, and one whose file is not there stays") {
  const test::TempFolder folder;
  const auto link = folder.path() / "link.bvh";
  std::filesystem::create_symlink("there.bvh", link);
  const auto write = [&] { return write_whole_file(link, "pose"); };
  REQUIRE_FALSE(write());
  CHECK(std::filesystem::is_symlink(link));
  const auto there = folder.write("there.bvh", "");
  REQUIRE(write());
  CHECK(std::filesystem::is_symlink(link));
  CHECK(test::file_text(there) == "pose");
}

TEST_CASE("a file that is written piece by piece has its name when it is whole") {
  const test::TempFolder folder;
  const auto path = folder.write("frames.bin", "before");
  {
    auto file = WholeFile::open(path);
    REQUIRE(file);
    file->out() << "half" << std::flush;
    CHECK(test::file_text(path) == "before");
  }
  CHECK(test::file_text(path) == "before");
  CHECK(files_in(folder.path()) == 1);
  auto file = WholeFile::open(path);
  REQUIRE(file);
  file->out() << "whole";
  REQUIRE(file->keep());
  CHECK(test::file_text(path) == "whole");
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
