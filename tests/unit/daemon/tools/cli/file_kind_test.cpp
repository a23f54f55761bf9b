#include "daemon/tools/command/file_kind.hpp"

#include <catch2/catch.hpp>

#include <string>

#include "tests/support/temp_folder.hpp"

namespace posed::tools {
namespace {

constexpr const char* kCalibration =
    "format = 1\ndriver = \"lucidgloves\"\nhand = \"right\"\n[sensors]\nindex = [[0, 0.0], [9, "
    "1.0]]\n";

TEST_CASE("files are recognised by their first bytes") {
  CHECK(kind_of("POSEDMDL\x01") == FileKind::kModel);
  CHECK(kind_of(std::string("SQLite format 3\0", 16)) == FileKind::kDeviceLog);
  CHECK(kind_of(kCalibration) == FileKind::kCalibration);
  CHECK(kind_of("# mine\n[[stream]]\nname = \"a\"\n") == FileKind::kConfig);
  CHECK(kind_of("HIERARCHY\nROOT Hips\n") == FileKind::kClip);
  CHECK(kind_of("time_s,thumb1_x_rad\n0,0\n") == FileKind::kClip);
  CHECK(kind_of(std::string(40, 'k') + "\n") == FileKind::kKey);
  CHECK(kind_of("hello") == FileKind::kOther);
  CHECK(kind_of(std::string(100, '\0')) == FileKind::kOther);
  CHECK(kind_of("") == FileKind::kOther);
}

TEST_CASE("the error for a wrong file says what it is and which command reads it") {
  const test::TempFolder folder;
  const auto style = folder.write("mine.style", "POSEDMDL and more");
  const auto fit = folder.write("ann.toml", kCalibration);
  CHECK(expect_kind(style, FileKind::kModel, "walker"));
  CHECK(expect_kind(fit, FileKind::kCalibration, "right"));
  const auto wrong = expect_kind(style, FileKind::kCalibration, "actor1");
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().message ==
        "is a model, not a glove's calibration; send it with `posed ctl "
        "model actor1 " +
            style.string() + "`");
  CHECK(wrong.error().file == style.string());
  const auto other = expect_kind(fit, FileKind::kModel, "right");
  REQUIRE_FALSE(other);
  CHECK(other.error().message.contains("posed ctl calibrate right"));
  // A file of unknown kind is no error here; the code that reads the whole file reports it.
  CHECK(expect_kind(folder.write("notes.txt", "hello"), FileKind::kModel, "walker"));
  CHECK(expect_kind(folder.write("empty", ""), FileKind::kModel, "walker"));
  CHECK(expect_kind(folder.path() / "none", FileKind::kModel, "walker"));
  CHECK(expect_kind("/dev/zero", FileKind::kModel, "walker"));
}

}  // namespace
}  // namespace posed::tools
