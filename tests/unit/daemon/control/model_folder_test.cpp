#include "daemon/control/model_folder.hpp"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "daemon/control/model_words.hpp"
#include "daemon/control/recording_folder.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/model/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/load_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::control {

TEST_CASE("a model is read by its name in the folder's list, and by nothing else") {
  const test::TempFolder home;
  const auto folder = home.path() / "models";
  create_directory(folder);
  for (const auto& path : {folder / "b.style", folder / "a.gesture", home.path() / "c.style",
                           folder / "notes.txt", folder / "bad\x1bname.style"}) {
    REQUIRE(style::save_model(test::toy_model(1, 0.3), path));
  }
  create_directory(folder / "d.style");
  const auto models = ModelFolder::open(folder);
  REQUIRE(models);
  const auto list = models->list();
  REQUIRE(list);
  REQUIRE(list->size() == 2);
  CHECK(list->at(0).name == "a.gesture");
  CHECK(list->at(0).kind == "generate");
  CHECK(list->at(1).name == "b.style");
  CHECK(list->at(1).kind == "style");
  CHECK(models->read("b.style"));
  const std::string whole = folder / "b.style";
  for (const std::string& name : std::vector<std::string>{"../c.style", "./b.style", whole,
                                                          "notes.txt", "d.style", "", "."}) {
    const auto read = models->read(name);
    REQUIRE_FALSE(read);
    CHECK(read.error().message.contains("there is no model"));
  }
}

TEST_CASE("without a folder the list is empty; a folder that is gone is told") {
  CHECK(ModelFolder().list().value().empty());
  CHECK_FALSE(ModelFolder().read("a.style"));
  const test::TempFolder home;
  const auto folder = home.path() / "models";
  const auto never = ModelFolder::open(folder);
  REQUIRE_FALSE(never);
  CHECK(never.error().text().contains(folder.string()));
  create_directory(folder);
  const auto models = ModelFolder::open(folder);
  REQUIRE(models);
  remove(folder);
  const auto gone = models->list();
  REQUIRE_FALSE(gone);
  CHECK(gone.error().text().contains(folder.string()));
}

TEST_CASE("a model gets another name or is deleted; nothing else is touched") {
  const test::TempFolder home;
  const auto folder = home.path() / "models";
  create_directory(folder);
  for (const auto& path : {folder / "a.style", folder / "b.style", home.path() / "c.style"}) {
    REQUIRE(style::save_model(test::toy_model(1, 0.3), path));
  }
  const auto models = ModelFolder::open(folder).value();
  CHECK(models.rename("a.style", "walk-2").value() == "walk-2.style");
  for (const std::string& to :
       std::vector<std::string>{"../c", "", ".hidden", "UP", "a/b", "b.x"}) {
    CHECK_FALSE(models.rename("walk-2.style", to));
  }
  CHECK(models.rename("walk-2.style", "b").error().message.contains("already"));
  CHECK_FALSE(models.rename("../c.style", "d"));
  CHECK_FALSE(models.remove("../c.style"));
  CHECK_FALSE(models.remove("."));
  CHECK(models.remove("b.style"));
  CHECK_FALSE(models.remove("b.style"));
  CHECK(models.list().value().size() == 1);
  CHECK(exists(home.path() / "c.style"));
  CHECK_FALSE(ModelFolder().remove("b.style"));
}

