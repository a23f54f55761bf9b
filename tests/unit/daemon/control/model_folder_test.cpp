#include "daemon/control/model_folder.hpp"

#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/style/model/style_model.hpp"
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

TEST_CASE("a model that is kept replaces none, and its name stays in the folder") {
  const test::TempFolder folder;
  const auto models = ModelFolder::open(folder.path()).value();
  const auto keep = [&](const std::string& bytes) { return models.add("proud", bytes).value(); };
  CHECK(keep("one") == "proud.style");
  CHECK(keep("two") == "proud-2.style");
  CHECK(keep("three") == "proud-3.style");
  CHECK(models.read("proud.style").value() == "one");
  CHECK(models.read("proud-2.style").value() == "two");
  CHECK(models.list()->size() == 3);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 3);
  CHECK_FALSE(ModelFolder().add("proud", "one"));
}

}  // namespace posed::control
