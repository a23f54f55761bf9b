// TOML that would overflow the parser's stack, and paths that are not regular files, given to the
// real binary in every possible way: it prints an error message and goes on.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <span>

#include <sqlite3.h>

#include "proto/log/database.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/emulated_glove.hpp"
#include "tests/support/permission.hpp"
#include "tests/support/toml_bombs.hpp"

namespace posed::test {
namespace {

// Checks for one error message on stderr, and that no signal ended the process.
void check_refused(const std::vector<std::string>& arguments, const std::string& part) {
  const ProgramOutcome outcome = posed(arguments);
  INFO(arguments[0] << " " << arguments[1] << ": " << outcome.err.substr(0, 500));
  CHECK((outcome.code == 1 || outcome.code == 2));
  CHECK(has(outcome.err, part));
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK(outcome.err.find('\x1b') == std::string::npos);
}

std::string stream_with(const std::string& more) {
  return std::string(Stage::kEndpoints) + "[[stream]]\nname = \"hand\"\n" + more;
}

// Writes `value` into a column of each row of a log's table that matches `where`, with a recomputed
// checksum, as an untrusted sender of a log could. Returns the number of rows.
int forge(const std::string& path, const std::string& table, const std::string& column,
          const std::string& value, const std::string& where = "1") {
  sqlite3* log = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &log) == SQLITE_OK);
  sqlite3_stmt* rows = nullptr;
  const std::string select = "SELECT * FROM " + table + " WHERE " + where;
  REQUIRE(sqlite3_prepare_v2(log, select.c_str(), -1, &rows, nullptr) == SQLITE_OK);
  std::vector<std::pair<std::int64_t, std::int64_t>> forged;  // id, checksum
  while (sqlite3_step(rows) == SQLITE_ROW) {
    log::Checksum sum;
    for (int c = 0; c + 1 < sqlite3_column_count(rows); ++c) {
      const auto* blob = static_cast<const char*>(sqlite3_column_blob(rows, c));
      std::string text(blob, blob + sqlite3_column_bytes(rows, c));
      if (sqlite3_column_name(rows, c) == column) text = value;
      if (sqlite3_column_type(rows, c) == SQLITE_INTEGER) {
        sum.add(sqlite3_column_int64(rows, c));
      } else {
        sum.add(std::as_bytes(std::span(text)));
      }
    }
    forged.emplace_back(sqlite3_column_int64(rows, 0), sum.value());
  }
  sqlite3_finalize(rows);
  for (const auto& [id, crc] : forged) {
    sqlite3_stmt* update = nullptr;
    const std::string change = "UPDATE " + table + " SET " + column + "=CAST(? AS " +
                               (column == "bytes" ? "BLOB" : "TEXT") + "), crc=? WHERE id=?";
    REQUIRE(sqlite3_prepare_v2(log, change.c_str(), -1, &update, nullptr) == SQLITE_OK);
    sqlite3_bind_blob(update, 1, value.data(), static_cast<int>(value.size()), SQLITE_STATIC);
    sqlite3_bind_int64(update, 2, crc);
    sqlite3_bind_int64(update, 3, id);
    CHECK(sqlite3_step(update) == SQLITE_DONE);
    sqlite3_finalize(update);
  }
  sqlite3_close(log);
  return static_cast<int>(forged.size());
}

TEST_CASE("TOML nested 31,000 deep gives one error message, whichever file contains it") {
  const Served served;
  const std::string deep = served.folder.write("deep.toml", toml_bombs()[0]).string();
  const std::string config = served.path("posed.toml");
  const std::string nests = "nests deeper";
  check_refused({"check", "--config", deep}, nests);
  served.folder.write("posed.toml", stream_with("driver = \"lucidgloves\"\nport = \"/dev/none\"\n"
                                                "calibration = \"deep.toml\"\n"));
  check_refused({"check", "--config", config}, nests);
  served.folder.write("posed.toml", stream_with("driver = \"described\"\n[stream.described]\n"
                                                "device = \"deep.toml\"\n"));
  check_refused({"check", "--config", config}, nests);
  check_refused({"train", "style", "--experiment", deep, "--out", served.path("a.style")}, nests);
}

