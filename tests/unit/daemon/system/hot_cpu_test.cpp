#include "daemon/system/hot_cpu.hpp"

#include <fstream>
#include <initializer_list>
#include <string>
#include <thread>
#include <vector>

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

TEST_CASE("threads share a CPU until it is nearly full, and try again more and more rarely") {
  SharingRule rule;
  std::int64_t now_ns = 0;
  const auto looks = [&](double load, double for_s, double held_up = 0.05) {
    bool shared = false;
    for (const std::int64_t end_ns = now_ns + nanoseconds(for_s); now_ns < end_ns;) {
      shared = rule.share({.load = load, .held_up = held_up}, now_ns += kNanosPerSecond / 10);
    }
    return shared;
  };
  CHECK(looks(0.7, 60.0));
  CHECK_FALSE(looks(0.9, 0.1));
  CHECK_FALSE(looks(0.9, 9.9));
  CHECK(looks(0.9, 0.1));  // apart they may need more than together
  CHECK_FALSE(looks(0.9, 0.1));
  CHECK_FALSE(looks(0.9, 19.9));
  CHECK(looks(0.9, 0.1));
  CHECK(looks(0.7, 10.0));
  CHECK_FALSE(looks(0.9, 0.1));
  CHECK_FALSE(looks(1.3, 60.0));  // this cannot fit
  CHECK(looks(0.9, 0.1));
  int tries = 0;
  for (int look = 0; look < 36'000; ++look) tries += looks(0.9, 0.1) ? 1 : 0;
  CHECK(tries >= 8);
  CHECK(tries <= 12);  // in an hour
  CHECK(looks(0.7, 650.0));
  CHECK_FALSE(looks(0.2, 0.1, 0.3));  // another program has the CPU
  CHECK(looks(0.2, 10.0, 0.3));
  CHECK_FALSE(looks(0.2, 0.1, 0.3));
}

TEST_CASE("threads are held up by what others run, not by what is more urgent of their own") {
  using Threads = std::vector<ThreadTime>;
  CHECK(held_up_ns(Threads{}) == 0);
  CHECK(held_up_ns(Threads{{12, 30, 0}, {11, 40, 30}, {10, 20, 70}}) == 0);
  CHECK(held_up_ns(Threads{{10, 20, 75}, {12, 30, 2}, {11, 40, 33}}) == 2 + 3 + 5);
  CHECK(held_up_ns(Threads{{12, 30, 0}, {11, 40, 0}}) == 0);
}

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
