// Each check of devices on a computer where it is right, and where it is wrong.
#include <catch2/catch.hpp>

#include "tests/support/has.hpp"
#include "tests/unit/daemon/tools/doctor/sound_machine.hpp"

namespace posed::doctor {
namespace {

using test::glove_config;
using test::has;
using test::SoundMachine;

constexpr const char* kLatency = "sys/bus/usb-serial/devices/ttyUSB0/latency_timer";
constexpr const char* kRules = "etc/udev/rules.d/70-posed.rules";

TEST_CASE("doctor: a device that its group may open needs the group") {
  SoundMachine sound;
  CHECK(check_groups(sound.machine, nullptr).ok);
  sound.plug_in();
  CHECK(check_groups(sound.machine, nullptr).ok);
  sound.machine.nodes.clear();
  sound.plug_in("no permission for /dev/ttyUSB0");
  sound.machine.groups = {"ann"};
  const Check bad = check_groups(sound.machine, nullptr);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "/dev/ttyUSB0 cannot be opened by ann");
  CHECK(bad.fix == "sudo usermod -aG dialout ann  # then log in again");
}

TEST_CASE("doctor: a device of root's own group needs the udev rules") {
  SoundMachine sound;
  sound.plug_in("no permission for /dev/ttyUSB0");
  sound.machine.nodes[0].group.clear();
  CHECK(has(check_groups(sound.machine, nullptr).fix, "cp config/udev/70-posed.rules"));
}

TEST_CASE("doctor: a glove in the config needs the groups or the rules, also while it is away") {
  SoundMachine sound;
  const auto config = glove_config();
  CHECK(check_groups(sound.machine, &config).ok);
  sound.machine.groups = {"ann"};
  CHECK(has(check_groups(sound.machine, &config).found, "udev rules let in"));
  sound.remove(kRules);
  const Check bad = check_groups(sound.machine, &config);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.fix, "usermod -aG dialout,plugdev ann"));
  sound.machine.user = "root";
  CHECK(check_groups(sound.machine, &config).ok);
}

TEST_CASE("doctor: udev rules are missed only where there are gloves") {
  SoundMachine sound;
  CHECK(check_udev_rules(sound.machine, nullptr).found == "/" + std::string(kRules));
  sound.remove(kRules);
  CHECK(has(check_udev_rules(sound.machine, nullptr).found, "not needed"));
  const auto config = glove_config();
  const Check bad = check_udev_rules(sound.machine, &config);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.fix, "udevadm control --reload"));
}

TEST_CASE("doctor: a USB adapter that collects bytes is slow") {
  SoundMachine sound;
  CHECK(has(check_usb_latency(sound.machine).found, "no USB adapter"));
  sound.put(kLatency, "1");
  CHECK(has(check_usb_latency(sound.machine).found, "ttyUSB0 deliver at once"));
  sound.put(kLatency, "16");
  const Check bad = check_usb_latency(sound.machine);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "the adapter collects bytes for ttyUSB0 16 ms");
  CHECK(has(bad.fix, "latency_timer  #"));
}

TEST_CASE("doctor: ModemManager may run where the udev rules keep it from gloves") {
  SoundMachine sound;
  const auto config = glove_config();
  CHECK(check_modem_manager(sound.machine, &config).found == "ModemManager does not run");
  sound.put("proc/812/comm", "ModemManager");
  CHECK(check_modem_manager(sound.machine, nullptr).ok);
  CHECK(check_modem_manager(sound.machine, &config).ok);
  sound.remove(kRules);
  CHECK_FALSE(check_modem_manager(sound.machine, &config).ok);
}

TEST_CASE("doctor: ModemManager may not hold a port") {
  SoundMachine sound;
  sound.put("proc/812/comm", "ModemManager");
  std::filesystem::create_directories(sound.folder.path() / "proc/812/fd");
  std::filesystem::create_symlink("/dev/ttyUSB0", sound.folder.path() / "proc/812/fd/9");
  const Check bad = check_modem_manager(sound.machine, nullptr);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "ModemManager holds /dev/ttyUSB0");
  CHECK(has(bad.fix, "systemctl disable --now ModemManager"));
}

}  // namespace
}  // namespace posed::doctor