TEST_CASE("a calibration nested 31,000 deep leaves the daemon running, and its log readable") {
  Served stage;
  const EmulatedGlove glove(stage.path("glove"), {"--set", "hand=right"});
  stage.folder.write("posed.toml", stream_with("driver = \"lucidgloves\"\nport = \"" +
                                               stage.path("glove") + "\"\nhand = \"right\"\n"));
  stage.record();
  for (const std::string& bomb : toml_bombs()) {
    const ProgramOutcome refused =
        stage.ctl({"calibrate", "hand", stage.folder.write("deep.toml", bomb).string()});
    CHECK(refused.code == 1);
    CHECK(has(refused.err, "nests deeper"));
  }
  const auto good = stage.folder.write("ann.toml",
                                       "format = 1\ndriver = \"lucidgloves\"\nhand = \"right\"\n"
                                       "[sensors]\nindex_joint1 = [[0, 0.0], [2000, 1.0]]\n");
  CHECK(stage.ctl({"calibrate", "hand", good.string()}).code == 0);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);

  // The same in a log from an untrusted source.
  CHECK(forge(stage.path("take.plog"), "chunk", "bytes", toml_bombs()[0], "direction=3") == 1);
  const ProgramOutcome replay = posed({"replay", stage.path("take.plog"), "--speed", "max"});
  INFO(replay.err.substr(0, 1000));
  CHECK(replay.code == 1);
  CHECK(has(replay.err, "nests deeper"));
  CHECK(replay.err.size() < 2000);
}

TEST_CASE("a path that is not a file gives one error message, whichever option or key names it") {
  const Served served;
  const std::string config = served.path("posed.toml");
  const std::string folder = served.folder.path().string();
  const auto with_model = [](const std::string& model) {
    return stream_with("driver = \"labels\"\n[stream.style]\nmodel = \"" + model + "\"\n");
  };
  const std::string is_device = "is a device or a pipe";
  const std::string is_folder = "this is a folder";
  for (const auto& [path, sentence] :
       {std::pair{folder, is_folder}, {std::string("/dev/zero"), is_device}}) {
    check_refused({"check", "--config", path}, sentence);
    served.folder.write("posed.toml", with_model(path));
    check_refused({"check", "--config", config}, sentence);
    check_refused({"train", "style", "--experiment", path, "--out", served.path("a.style")},
                  sentence);
    check_refused({"ctl", "model", "hand", path}, sentence);
    check_refused({"ctl", "calibrate", "hand", path}, sentence);
    check_refused(
        {"apply", "--model", path, served.path("walk.bvh"), "--out", served.path("out.bvh")},
        sentence);
  }
}

TEST_CASE("a log with escape sequences in its driver's name is refused without printing them") {
  Served stage;
  stage.record();
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  const std::string wild = "\x1b[2J" + std::string(1'000'000, 'x');
  CHECK(forge(stage.path("take.plog"), "source", "driver", wild) == 1);
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"replay", stage.path("take.plog"), "--speed", "max"},
        {"convert", stage.path("take.plog"), "--out", stage.path("out.bvh")}}) {
    const ProgramOutcome outcome = posed(arguments);
    INFO(outcome.err.substr(0, 1000));
    CHECK(outcome.code == 1);
    CHECK(outcome.err.size() < 2000);
    CHECK((outcome.err + outcome.out).find('\x1b') == std::string::npos);
  }
}

TEST_CASE("a path that cannot be used is one error message") {
  const Served served;
  const std::string circle = served.path("circle.bvh");
  std::filesystem::create_symlink(circle, circle);
  const std::string endless(300, 'a');
  const auto refused = [&](const std::string& path) {
    check_refused({"convert", path, "--out", served.path("out.bvh")}, "cannot be reached");
    check_refused({"emulate", path}, "cannot be reached");
  };
  refused(circle);
  refused(served.path(endless + ".bvh"));
  {
    const AsNobody nobody;  // may not enter the folder
    refused(served.path("walk.bvh"));
  }
  served.folder.write("posed.toml",
                      stream_with("driver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\n"
                                  "[stream.retarget]\nto = \"" +
                                  endless + "\"\n"));
  check_refused({"check", "--config", served.path("posed.toml")}, endless);
}

TEST_CASE("check reports that a glove is not connected, and that the daemon would wait for it") {
  const Served served;
  served.folder.write("posed.toml", stream_with("driver = \"cyberglove\"\nport = \"/dev/none\"\n"));
  const ProgramOutcome text = posed({"check", "--config", served.path("posed.toml")});
  INFO(text.err);
  CHECK(text.code == 0);
  CHECK(has(text.out, "hand: cyberglove (away), 100 Hz"));
  CHECK(has(text.out, "not here ... `posed run` waits ... /dev/none"));
  const ProgramOutcome as_json = posed({"check", "--config", served.path("posed.toml"), "--json"});
  CHECK(nlohmann::json::parse(as_json.out).at("streams")[0].at("present") == false);
}

}  // namespace
}  // namespace posed::test
