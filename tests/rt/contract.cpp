#include "tests/rt/contract.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <spdlog/sinks/sink.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <ucontext.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <typeinfo>

#include "daemon/system/hot_mark.hpp"

#ifndef PR_SET_SYSCALL_USER_DISPATCH
#define PR_SET_SYSCALL_USER_DISPATCH 59
#define PR_SYS_DISPATCH_ON 1
#endif

namespace posed::rt {
namespace {

using system::hot_marks;

std::array<std::atomic<std::uint64_t>, static_cast<std::size_t>(Breach::kCount)> counts{};
std::atomic<long> last_call{-1};

void note(Breach breach) noexcept {
  if (hot_marks.contract != 0) counts[static_cast<std::size_t>(breach)].fetch_add(1);
}

// The library's function behind one that is replaced here. Looked up before main(), so never in hot
// code.
template <typename Function>
Function* behind(const char* name) noexcept {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

class CountingLogSink final : public spdlog::sinks::sink {
 public:
  void log(const spdlog::details::log_msg& /*message*/) override { note(Breach::kLog); }
  void flush() override {}
  void set_pattern(const std::string& /*pattern*/) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter> /*formatter*/) override {}
};

#if defined(__x86_64__)
// The kernel did not execute the call but sent SIGSYS: counts the call, then executes it, so that
// the thread continues. The mark stays off until the next allowed call.
void on_forbidden_call(int /*signal*/, siginfo_t* info, void* context) {
  hot_marks.no_syscalls = 0;
  note(Breach::kSystemCall);
  last_call.store(info->si_syscall);
  greg_t* registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  long result = info->si_syscall;
  register long r10 asm("r10") = registers[REG_R10];
  register long r8 asm("r8") = registers[REG_R8];
  register long r9 asm("r9") = registers[REG_R9];
  asm volatile("syscall"
               : "+a"(result)
               : "D"(registers[REG_RDI]), "S"(registers[REG_RSI]), "d"(registers[REG_RDX]),
                 "r"(r10), "r"(r8), "r"(r9)
               : "rcx", "r11", "memory");
  registers[REG_RAX] = result;
}
#endif

}  // namespace

std::uint64_t breaches(Breach breach) noexcept {
  return counts[static_cast<std::size_t>(breach)].load();
}
long last_system_call() noexcept { return last_call.load(); }

void forget_breaches() noexcept {
  for (auto& count : counts) count.store(0);
  last_call.store(-1);
}

void watch_log() {
  auto logger = std::make_shared<spdlog::logger>("rt", std::make_shared<CountingLogSink>());
  logger->set_level(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

bool watch_system_calls() noexcept {
#if defined(__x86_64__)
  struct sigaction action{};
  action.sa_sigaction = on_forbidden_call;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  if (sigaction(SIGSYS, &action, nullptr) != 0) return false;
  return prctl(PR_SET_SYSCALL_USER_DISPATCH, PR_SYS_DISPATCH_ON, 0, 0, &hot_marks.no_syscalls) == 0;
#else
  return false;
#endif
}

}  // namespace posed::rt

// Replacements of library functions. The executable's symbols take precedence over those of shared
// libraries.
namespace {
using posed::rt::behind;
using posed::rt::Breach;
using posed::rt::note;

auto* const kMutexLock = behind<int(pthread_mutex_t*)>("pthread_mutex_lock");
auto* const kReadLock = behind<int(pthread_rwlock_t*)>("pthread_rwlock_rdlock");
auto* const kWriteLock = behind<int(pthread_rwlock_t*)>("pthread_rwlock_wrlock");
auto* const kThrow = behind<void(void*, std::type_info*, void (*)(void*))>("__cxa_throw");
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);                      // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t number, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* block, std::size_t size);        // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
void __libc_free(void* block);  // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t size) noexcept {
  note(Breach::kAllocation);
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  note(Breach::kAllocation);
  return __libc_calloc(number, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  note(Breach::kAllocation);
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note(Breach::kAllocation);
  return __libc_memalign(alignment, size);
}
void free(void* block) noexcept {
  note(Breach::kAllocation);
  __libc_free(block);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  note(Breach::kLock);
  // Before the constructors of this file have run, libraries may lock; only one thread exists then.
  return kMutexLock != nullptr ? kMutexLock(mutex) : 0;
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  note(Breach::kLock);
  return kReadLock(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  note(Breach::kLock);
  return kWriteLock(lock);
}
[[noreturn]] void __cxa_throw(void* thrown, void* type, void (*destroy)(void*)) {  // NOLINT
  note(Breach::kThrow);
  kThrow(thrown, static_cast<std::type_info*>(type), destroy);
  std::abort();
}
}
