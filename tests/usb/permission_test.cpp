// Devices that may not be opened: what is wrong, and what mends it, in a sentence.
#include <catch2/catch.hpp>

#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/ports.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/shared.hpp"
#include "tests/usb/gloves.hpp"
#include "tests/usb/hid_glove.hpp"
#include "tests/usb/p5_glove.hpp"

namespace posed::test {
namespace {

using drivers::Ports;

constexpr uid_t kNobody = 65534;

// root may do everything, so root is somebody else for a while.
class AsNobody {
 public:
  AsNobody() {
    if (::getuid() != 0) return;
    groups_.resize(static_cast<std::size_t>(::getgroups(0, nullptr)));
    groups_.resize(
        static_cast<std::size_t>(::getgroups(static_cast<int>(groups_.size()), groups_.data())));
    REQUIRE(::setgroups(0, nullptr) == 0);
    REQUIRE(::setresgid(kNobody, kNobody, 0) == 0);
    REQUIRE(::setresuid(kNobody, kNobody, 0) == 0);
    changed_ = true;
  }
  ~AsNobody() {
    if (!changed_) return;
    const bool back = ::setresuid(0, 0, 0) == 0 && ::setresgid(0, 0, 0) == 0 &&
                      ::setgroups(groups_.size(), groups_.data()) == 0;
    if (!back) std::abort();
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  std::vector<gid_t> groups_;
  bool changed_ = false;
};

void forbid(const Bench& bench, const std::string& node) {
  std::filesystem::permissions(bench.file_of(node), std::filesystem::perms::none);
}

// The sentence names the node, the rule and what to do with it.
void check_sentence(const std::string& sentence, const std::string& node) {
  INFO(sentence);
  CHECK(sentence.find("no permission for " + node) != std::string::npos);
  const auto rule = sentence.find("config/udev/70-posed.rules");
  CHECK(rule != std::string::npos);
  CHECK(std::filesystem::exists(source_dir() / "config/udev/70-posed.rules"));
  CHECK(sentence.find("install") != std::string::npos);
  CHECK(sentence.find("plug the glove in again") != std::string::npos);
}

}  // namespace

TEST_CASE("a glove that may not be opened says which rule mends that") {
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
  CHECK(nodes[0].identity() == "5d70:0001 ULTRA-7");  // seen all the same
  check_sentence(nodes[0].trouble, ultra.node());
  std::string usb_trouble;
  for (const auto& device : drivers::list_usb_devices()) {
    if (device.node == p5.node()) usb_trouble = device.trouble;
  }
  check_sentence(usb_trouble, p5.node());

  if (::access(POSED_BINARY, X_OK) == 0) {  // nobody may not enter every home
    const Outcome listed = posed({"devices"});
    CHECK(listed.out.find(nodes[0].trouble + "\n") != std::string::npos);
    CHECK(listed.out.find(usb_trouble + "\n") != std::string::npos);
  }

  Ports ports;
  const auto hid = ports.hid({.vendor = kUltra.vendor});
  REQUIRE_FALSE(hid);
  CHECK(hid.error().message == nodes[0].trouble);
  const auto driver = drivers::find_driver("p5")->open({}, ports);
  REQUIRE_FALSE(driver);
  CHECK(driver.error().message == usb_trouble);
}

TEST_CASE("a node of a group is mended by joining it, too; a node for all has no trouble") {
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
    const std::string sentence = drivers::list_hid_nodes().at(0).trouble;
    check_sentence(sentence, ultra.node());
    CHECK(sentence.find("sudo usermod -aG plugdev $USER") != std::string::npos);
  }
  std::filesystem::permissions(file, std::filesystem::perms(0666));
  const AsNobody nobody;
  CHECK(drivers::list_hid_nodes().at(0).trouble.empty());
  Ports ports;
  CHECK(ports.hid({.vendor = kUltra.vendor}));
}

}  // namespace posed::test
