// The client commands with a running daemon: their output, exit codes and refusals.
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

TEST_CASE("ctl changes a running daemon and reports from which frame on") {
  Served served;
  served.start();
  const auto ctl = [&](std::vector<std::string> what) {
    what.insert(what.begin(), {"ctl", "--connect", served.control});
    return posed(std::move(what));
  };
  const auto set = ctl({"set", "walker", "alpha", "-0.5"});
  INFO(set.err);
  CHECK(set.code == 0);
  CHECK(set.out.starts_with("walker: in effect from frame "));

  const auto model = ctl({"--json", "model", "walker", served.path("two.style")});
  INFO(model.err);
  CHECK(model.code == 0);
  CHECK(json::parse(model.out).at("ok") == true);

  CHECK(has(ctl({"status"}).out, "walker"));
  const auto raw = ctl({"set", "walker-raw", "alpha", "1"});
  CHECK(raw.code == 1);
  CHECK(has(raw.err, "before its stages"));
  const auto foreign = ctl({"model", "walker", served.path("walk.bvh")});
  CHECK(foreign.code == 1);
  CHECK(has(foreign.err, "walk.bvh"));
  CHECK(ctl({"set", "walker", "alpha", "fast"}).code == 2);
  CHECK(ctl({"set", "walker", "beta", "1"}).code == 2);
  CHECK(ctl({"set", "walker", "style.gate", "true"}).code == 0);
  CHECK(ctl({"set", "walker", "gate", "1"}).code == 2);
  const auto absent = ctl({"play", "walker", "g"});
  CHECK(absent.code == 1);
  CHECK(has(absent.err, "[stream.generate]"));
  CHECK(ctl({"model", "walker", served.path("none.style")}).code == 1);

  CHECK(ctl({"stop"}).code == 0);
  CHECK(served.daemon->exit_code() == 0);
}

TEST_CASE("monitor and top show the daemon, to people and to scripts") {
  Served served;
  served.start();
  const auto frames = posed(
      {"monitor", "--connect", served.publish, "--stream", "walker", "--json", "--count", "5"});
  REQUIRE(frames.code == 0);
  std::istringstream lines(frames.out);
  std::uint64_t last = 0;
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto frame = json::parse(line);
    CHECK(frame.at("stream") == "walker");  // not walker-raw
    const std::uint64_t sequence = std::stoull(frame.at("sequence").get<std::string>());
    CHECK(sequence > last);
    last = sequence;
    CHECK(frame.at("rotationXyzw").size() == 20);
  }
  CHECK(count == 5);

  const auto people = posed({"monitor", "--connect", served.publish, "--count", "2"});
  CHECK(people.code == 0);
  CHECK(has(people.out, "measured"));
  CHECK(has(people.out, "root"));

  const auto top = posed({"top", "--connect", served.publish, "--count", "2"});
  CHECK(top.code == 0);
  CHECK(has(top.out, "STREAM"));
  CHECK(has(top.out, "walker"));
  CHECK(top.out.find('\x1b') == std::string::npos);  // no terminal, no colours

  Process endless({"monitor", "--connect", served.publish});
  REQUIRE(endless.line());
  endless.send(SIGINT);
  CHECK(endless.exit_code() == 0);
  served.daemon->send(SIGINT);
  CHECK(served.daemon->exit_code() == 0);
}

TEST_CASE("completion is generated from the existing commands") {
  const auto bash = posed({"completion", "bash"});
  CHECK(bash.code == 0);
  CHECK(has(
      bash.out,
      "'posed ctl') words='set warm-up model models use-model rename-model delete-model recordings "
      "teach play stop-playing engage release calibrate haptics take "
      "status stop --help --connect"));
  CHECK(has(posed({"completion", "zsh"}).out, "#compdef posed"));
  CHECK(has(posed({"completion", "fish"}).out, "-l 'connect'"));
  CHECK(posed({"completion", "tcsh"}).code == 2);
}

