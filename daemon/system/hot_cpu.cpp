#include "daemon/system/hot_cpu.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>

#include <spdlog/spdlog.h>
#include <time.h>

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

bool SharingRule::share(double load, std::int64_t now_ns) noexcept {
  if (since_ns_ == kNoTime_ns) since_ns_ = now_ns;
  const std::int64_t passed_ns = now_ns - since_ns_;
  if (shared_ ? load <= kFull : load >= 1.0 || passed_ns < try_after_ns_) return shared_;
  if (shared_) {
    const bool lasted = passed_ns >= kFirstTry_ns;
    try_after_ns_ = lasted ? kFirstTry_ns : std::min(2 * try_after_ns_, kRarest_ns);
  }
  since_ns_ = now_ns;
  return shared_ = !shared_;
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

HotCpu::~HotCpu() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  ended_.notify_one();
  thread_.join();
}

void HotCpu::add(pthread_t thread) {
  const std::lock_guard lock(mutex_);
  members_.push_back(thread);
  move(shared_ ? set_of(cpu_) : allowed_);
}

std::int64_t HotCpu::run_ns() const {
  std::int64_t sum_ns = 0;
  for (const pthread_t member : members_) {
    clockid_t clock{};
    timespec time{};
    if (pthread_getcpuclockid(member, &clock) != 0 || clock_gettime(clock, &time) != 0) continue;
    sum_ns += std::int64_t{time.tv_sec} * kNanosPerSecond + time.tv_nsec;
  }
  return sum_ns;
}

// A refusal (a service without this system call, a CPU that was taken from it) leaves the thread
// where it may run.
void HotCpu::move(const cpu_set_t& where) {
  for (const pthread_t member : members_) {
    static_cast<void>(pthread_setaffinity_np(member, sizeof where, &where));
  }
}

void HotCpu::watch() {
  SharingRule rule;
  std::unique_lock lock(mutex_);
  std::int64_t before_ns = monotonic_ns(), run_before_ns = run_ns();
  while (!ended_.wait_for(lock, kLookEvery, [this] { return end_; })) {
    const std::int64_t now_ns = monotonic_ns(), run_now_ns = run_ns();
    const double load = seconds(run_now_ns - run_before_ns) / seconds(now_ns - before_ns);
    before_ns = now_ns;
    run_before_ns = run_now_ns;
    const bool share = rule.share(load, now_ns);
    if (share == shared_) continue;
    shared_ = share;
    move(share ? set_of(cpu_) : allowed_);
    if (share) {
      spdlog::info("reader, pipeline and publisher share CPU {} again", cpu_);
    } else {
      spdlog::info("reader, pipeline and publisher need {:.0f} % of CPU {}: they use all CPUs now",
                   100.0 * load, cpu_);
    }
  }
}

}  // namespace posed::system