TEST_CASE("a model tells what it was learnt from; what is no model tells that") {
  auto model = test::toy_model(1, 0.3);
  model.from = "walk";
  model.to = "sneak";
  model.report_json = R"({"clips":[{"subject":"ann","day":"1"},{"subject":"ann","day":"1"},7],)"
                      R"("verdict":"closes 9 %"})";
  const auto words = words_of_model(style::serialize_model(model), "style", "a.style");
  CHECK(words.learnt == "turns walk into sneak, from 2 clips of ann on day 1");
  CHECK(words.verdict == "closes 9 %");
  CHECK(words.skeleton.contains("joint"));
  for (const char* report : {"", "[1]", "{\"clips\":3,\"verdict\":[]}", "{"}) {
    model.report_json = report;
    CHECK(words_of_model(style::serialize_model(model), "style", "a").learnt ==
          "turns walk into sneak");
  }
  const std::string deep(200'000, '[');
  for (const std::string& report :
       std::vector<std::string>{"{\"clips\":" + deep + std::string(deep.size(), ']') + "}",
                                "{\"clips\":[[]" + std::string(3UL * 1024 * 1024, ',') + "[]]}"}) {
    model.report_json = report;
    CHECK(words_of_model(style::serialize_model(model), "style", "a").learnt ==
          "turns walk into sneak");
  }
  CHECK(words_of_model("nonsense", "style", "a.style").verdict.contains("a.style"));
  CHECK(words.strip.empty());  // it knows no cycle
  CHECK_FALSE(words_of_model("nonsense", "generate", "a.gesture").verdict.empty());
}

TEST_CASE("a part of a take is had as .glb and .vrma, which leave nothing in the folder") {
  const test::TempFolder folder;
  const auto walk = motion::make_walker({.seconds = 2.0}).value();
  REQUIRE(clip::write_clip(walk, folder.path() / "walk.bvh"));
  const RecordingFolder recordings(folder.path());
  const RecordingFolder::Part part{.name = "walk.bvh", .as = "glb", .from_s = 0.5, .to_s = 1.5};
  const auto glb = clip::parse_clip({.name = "a.glb", .bytes = recordings.converted(part).value()});
  CHECK(glb.value().frames() == 30);
  auto other = part;
  other.as = "vrma";
  CHECK(recordings.converted(other).value().starts_with("glTF"));
  CHECK(recordings.list().value().size() == 1);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
  std::string bomb;
  for (int i = 0; i < 1'600'000; ++i) bomb += "0 ";
  folder.write("bomb.bvh", bomb);
  CHECK(recordings.converted({.name = "bomb.bvh", .as = "glb"}).error().message.contains("long"));
  std::filesystem::remove(folder.path() / "bomb.bvh");
  folder.write(".walk.bvh.glb", "somebody's");
  CHECK(recordings.converted(part));
  CHECK(load_file(folder.path() / ".walk.bvh.glb", {.what = "file", .max_bytes = 99}).value() ==
        "somebody's");
  for (const RecordingFolder::Part& wrong :
       {RecordingFolder::Part{.name = "walk.bvh", .as = "exe"},
        RecordingFolder::Part{.name = "../walk.bvh", .as = "glb"},
        RecordingFolder::Part{.name = "walk.bvh", .as = "glb", .from_s = 3.0},
        RecordingFolder::Part{.name = "walk.bvh", .as = "glb", .from_s = std::nan("")}}) {
    CHECK_FALSE(recordings.converted(wrong));
  }
}

TEST_CASE("recordings are listed and read by their names in the folder, and by nothing else") {
  const test::TempFolder home;
  const auto folder = home.path() / "takes";
  CHECK(RecordingFolder(folder).list().value().empty());  // it is made by the first recording
  CHECK(RecordingFolder().list().error().message.contains("recordings ="));
  create_directory(folder);
  const std::string large(kMaxRecordingPiece + 5, 'x');
  for (const auto& path : {folder / "a.bvh", folder / "b.plog", folder / "b.plog-wal",
                           folder / "notes.txt", folder / ".c.bvh", home.path() / "d.bvh"}) {
    REQUIRE(write_whole_file(path, large));
  }
  std::filesystem::create_symlink(home.path() / "d.bvh", folder / "e.bvh");
  create_directory(folder / "f.bvh");
  const RecordingFolder recordings(folder);
  const auto list = recordings.list().value();
  REQUIRE(list.size() == 2);
  const bool log_first = list.front().name == "b.plog";
  CHECK(list[log_first ? 1 : 0].name == "a.bvh");
  CHECK(list[log_first ? 0 : 1].in_use);
  CHECK(recordings.piece("a.bvh", 0).value() == large.substr(5));
  CHECK(recordings.piece("a.bvh", kMaxRecordingPiece).value() == "xxxxx");
  CHECK(recordings.piece("a.bvh", ~std::uint64_t{0}).value().empty());
  CHECK(recordings.piece("b.plog", 0).error().message.contains("being written"));
  for (const std::string& name : std::vector<std::string>{
           "../d.bvh", "e.bvh", "f.bvh", "g.bvh", "notes.txt", ".c.bvh",
           (folder / "a.bvh").string(), "./a.bvh", "", ".", std::string("a.bvh\0.bvh", 10)}) {
    CHECK_FALSE(recordings.piece(name, 0));
  }
  // However many others there are, which the list leaves out.
  for (int i = 0; i < 300; ++i) {
    REQUIRE(write_whole_file(folder / (std::to_string(i) + ".bvh"), "later"));
  }
  const auto now = std::filesystem::file_time_type::clock::now();
  last_write_time(folder / "a.bvh", now - std::chrono::hours(1));
  CHECK(recordings.piece("a.bvh", kMaxRecordingPiece).value() == "xxxxx");
}

// A process that closes a file loses its locks on it, which keep others from a log's -wal file.
TEST_CASE("a recording that is being written is not opened") {
  const test::TempFolder folder;
  for (const char* name : {"a.plog", "a.plog-wal"}) folder.write(name, "x");
  const std::string log = folder.path() / "a.plog";
  const int writer = open(log.c_str(), O_RDWR | O_CLOEXEC);
  struct flock lock{};
  lock.l_type = F_RDLCK;
  lock.l_whence = SEEK_SET;
  REQUIRE(fcntl(writer, F_SETLK, &lock) == 0);
  CHECK_FALSE(RecordingFolder(folder.path()).piece("a.plog", 0));
  // Nor under another name, beside which no -wal lies.
  const std::string link = folder.path() / "link.plog";
  std::filesystem::create_hard_link(log, link);
  const auto refused = RecordingFolder(folder.path()).piece("link.plog", 0);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.contains("being written"));
  CHECK_FALSE(load_file(link, {.what = "model", .max_bytes = 100}));
  const int other = open(log.c_str(), O_RDWR | O_CLOEXEC);
  lock.l_type = F_WRLCK;
  REQUIRE(fcntl(other, F_OFD_GETLK, &lock) == 0);
  CHECK(lock.l_type == F_RDLCK);
  close(other);
  close(writer);
  CHECK(RecordingFolder(folder.path()).piece("link.plog", 0).value() == "x");
}

TEST_CASE("calibrations count among the files that a folder of models may have") {
  const test::TempFolder folder;
  const auto models = ModelFolder::open(folder.path()).value();
  for (int i = 0; i < 256; ++i) {
    REQUIRE(models.add("c" + std::to_string(i), kCalibration, "x"));
  }
  const auto full = models.add("more", kCalibration, "x");
  REQUIRE_FALSE(full);
  CHECK(full.error().message.contains("is full"));
}

TEST_CASE("a model that is kept replaces none, and its name stays in the folder") {
  const test::TempFolder folder;
  const auto models = ModelFolder::open(folder.path()).value();
  const auto keep = [&](const std::string& bytes) {
    return models.add("proud", "style", bytes).value();
  };
  CHECK(keep("one") == "proud.style");
  CHECK(keep("two") == "proud-2.style");
  CHECK(keep("three") == "proud-3.style");
  CHECK(models.read("proud.style").value() == "one");
  CHECK(models.read("proud-2.style").value() == "two");
  CHECK(models.list()->size() == 3);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 3);
  CHECK_FALSE(ModelFolder().add("proud", "style", "one"));
}

}  // namespace posed::control