TEST_CASE("an absent daemon gives one error message") {
  const auto ctl = posed({"ctl", "--connect", "tcp://127.0.0.1:9", "--timeout", "0.3", "status"});
  CHECK(ctl.code == 1);
  CHECK(has(ctl.err, "posed: ... tcp://127.0.0.1:9"));
  const auto wrong = posed({"ctl", "--connect", "nonsense", "status"});
  CHECK(wrong.code == 2);
  CHECK(has(wrong.err, "an endpoint reads like"));
}

TEST_CASE("a busy port gives one error message and exit code 1") {
  Served served;
  served.start();
  Served second;
  second.write_config("");
  std::ifstream file(second.path("posed.toml"));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  text.replace(text.find("tcp://127.0.0.1:*"), 17, served.publish);
  second.folder.write("posed.toml", text);
  const auto busy = posed({"run", "--config", second.path("posed.toml")});
  CHECK(busy.code == 1);
  CHECK(has(busy.err, served.publish + " is in use"));
}

TEST_CASE("check reports what a config would run, or everything that is wrong with it") {
  Served served;
  const auto good = posed({"check", "--config", served.path("posed.toml"), "--json"});
  INFO(good.err);
  REQUIRE(good.code == 0);
  const auto checked_config = json::parse(good.out);
  CHECK(checked_config.at("ok") == true);
  CHECK(checked_config.at("streams").at(0).at("name") == "walker");
  CHECK(checked_config.at("streams").at(0).at("joints") == 5);
  CHECK(checked_config.at("streams").at(0).at("stages").at(0).at("model") == "one.style");
  CHECK(posed({"check", "--config", served.path("posed.toml")}).code == 0);

  const auto bad = served.folder.write("bad.toml", "strem = 1\nrealtime = 2\n");
  const auto all = posed({"check", "--config", bad.string()});
  CHECK(all.code == 2);
  CHECK(has(all.err, "bad.toml:1: ... 'strem' ... 'stream'"));
  CHECK(has(all.err, "bad.toml:2: ... realtime ... true or false"));
  const auto as_json = posed({"check", "--config", bad.string(), "--json"});
  CHECK(json::parse(as_json.out).at("errors").size() ==
        3);  // the third error is that there is no stream
  CHECK(posed({"check", "--config", served.path("none.toml")}).code == 2);

  std::filesystem::remove(served.folder.path() / "one.style");
  const auto gone = posed({"check", "--config", served.path("posed.toml")});
  CHECK(gone.code == 1);
  CHECK(has(gone.err, "one.style"));
}

TEST_CASE("check names the files of stages by their paths") {
  const Served served;
  const std::string config = served.path("posed.toml");
  std::ofstream(config, std::ios::app) << "[stream.retarget]\nto = \"walk.bvh\"\n";
  const auto shown = posed({"check", "--config", config});
  INFO(shown.err);
  REQUIRE(shown.code == 0);
  CHECK(has(shown.out, "retarget (to=\"" + served.path("walk.bvh") + "\""));
}

TEST_CASE("check refuses a folder in which no recording can be made") {
  const Served served;
  const auto config = served.path("posed.toml");
  std::ifstream file(config);
  const auto lines = std::count(std::istreambuf_iterator<char>(file), {}, '\n');
  std::ofstream(config, std::ios::app) << "[record]\nfolder = \"/proc/takes\"\n";
  const auto refused = posed({"check", "--config", config});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, config + ":" + std::to_string(lines + 2) +
                             ": ... /proc ... No such file or directory"));
}

