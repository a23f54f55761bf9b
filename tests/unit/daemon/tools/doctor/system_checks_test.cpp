// Each check of rights, CPU, clock and network on a computer where it is right, and where it is
// wrong.
#include <catch2/catch.hpp>

#include "tests/support/has.hpp"
#include "tests/unit/daemon/tools/doctor/sound_machine.hpp"

namespace posed::doctor {
namespace {

using test::has;
using test::HealthyMachine;

constexpr const char* kGovernor = "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
constexpr const char* kCpuDriver = "sys/devices/system/cpu/cpu0/cpufreq/scaling_driver";
constexpr const char* kClocks = "sys/devices/system/clocksource/clocksource0/";

TEST_CASE("doctor: hot threads need a priority") {
  HealthyMachine healthy;
  CHECK(check_priority(healthy.machine, nullptr).ok);
  healthy.machine.priority_limit = 11;
  const Check bad = check_priority(healthy.machine, nullptr);
  CHECK_FALSE(bad.ok);
  CHECK(
      has(bad.fix, "echo 'ann - rtprio 20' | sudo tee -a /etc/security/limits.d/70-posed.conf  #"));
  healthy.machine.may_schedule = true;
  CHECK(check_priority(healthy.machine, nullptr).ok);
  healthy.machine.may_schedule = false;
  config::DaemonConfig config;
  CHECK_FALSE(check_priority(healthy.machine, &config).ok);
  config.realtime = false;
  CHECK(check_priority(healthy.machine, &config).ok);
}

TEST_CASE("doctor: memory needs to be locked") {
  HealthyMachine healthy;
  CHECK(check_memory_lock(healthy.machine, nullptr).ok);
  healthy.machine.locked_limit_bytes = 8 << 20;
  const Check bad = check_memory_lock(healthy.machine, nullptr);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.found, "8192 KB"));
  CHECK(has(bad.fix, "memlock unlimited"));
  healthy.machine.may_lock = true;
  CHECK(check_memory_lock(healthy.machine, nullptr).ok);
  healthy.machine.may_lock = false;
  config::DaemonConfig config;
  config.realtime = false;
  CHECK(check_memory_lock(healthy.machine, &config).ok);
}

TEST_CASE("doctor: the CPU's clock has to rise at once") {
  HealthyMachine healthy;
  CHECK(has(check_governor(healthy.machine).found, "not governed"));
  healthy.put(kGovernor, "schedutil");
  CHECK(check_governor(healthy.machine).found == "schedutil");
  healthy.put(kGovernor, "powersave");
  healthy.put(kCpuDriver, "intel_pstate");
  CHECK(check_governor(healthy.machine).ok);
  healthy.put(kCpuDriver, "acpi-cpufreq");
  const Check bad = check_governor(healthy.machine);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.found, "powersave"));
  CHECK(has(bad.fix, "echo performance"));
}

TEST_CASE("doctor: the clock has to be read without a system call") {
  HealthyMachine healthy;
  CHECK(check_clock_source(healthy.machine).found == "tsc");
  healthy.put(std::string(kClocks) + "current_clocksource", "hpet");
  CHECK(has(check_clock_source(healthy.machine).fix, "dmesg"));
  healthy.put(std::string(kClocks) + "available_clocksource", "tsc hpet acpi_pm");
  const Check bad = check_clock_source(healthy.machine);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.found, "hpet"));
  CHECK(has(bad.fix, "echo tsc"));
  healthy.remove(std::string(kClocks) + "current_clocksource");
  CHECK(check_clock_source(healthy.machine).ok);
}

TEST_CASE("doctor: the clock has to follow a time server") {
  HealthyMachine healthy;
  CHECK(check_clock_sync(healthy.machine).ok);
  healthy.machine.clock = ClockState::kUnknown;
  CHECK(check_clock_sync(healthy.machine).ok);
  healthy.machine.clock = ClockState::kFree;
  const Check bad = check_clock_sync(healthy.machine);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.fix, "timedatectl set-ntp true  #"));
}

TEST_CASE("doctor: UDP sources need a buffer of the size that they ask for") {
  HealthyMachine healthy;
  config::DaemonConfig config;
  CHECK(check_socket_buffers(healthy.machine, nullptr).ok);
  healthy.put("proc/sys/net/core/rmem_max", "212992");
  CHECK(has(check_socket_buffers(healthy.machine, &config).found, "not needed"));
  config::SourceConfig source;
  source.name = "stage";
  source.driver = "vmc";
  source.options = drivers::complete_options(*drivers::find_driver("vmc"), {}).value();
  config.sources.push_back(source);
  const Check bad = check_socket_buffers(healthy.machine, &config);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.found, "212992"));
  CHECK(has(bad.fix, "net.core.rmem_max=1048576"));
  healthy.put("proc/sys/net/core/rmem_max", "1048576");
  CHECK(check_socket_buffers(healthy.machine, &config).ok);
}

}  // namespace
}  // namespace posed::doctor
