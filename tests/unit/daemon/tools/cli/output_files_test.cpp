// The rules for files that commands write.
#include "daemon/tools/command/output_files.hpp"

#include <catch2/catch.hpp>

#include "tests/support/temp_folder.hpp"

namespace posed::tools {
namespace {

bool refused(const Result<>& done, const std::string& why) {
  if (done) return false;
  UNSCOPED_INFO(done.error().text());
  return done.error().exit_code == ExitCode::kWrongUse && done.error().message.contains(why);
}

}  // namespace

TEST_CASE("an output must not have the extension of another format") {
  const test::TempFolder folder;
  const auto path = [&](const char* name) { return folder.path() / name; };
  CHECK(OutputFiles(false).writes(path("a.bvh"), {".bvh"}).check());
  CHECK(OutputFiles(false).writes(path("a.BVH"), {".bvh"}).check());
  CHECK(refused(OutputFiles(false).writes(path("a.csv"), {".bvh"}).check(), "in .bvh"));
  CHECK(refused(OutputFiles(false).writes(path("a"), {".bvh", ".csv"}).check(), ".bvh or .csv"));
  CHECK(refused(OutputFiles(false).writes(path("a.fbx"), {".bvh", ".glb"}).check(), "name a .glb"));
  CHECK(refused(OutputFiles(false).writes(path("a.fbx"), {".style"}).check(), "in .style"));
  // A format that is recognised by its contents may have any extension except those of other
  // formats.
  CHECK(OutputFiles(false).writes_any_but_other(path("a.model"), {".style"}).check());
  CHECK(refused(OutputFiles(false).writes_any_but_other(path("a.bvh"), {".style"}).check(),
                "in .style"));
}

TEST_CASE("an input is never overwritten, by whatever path it is named") {
  const test::TempFolder folder;
  const auto in = folder.write("in.csv", "x");
  const auto link = folder.path() / "link.csv";
  std::filesystem::create_symlink(in, link);
  for (const auto& out : {in, link, folder.path() / "." / "in.csv"}) {
    CHECK(refused(OutputFiles(true).reads(in).writes(out, {".csv"}).check(), "nothing is lost"));
  }
}

TEST_CASE("an existing file is replaced only with --overwrite") {
  const test::TempFolder folder;
  const auto out = folder.write("out.csv", "x");
  CHECK(refused(OutputFiles(false).writes(out, {".csv"}).check(), "--overwrite"));
  CHECK(OutputFiles(true).writes(out, {".csv"}).check());
}

TEST_CASE("folders, devices and unwritable places are refused as outputs") {
  const test::TempFolder folder;
  const auto& here = folder.path();
  std::filesystem::create_directory(here / "a.style");
  CHECK(refused(OutputFiles(true).writes(here / "a.style", {".style"}).check(), "is a folder"));
  CHECK(refused(OutputFiles(true).writes_any_but_other("/dev/null", {".style"}).check(),
                "not a regular file"));
  CHECK(refused(OutputFiles(true).writes(here / "no" / "b.style", {".style"}).check(),
                "folder is not there"));
}

TEST_CASE("two outputs must be different files") {
  const test::TempFolder folder;
  const auto a = folder.path() / "a.svg";
  CHECK(refused(OutputFiles(true).writes(a, {".svg"}).writes(a, {".svg"}).check(), "twice"));
}

}  // namespace posed::tools