TEST_CASE("check tells where the daemon would record and who may trigger takes") {
  const Served served;
  const auto config = served.path("posed.toml");
  const auto plain = posed({"check", "--config", config, "--json"});
  CHECK_FALSE(json::parse(plain.out).contains("record"));
  CHECK_FALSE(json::parse(plain.out).contains("trigger"));
  std::ofstream(config, std::ios::app) << R"(
[record]
folder = "monday"
clips = "bvh"
[trigger]
listen = "127.0.0.1:1599"
)";
  const auto shown = posed({"check", "--config", config});
  INFO(shown.err);
  CHECK(has(shown.out, "records to " + served.path("monday") + ", each take as BVH\n"));
  CHECK(has(shown.out, "takes ... 127.0.0.1:1599"));
  const auto reported = json::parse(posed({"check", "--config", config, "--json"}).out);
  CHECK(reported.at("record").at("folder") == served.path("monday"));
  CHECK(reported.at("record").at("frames") == false);
  CHECK(reported.at("record").at("clips") == true);
  CHECK(reported.at("trigger").at("listen") == "127.0.0.1:1599");
  CHECK(reported.at("trigger").at("peers").empty());
}

TEST_CASE("unknown clients get no access, and a withdrawn key is cut off") {
  Served served;
  for (const char* name : {"server", "viewer", "director", "unlisted", "other"}) {
    REQUIRE(posed({"keygen", name, "--out", served.folder.path().string()}).code == 0);
  }
  const std::string server = "[security]\nserver_key = \"server.key\"\n";
  const std::string director =
      "[[security.client]]\nname = \"director\"\npublic_key = \"director.pub\"\n"
      "rights = [\"subscribe\", \"control\"]\n";
  const std::string viewer =
      "[[security.client]]\nname = \"viewer\"\npublic_key = \"viewer.pub\"\n";
  served.write_config(server + director + viewer);
  served.start();
  const auto as = [&](const std::string& key, std::vector<std::string> what,
                      const std::string& server_key = "server") {
    const std::string where = what[0] == "ctl" ? served.control : served.publish;
    what.insert(what.end(), {"--connect", where, "--key", served.path(key + ".key"), "--server-key",
                             served.path(server_key + ".pub")});
    return what;
  };
  CHECK(posed(as("viewer", {"monitor", "--count", "3"})).code == 0);
  CHECK(posed(as("director", {"ctl", "set", "walker", "alpha", "0.2"})).code == 0);

  const auto reaching = posed(as("viewer", {"ctl", "status"}));
  CHECK(reaching.code == 1);
  CHECK(has(reaching.err, "refuses this key"));
  const auto unlisted = posed(as("unlisted", {"monitor", "--count", "1"}));
  CHECK(unlisted.code == 1);
  CHECK(has(unlisted.err, "refuses this key"));
  const auto keyless = posed({"monitor", "--connect", served.publish, "--count", "1"});
  CHECK(keyless.code == 1);
  CHECK(has(keyless.err, "wants a key"));
  const auto misled = posed(as("viewer", {"monitor", "--count", "1"}, "other"));
  CHECK(misled.code == 1);
  CHECK(has(misled.err, "is not its key"));

  Process connected(as("viewer", {"monitor"}));
  Process other(as("director", {"monitor"}));
  REQUIRE(connected.line());
  REQUIRE(other.line());
  served.write_config(server + director);
  served.daemon->send(SIGHUP);
  INFO(served.daemon->errors());
  CHECK(connected.exit_code() == 1);
  CHECK(has(connected.errors(), "refuses this key"));
  while (other.line(std::chrono::milliseconds(0))) {  // frames from before
  }
  CHECK(other.line());  // this client was not cut off
  // A config without its [security] table neither gives access nor ends the daemon.
  served.write_config("");
  served.daemon->send(SIGHUP);
  CHECK_FALSE(served.daemon->exit_code(std::chrono::milliseconds(500)));
  CHECK(has(served.daemon->errors(), "[security] server_key"));
  CHECK(posed({"monitor", "--connect", served.publish, "--count", "1"}).code == 1);
  CHECK(posed(as("director", {"ctl", "status"})).code == 0);
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);
}

}  // namespace
}  // namespace posed::test
