// The real binary with an [[output]] table, heard by a socket of the test and by a program that is
// not posed's: oscdump of liblo-tools.
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "drivers/transport/udp.hpp"
#include "drivers/vmc/osc.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/raw_peer.hpp"

namespace posed::test {
namespace {

using std::chrono::steady_clock;

std::unique_ptr<drivers::UdpTransport> listen_at(const std::string& endpoint) {
  return drivers::UdpTransport::open({.sockets = {{.listen = endpoint}}}).value();
}

// The newest rotation of each bone, as it was sent, until so many status messages have come.
std::map<std::string, std::array<float, 7>> receive_bones(drivers::UdpTransport& socket,
                                                          int frames) {
  std::map<std::string, std::array<float, 7>> bones;
  const auto until = steady_clock::now() + std::chrono::seconds(20);
  while (frames > 0 && steady_clock::now() < until) {
    const drivers::Chunk chunk = socket.read(0);
    if (chunk.bytes.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (drivers::vmc::check_packet(chunk.bytes) != Outcome::kOk) continue;
    drivers::vmc::each_message(chunk.bytes, [&](const drivers::vmc::OscMessage& message) {
      if (message.address == "/VMC/Ext/OK") --frames;
      if (message.address != "/VMC/Ext/Bone/Pos") return;
      drivers::vmc::OscArguments arguments(message);
      auto& bone = bones[std::string(arguments.text())];
      for (float& x : bone) x = arguments.f32();
    });
  }
  CHECK(frames <= 0);
  return bones;
}

// A still person, so that every frame is the same.
class StillServed : public Served {
 public:
  void write_output(const std::string& output) {
    clip::Clip still = toy_walk(2, 60.0);
    still.channels.row(1) = still.channels.row(0);
    REQUIRE(clip::write_bvh(still, folder.path() / "still.bvh"));
    folder.write("posed.toml", std::string(kEndpoints) + R"(
[[stream]]
name = "ann"
driver = "file"
[stream.file]
path = "still.bvh"
loop = true
)" + output);
  }
};

// A program that prints the OSC messages that come to a UDP port.
class OscDump {
 public:
  static constexpr const char* kProgram = "/usr/bin/oscdump";

  explicit OscDump(std::uint16_t port) {
    std::string command =
        std::string("exec ") + kProgram + " -L " + std::to_string(port) + " > " + file().string();
    std::string shell = "/bin/sh", option = "-c";
    std::array<char*, 4> argv{shell.data(), option.data(), command.data(), nullptr};
    REQUIRE(posix_spawn(&pid_, shell.c_str(), nullptr, nullptr, argv.data(), environ) == 0);
  }
  ~OscDump() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  OscDump(const OscDump&) = delete;
  OscDump& operator=(const OscDump&) = delete;

  // What it has printed, once that contains `word`, or after 20 s.
  [[nodiscard]] std::string printed(const std::string& word) const {
    const auto until = steady_clock::now() + std::chrono::seconds(20);
    while (true) {
      const std::string text = file_text(file());
      if (text.contains(word) || steady_clock::now() > until) return text;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

 private:
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "dump"; }

  TempFolder folder_;
  pid_t pid_ = -1;
};

}  // namespace

TEST_CASE("an avatar that cannot be used is said by its name before the daemon runs") {
  StillServed served;
  served.write_output(
      "[[output]]\nkind = \"vmc\"\nbody = \"ann\"\nto = [\"127.0.0.1:9\"]\n"
      "avatar = \"me.gltf\"\n");
  // All of its bones are in one place.
  std::string bones, nodes;
  for (const char* bone : {"hips", "spine", "head"}) {
    const std::size_t node = static_cast<std::size_t>(std::ranges::count(nodes, '{'));
    nodes += (node == 0 ? "" : ",") + std::string("{") +
             (node < 2 ? "\"children\":[" + std::to_string(node + 1) + "]" : "") + "}";
    bones += (node == 0 ? "\"" : ",\"") + std::string(bone) +
             "\":{\"node\":" + std::to_string(node) + "}";
  }
  const std::string flat = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[" + nodes +
                           "],\"extensions\":{\"VRMC_vrm\":{\"humanoid\":{\"humanBones\":{" +
                           bones + "}}}}}";
  for (const std::string& text : {std::string("{"), flat}) {
    std::ofstream(served.path("me.gltf")) << text;
    for (const char* command : {"check", "run"}) {
      const auto said = posed({command, "--config", served.path("posed.toml")});
      INFO(said.err);
      CHECK(said.code == 1);
      CHECK(said.err.contains("me.gltf: "));
    }
  }
}

TEST_CASE("posed run sends a stream to a VMC application and reports it") {
  const auto socket = listen_at("127.0.0.1:0");
  StillServed served;
  served.write_output("[[output]]\nkind = \"vmc\"\nbody = \"ann\"\nto = [\"" + socket->endpoint(0) +
                      "\"]\n");
  const auto checked = posed({"check", "--config", served.path("posed.toml")});
  CHECK(checked.code == 0);
  CHECK(checked.out.find("output vmc-ann: vmc, body ann, to " + socket->endpoint(0)) !=
        std::string::npos);
  served.start();
  const auto bones = receive_bones(*socket, 30);
  CHECK(bones.contains("Hips"));
  CHECK(bones.contains("Head"));
  const auto top = posed({"top", "--connect", served.publish, "--count", "2", "--json"});
  REQUIRE(top.code == 0);
  const auto last = top.out.substr(top.out.rfind('\n', top.out.size() - 2) + 1);
  const auto output = nlohmann::json::parse(last).at("output").at(0);
  CHECK(output.at("name") == "vmc-ann");
  CHECK(output.at("kind") == "vmc");
  CHECK(output.at("receivers") == 1);
  CHECK(std::stoull(output.at("sent").get<std::string>()) > 30);
  CHECK(output.at("failures") == "0");
  const auto shown = posed({"top", "--connect", served.publish, "--count", "1"});
  CHECK(shown.out.find("vmc output, 1 receiver, ") != std::string::npos);
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);
}

TEST_CASE("posed run serves a stream to whoever connects as lines of a BVH") {
  const std::string endpoint = "127.0.0.1:" + std::to_string(free_port());
  StillServed served;
  served.write_output("[[output]]\nkind = \"bvh\"\nbody = \"ann\"\nlisten = \"" + endpoint +
                      "\"\n");
  const auto checked = posed({"check", "--config", served.path("posed.toml")});
  CHECK(checked.out.contains("output bvh-ann: bvh, body ann, on " + endpoint));
  served.start();
  const RawPeer client(endpoint);
  const std::string text = client.receive(16 * 1024);
  CHECK(text.starts_with("0 ann "));
  // Name, number and values of a whole line.
  std::istringstream line(text.substr(0, text.find("||")));
  const std::vector<std::string> words{std::istream_iterator<std::string>(line), {}};
  CHECK(words.size() == 2 + 354);
}

TEST_CASE("oscdump prints what the VMC output sends") {
  if (!std::filesystem::exists(OscDump::kProgram)) {
    WARN("SKIPPED without oscdump (Debian: liblo-tools)");
    return;
  }
  const auto socket = listen_at("127.0.0.1:0");
  const std::uint16_t port = free_port();
  const OscDump dump(port);
  StillServed served;
  served.write_output("[[output]]\nkind = \"vmc\"\nbody = \"ann\"\nto = [\"" + socket->endpoint(0) +
                      "\", \"127.0.0.1:" + std::to_string(port) + "\"]\n");
  served.start();
  const auto bones = receive_bones(*socket, 10);
  const std::string text = dump.printed("/VMC/Ext/T");
  CHECK(bones.size() >= 3);
  for (const auto& [name, values] : bones) {
    std::string expected = "/VMC/Ext/Bone/Pos sfffffff \"" + name + "\"";
    for (const float value : values) {
      std::array<char, 64> room{};
      std::snprintf(room.data(), room.size(), " %f", static_cast<double>(value));
      expected += room.data();
    }
    INFO(expected << "\n" << text.substr(0, 2000));
    CHECK(text.contains(expected));
  }
  CHECK(text.contains("/VMC/Ext/OK i 1"));
  CHECK(text.contains("/VMC/Ext/Root/Pos sfffffff \"root\" 0.000000 "));
}

}  // namespace posed::test
