#include "daemon/system/hot_cpu.hpp"

#include <fstream>
#include <initializer_list>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "tests/support/temp_folder.hpp"

namespace posed::system {
namespace {

cpu_set_t set_of(std::initializer_list<std::size_t> cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const std::size_t cpu : cpus) CPU_SET(cpu, &set);
  return set;
}

// What /sys says of one CPU.
void say(const test::TempFolder& sys, int cpu, const std::string& file, int value) {
  const auto path = sys.path() / "devices/system/cpu" / ("cpu" + std::to_string(cpu)) / file;
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << value << '\n';
}

}  // namespace

TEST_CASE("the shared CPU is the last of the quickest that may be used") {
  const test::TempFolder sys;
  const auto chosen = [&](std::initializer_list<std::size_t> cpus) {
    return quickest_cpu(set_of(cpus), sys.path().string());
  };
  CHECK(chosen({3}) == std::nullopt);
  CHECK(chosen({0, 1, 2, 3}) == 3);  // nothing is known of them
  CHECK(chosen({0, 2}) == 2);
  for (int cpu = 0; cpu < 4; ++cpu) {
    say(sys, cpu, "cpufreq/cpuinfo_max_freq", cpu < 2 ? 5'000'000 : 3'800'000);
  }
  CHECK(chosen({0, 1, 2, 3}) == 1);
  CHECK(chosen({0, 2, 3}) == 0);
  for (int cpu = 0; cpu < 4; ++cpu) say(sys, cpu, "cpu_capacity", cpu == 2 ? 1024 : 400);
  CHECK(chosen({0, 1, 2, 3}) == 2);
}

TEST_CASE("a thread that is added runs on one CPU alone") {
  auto shared = HotCpu::open();
  if (!shared) {
    WARN("skipped: this process may use only one CPU");
    return;
  }
  cpu_set_t where;
  int found = 1;
  std::thread([&] {
    shared->join(11);
    found = sched_getaffinity(0, sizeof where, &where);
    shared->stop();
  }).join();
  REQUIRE(found == 0);
  CHECK(CPU_COUNT(&where) == 1);
}

}  // namespace posed::system
