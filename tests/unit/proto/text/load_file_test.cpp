#include "proto/text/load_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "proto/clip/clip.hpp"
#include "proto/clip/label_file.hpp"
#include "proto/model/model_file.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed {
namespace {

constexpr FileRule kRule{.what = "calibration", .max_bytes = 1000};

std::string load_refusal(const std::filesystem::path& path) {
  const auto read = load_file(path, kRule);
  REQUIRE_FALSE(read);
  CHECK(read.error().file == path.string());
  return read.error().message;
}

TEST_CASE("a whole file is read, up to its limit", "[load_file]") {
  const test::TempFolder folder;
  for (const std::size_t size : {0U, 1U, 999U, 1000U}) {
    const std::string text(size, 'x');
    CHECK(load_file(folder.write("file", text), kRule).value() == text);
  }
  CHECK(load_refusal(folder.write("large", std::string(1001, 'x')))
            .contains("that is no calibration"));
  const std::string large(300'000, 'y');
  CHECK(load_file(folder.write("large", large), {.what = "clip", .max_bytes = 300'000}).value() ==
        large);
}

TEST_CASE("a file in /proc, which states no size, is read and bounded, too", "[load_file]") {
  CHECK(load_file("/proc/self/stat", {.what = "file", .max_bytes = 100'000}).value().size() > 10);
  CHECK_FALSE(load_file("/proc/self/stat", {.what = "file", .max_bytes = 3}));
}

TEST_CASE("anything but a regular file is refused at once, with an error message", "[load_file]") {
  const test::TempFolder folder;
  CHECK(load_refusal(folder.path()) == "this is a folder; name a calibration in it");
  CHECK(load_refusal("/dev/zero").contains("device or a pipe"));
  const auto pipe = folder.path() / "pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(load_refusal(pipe).contains(
      "device or a pipe"));  // nobody writes to it, so a plain open would block
  CHECK(load_refusal(folder.path() / "none").contains("cannot read the calibration: No such file"));
  CHECK(load_refusal({}).contains("cannot read the calibration"));
}

TEST_CASE("a file without permission is refused with the system's reason", "[load_file]") {
  const test::TempFolder folder;
  const auto path = folder.write("secret", "x");
  REQUIRE(chmod(path.c_str(), 0) == 0);
  if (geteuid() == 0) {
    WARN("SKIPPED: root may read every file");
    return;
  }
  CHECK(load_refusal(path).contains("Permission denied"));
}

TEST_CASE("clips, labels and models are read through it", "[load_file]") {
  const test::TempFolder folder;
  const auto folder_named = [&](const std::string& name) {
    std::filesystem::create_directory(folder.path() / name);
    return folder.path() / name;
  };
  CHECK(clip::read_clip(folder_named("a.bvh")).error().message.contains("this is a folder"));
  CHECK(clip::read_labels(folder_named("a.lab")).error().message.contains("this is a folder"));
  CHECK(model_file::load(folder_named("a.style")).error().message.contains("this is a folder"));
  CHECK(model_file::load("/dev/zero").error().message.contains("device or a pipe"));
  CHECK(clip::read_labels("/dev/zero").error().message.contains("device or a pipe"));
}

}  // namespace
}  // namespace posed
