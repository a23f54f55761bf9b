
#include <catch2/catch.hpp>

#include <filesystem>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/config/take_tables.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::config {
namespace {

TEST_CASE("what listens over TCP has a port of its own") {
  DaemonConfig config;
  CHECK(port_clashes(config).empty());
  config.metrics.emplace();
  OutputConfig& output = config.outputs.emplace_back();
  output.name = "bvh-a";
  output.kind = OutputKind::kBvh;
  CHECK(port_clashes(config).empty());
  config.metrics->listen = "127.0.0.1:5570";
  output.listen = "127.0.0.1:5571";
  const auto clashes = port_clashes(config);
  REQUIRE(clashes.size() == 2);
  CHECK(clashes[0].key == "output");
  CHECK(clashes[0].message.starts_with("control and output 'bvh-a' cannot share the TCP endpoint"));
  CHECK(clashes[1].key == "metrics");
  CHECK(clashes[1].message ==
        "publish and metrics cannot share the TCP endpoint 127.0.0.1:5570; give"
        " metrics another port");
  output.to = {"127.0.0.1:39539"};         // sends, and does not listen
  config.metrics->listen = "127.0.0.1:0";  // any free one
  CHECK(port_clashes(config).empty());
}

TEST_CASE("check tells that recordings would go to a folder that nobody reaches") {
  const test::TempFolder folder;
  const std::filesystem::path circle = folder.path() / "circle";
  std::filesystem::create_symlink(circle, circle);
  for (const auto& unreachable : {circle, circle / "x", folder.path() / std::string(300, 'a')}) {
    const auto checked = check_folder({.folder = unreachable});
    REQUIRE_FALSE(checked);
    CHECK(test::has(checked.error().message, "cannot be reached"));
  }
  CHECK(check_folder({.folder = folder.path() / "new/takes"}));
}

TEST_CASE("a port that does not exist is no endpoint") {
  const auto reading = read_config("[control]\nendpoint = \"tcp://127.0.0.1:99999\"\n",
                                   "posed.toml", drivers::registry());
  REQUIRE(!reading.errors.empty());
  CHECK(reading.errors.back().message.find("'tcp://127.0.0.1:99999' names a port that does not"
                                           " exist") != std::string::npos);
}

TEST_CASE("two devices do not receive on one UDP port") {
  const auto errors_of = [](const std::string& first, const std::string& second) {
    return read_config("[[source]]\nname = \"a\"\nstreams = \"all\"\n" + first +
                           "\n[[source]]\nname = \"b\"\nstreams = \"all\"\n" + second,
                       "posed.toml", drivers::registry())
        .errors;
  };
  const std::string mvn = "driver = \"mvn\"";
  const auto errors = errors_of(mvn, mvn);
  REQUIRE(errors.size() == 1);
  CHECK(errors.front().text() ==
        "posed.toml:5: source 'a' and source 'b' cannot share the UDP endpoint 127.0.0.1:9763; give"
        " source 'b' another port");
  const std::string own = "[source.mvn]\n";
  CHECK(errors_of(mvn, mvn + "\n" + own + "listen = \"127.0.0.1:9764\"").empty());
  CHECK(errors_of(mvn, mvn + "\n" + own + "link = \"tcp\"").empty());
  const std::string every = own + "listen = \"0.0.0.0:9763\"\npeers = \"192.168.1.20\"";
  CHECK(errors_of(mvn, mvn + "\n" + every).size() == 1);
  // The sockets of a multicast group share its port, and each takes its own server's frames.
  const std::string natnet = "driver = \"natnet\"";
  CHECK(errors_of(natnet, natnet).empty());
  CHECK(errors_of(natnet, natnet + "\n[source.natnet]\nunicast = true").size() == 1);
  const std::string vmc = "driver = \"vmc\"\n[source.vmc]\nlisten = \"127.0.0.1:9763\"";
  CHECK(errors_of(mvn, vmc).size() == 1);
  CHECK(errors_of(mvn, "driver = \"vmc\"\n[trigger]\nlisten = \"127.0.0.1:9763\"").size() == 1);
}

TEST_CASE("publish and control need two endpoints, whatever their kind") {
  DaemonConfig config;
  for (const char* endpoint : {"ipc:///tmp/posed", "tcp://eth0:5570", "tcp://*:5570"}) {
    config.publish_endpoint = config.control_endpoint = endpoint;
    CHECK(port_clashes(config).size() == 1);
  }
  config.publish_endpoint = config.control_endpoint = "tcp://127.0.0.1:*";
  CHECK(port_clashes(config).empty());
}

TEST_CASE("a glove's port serves one stream") {
  const auto errors_of = [](const std::string& second) {
    return read_config(
               "[[stream]]\nname = \"a\"\ndriver = \"cyberglove\"\nport = \"/dev/g\"\n"
               "[[stream]]\nname = \"b\"\ndriver = \"cyberglove\"\n" +
                   second,
               "posed.toml", drivers::registry())
        .errors;
  };
  CHECK(errors_of("port = \"/dev/h\"\n").empty());
  CHECK(errors_of("").empty());
  const auto errors = errors_of("port = \"/dev/g\"\n");
  REQUIRE(errors.size() == 1);
  CHECK(errors.front().line == 5);
  CHECK(errors.front().message.find("'a' and 'b' have the same port '/dev/g'") !=
        std::string::npos);
}

}  // namespace
}  // namespace posed::config
