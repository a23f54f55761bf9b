#include "daemon/system/hot_cpu.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"

namespace posed::system {
namespace {

// Overload lasts at most this long before the threads get more room: less than the rings hold.
constexpr std::chrono::milliseconds kLookEvery{100};

// As the kernel tells it, or the highest clock rate; 0 if it tells neither. Of CPUs of one kind all
// answers are the same.
std::int64_t capacity_of(int cpu, const std::string& sys) {
  const std::string folder = sys + "/devices/system/cpu/cpu" + std::to_string(cpu);
  for (const char* name : {"/cpu_capacity", "/cpufreq/cpuinfo_max_freq"}) {
    std::int64_t value = 0;
    if (std::ifstream(folder + name) >> value) return value;
  }
  return 0;
}

cpu_set_t set_of(int cpu) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(cpu), &set);
  return set;
}

}  // namespace

bool SharingRule::share(const Seen& seen, std::int64_t now_ns) noexcept {
  if (since_ns_ == kNoTime_ns) since_ns_ = now_ns;
  const std::int64_t passed_ns = now_ns - since_ns_;
  const bool fits = seen.load <= kFull && seen.held_up <= kHeldUp;
  const bool may_try = seen.load < 1.0 && passed_ns >= try_after_ns_;
  if (shared_ ? fits : !may_try) return shared_;
  if (shared_) {
    const bool lasted = passed_ns >= kFirstTry_ns;
    try_after_ns_ = lasted ? kFirstTry_ns : std::min(2 * try_after_ns_, kRarest_ns);
  }
  since_ns_ = now_ns;
  return shared_ = !shared_;
}

std::int64_t held_up_ns(std::span<const ThreadShare> threads) noexcept {
  std::int64_t sum_ns = 0;
  for (const ThreadShare& thread : threads) {
    std::int64_t lost_ns = thread.time.waited_ns;
    for (const ThreadShare& other : threads) {
      if (other.priority > thread.priority) lost_ns -= other.time.ran_ns;
    }
    sum_ns += std::max<std::int64_t>(lost_ns, 0);
  }
  return sum_ns;
}

std::optional<int> quickest_cpu(const cpu_set_t& allowed, const std::string& sys) {
  std::optional<int> quickest;
  std::int64_t most = -1;
  if (CPU_COUNT(&allowed) < 2) return quickest;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) continue;
    const std::int64_t capacity = capacity_of(cpu, sys);
    if (capacity < most) continue;
    quickest = cpu;
    most = capacity;
  }
  return quickest;
}

std::unique_ptr<HotCpu> HotCpu::open() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return nullptr;
  if (!time_of_thread(gettid())) return nullptr;  // nothing would tell that the CPU is full
  const auto cpu = quickest_cpu(allowed, "/sys");
  if (!cpu) return nullptr;
  return std::unique_ptr<HotCpu>(new HotCpu(allowed, *cpu));
}

HotCpu::HotCpu(const cpu_set_t& allowed, int cpu) : allowed_(allowed), cpu_(cpu) {
  thread_ = std::thread([this] {
    name_thread("posed-cpu");
    watch();
  });
}

HotCpu::~HotCpu() { stop(); }

void HotCpu::stop() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  ended_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void HotCpu::join(int priority) {
  const std::lock_guard lock(mutex_);
  const pid_t self = gettid();
  members_.push_back({self, priority, time_of_thread(self).value_or(ThreadTime{})});
  move(shared_ ? set_of(cpu_) : allowed_);
}

// A refusal (a service without this system call, a CPU that was taken from it) leaves the thread
// where it may run.
void HotCpu::move(const cpu_set_t& where) {
  for (const Member& member : members_) {
    static_cast<void>(sched_setaffinity(member.thread, sizeof where, &where));
  }
}

void HotCpu::watch() {
  std::unique_lock lock(mutex_);
  std::int64_t before_ns = monotonic_ns();
  while (!ended_.wait_for(lock, kLookEvery, [this] { return end_; })) {
    const std::int64_t now_ns = monotonic_ns();
    look(now_ns - std::exchange(before_ns, now_ns), now_ns);
  }
}

void HotCpu::look(std::int64_t passed_ns, std::int64_t now_ns) {
  std::vector<ThreadShare> since;
  std::int64_t ran_ns = 0;
  for (Member& member : members_) {
    const ThreadTime time = time_of_thread(member.thread).value_or(member.time);
    since.push_back({member.priority, time - std::exchange(member.time, time)});
    ran_ns += since.back().time.ran_ns;
  }
  const SharingRule::Seen seen{.load = seconds(ran_ns) / seconds(passed_ns),
                               .held_up = seconds(held_up_ns(since)) / seconds(passed_ns)};
  const bool share = rule_.share(seen, now_ns);
  if (share == shared_) return;
  shared_ = share;
  move(share ? set_of(cpu_) : allowed_);
  if (share) return spdlog::info("reader, pipeline and publisher share CPU {} again", cpu_);
  spdlog::info(
      "reader, pipeline and publisher use all CPUs now: of CPU {} they needed {:.0f} %, and others "
      "held them up for {:.0f} % of the time",
      cpu_, 100.0 * seen.load, 100.0 * seen.held_up);
}

}  // namespace posed::system
