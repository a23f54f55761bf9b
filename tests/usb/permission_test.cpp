// Devices without permission to open them: the message states the cause and the remedy.
#include <catch2/catch.hpp>

#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "drivers/driver.hpp"
#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/permission.hpp"
#include "tests/support/shared.hpp"
#include "tests/usb/gloves.hpp"
#include "tests/usb/hid_glove.hpp"
#include "tests/usb/p5_glove.hpp"
#include "tests/usb/speaker.hpp"

namespace posed::test {
namespace {

using drivers::TransportFactory;

void forbid(const Bench& bench, const std::string& node) {
  std::filesystem::permissions(bench.file_of(node), std::filesystem::perms::none);
}

}  // namespace

TEST_CASE("a glove without permission names the udev rule that gives access") {
  Bench bench;
  HidGlove ultra(bench, kUltra);
  P5Glove p5(bench, kP5, {});
  ultra.plug();
  p5.plug();
  forbid(bench, ultra.node());
  forbid(bench, p5.node());
  const AsNobody nobody;

  const auto nodes = drivers::list_hid_nodes();
  REQUIRE(nodes.size() == 1);
  CHECK(nodes[0].identity() == "5d70:0001 ULTRA-7");  // listed all the same
  check_sentence(nodes[0].open_error, ultra.node());
  std::string usb_trouble;
  for (const auto& device : drivers::list_usb_devices()) {
    if (device.node == p5.node()) usb_trouble = device.open_error;
  }
  check_sentence(usb_trouble, p5.node());

  if (::access(posed_binary().c_str(), X_OK) == 0) {  // user nobody may not enter every home folder
    const ProgramOutcome listed = posed({"devices"});
    CHECK(listed.out.find(nodes[0].open_error + "\n") != std::string::npos);
    CHECK(listed.out.find(usb_trouble + "\n") != std::string::npos);
  }

  TransportFactory ports;
  const auto hid = ports.hid({.vendor = kUltra.vendor});
  REQUIRE_FALSE(hid);
  CHECK(hid.error().message == nodes[0].open_error);
  const auto driver = drivers::find_driver("p5")->open({}, ports);
  REQUIRE_FALSE(driver);
  CHECK(driver.error().message == usb_trouble);
}

TEST_CASE("joining a node's group gives access, too; a node for everyone has no error") {
  Bench bench;
  HidGlove ultra(bench, kUltra);
  ultra.plug();
  const std::string file = bench.file_of(ultra.node());
  if (::getuid() != 0) {
    WARN("SKIPPED without root: only root gives a node to a group");
    return;
  }
  const group* const plugdev = ::getgrnam("plugdev");
  REQUIRE(plugdev != nullptr);  // Debian's base has it
  REQUIRE(::chown(file.c_str(), 0, plugdev->gr_gid) == 0);
  forbid(bench, ultra.node());
  {
    const AsNobody nobody;
    const std::string sentence = drivers::list_hid_nodes().at(0).open_error;
    check_sentence(sentence, ultra.node());
    CHECK(sentence.find("sudo usermod -aG plugdev $USER") != std::string::npos);
  }
  std::filesystem::permissions(file, std::filesystem::perms(0666));
  const AsNobody nobody;
  CHECK(drivers::list_hid_nodes().at(0).open_error.empty());
  TransportFactory ports;
  CHECK(ports.hid({.vendor = kUltra.vendor}));
}

TEST_CASE("a daemon without permission for a glove reports it, runs, and opens it once permitted") {
  Bench bench;
  HidGlove ultra(bench, kUltra);
  const Speaker speaker(
      ultra,
      drivers::find_driver("fivedt")->emulate({{"model", std::string("ultra-usb-14")}}).value());
  ultra.plug();
  forbid(bench, ultra.node());
  std::optional<Stage> stage;
  {
    const AsNobody nobody;
    if (::access(posed_binary().c_str(), X_OK) != 0) {
      WARN("SKIPPED: nobody may not enter the folder of " << posed_binary());
      return;
    }
    stage.emplace();
    stage->folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                          "[[stream]]\nname = \"ultra\"\ndriver = \"fivedt\"\n"
                                          "hand = \"left\"\n[stream.fivedt]\n"
                                          "model = \"ultra-usb-14\"\n");
    stage->launch("run");
  }
  const std::string wanted = "no permission for " + ultra.node();
  for (int i = 0; i < 1000 && stage->daemon->errors().find(wanted) == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  check_sentence(stage->daemon->errors(), ultra.node());
  std::filesystem::permissions(bench.file_of(ultra.node()), std::filesystem::perms(0666));
  const ProgramOutcome frames = posed(
      {"monitor", "--connect", stage->publish, "--stream", "ultra", "--json", "--count", "10"});
  CHECK(frames.code == 0);
}

}  // namespace posed::test
