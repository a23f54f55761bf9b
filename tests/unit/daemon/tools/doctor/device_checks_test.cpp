// Each check of devices on a computer where it is right, and where it is wrong.
#include <catch2/catch.hpp>

#include "tests/support/has.hpp"
#include "tests/unit/daemon/tools/doctor/sound_machine.hpp"

namespace posed::doctor {
namespace {

using test::glove_config;
using test::has;
using test::HealthyMachine;

constexpr const char* kLatency = "sys/bus/usb-serial/devices/ttyUSB0/latency_timer";
constexpr const char* kRules = "etc/udev/rules.d/70-posed.rules";

TEST_CASE("doctor: a device that its group may open needs the group") {
  HealthyMachine healthy;
  CHECK(check_groups(healthy.machine, nullptr).ok);
  healthy.plug_in();
  CHECK(check_groups(healthy.machine, nullptr).ok);
  healthy.machine.nodes.clear();
  healthy.plug_in("no permission for /dev/ttyUSB0");
  healthy.machine.groups = {"ann"};
  const Check bad = check_groups(healthy.machine, nullptr);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "/dev/ttyUSB0 cannot be opened by ann");
  CHECK(bad.fix == "sudo usermod -aG dialout ann  # then log in again");
}

TEST_CASE("doctor: a device of root's own group needs the udev rules") {
  HealthyMachine healthy;
  healthy.plug_in("no permission for /dev/ttyUSB0");
  healthy.machine.nodes[0].group.clear();
  CHECK(has(check_groups(healthy.machine, nullptr).fix, "cp config/udev/70-posed.rules"));
}

TEST_CASE("doctor: a glove in the config needs the groups or the rules, also while it is away") {
  HealthyMachine healthy;
  const auto config = glove_config();
  CHECK(check_groups(healthy.machine, &config).ok);
  healthy.machine.groups = {"ann"};
  CHECK(has(check_groups(healthy.machine, &config).found, "udev rules let in"));
  healthy.remove(kRules);
  const Check bad = check_groups(healthy.machine, &config);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.fix, "usermod -aG dialout,plugdev ann"));
  healthy.machine.user = "root";
  CHECK(check_groups(healthy.machine, &config).ok);
}

TEST_CASE("doctor: udev rules are missed only where there are gloves") {
  HealthyMachine healthy;
  CHECK(check_udev_rules(healthy.machine, nullptr).found == "/" + std::string(kRules));
  healthy.remove(kRules);
  CHECK(has(check_udev_rules(healthy.machine, nullptr).found, "not needed"));
  const auto config = glove_config();
  const Check bad = check_udev_rules(healthy.machine, &config);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.fix, "udevadm control --reload"));
}

TEST_CASE("doctor: a USB adapter that collects bytes is slow") {
  HealthyMachine healthy;
  CHECK(has(check_usb_latency(healthy.machine).found, "no USB adapter"));
  healthy.put(kLatency, "1");
  CHECK(has(check_usb_latency(healthy.machine).found, "ttyUSB0 deliver at once"));
  healthy.put(kLatency, "16");
  const Check bad = check_usb_latency(healthy.machine);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "the adapter collects bytes for ttyUSB0 16 ms");
  CHECK(has(bad.fix, "latency_timer  #"));
}

TEST_CASE("doctor: ModemManager may run where the udev rules keep it from gloves") {
  HealthyMachine healthy;
  const auto config = glove_config();
  CHECK(check_modem_manager(healthy.machine, &config).found == "ModemManager does not run");
  healthy.put("proc/812/comm", "ModemManager");
  CHECK(check_modem_manager(healthy.machine, nullptr).ok);
  CHECK(check_modem_manager(healthy.machine, &config).ok);
  healthy.remove(kRules);
  CHECK_FALSE(check_modem_manager(healthy.machine, &config).ok);
}

TEST_CASE("doctor: ModemManager may not hold a port") {
  HealthyMachine healthy;
  healthy.put("proc/812/comm", "ModemManager");
  std::filesystem::create_directories(healthy.folder.path() / "proc/812/fd");
  std::filesystem::create_symlink("/dev/ttyUSB0", healthy.folder.path() / "proc/812/fd/9");
  const Check bad = check_modem_manager(healthy.machine, nullptr);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "ModemManager holds /dev/ttyUSB0");
  CHECK(has(bad.fix, "systemctl disable --now ModemManager"));
}

}  // namespace
}  // namespace posed::doctor
