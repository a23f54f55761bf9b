#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <utility>
#include <vector>

#include "proto/fbx/glb_of_fbx.hpp"

namespace posed::fbx {
namespace {

// Assimp takes sixty times the length of a text file. A binary one may unpack to a thousand times.
constexpr rlim_t kMinMemory_bytes = 400'000'000, kMemoryOfAByte = 100;
constexpr rlim_t kMaxMemory_bytes = 4'000'000'000;
constexpr rlim_t kMaxComputing_s = 60;

#if defined(__x86_64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kMachine = 0;  // unknown: nothing is allowed
#endif

// What a program needs that computes. Everything else fails as if it were forbidden (EPERM).
constexpr std::array kAllowed{
    SYS_read,           SYS_write,         SYS_brk,        SYS_mmap,
    SYS_munmap,         SYS_mremap,        SYS_mprotect,   SYS_madvise,
    SYS_futex,          SYS_exit,          SYS_exit_group, SYS_rt_sigaction,
    SYS_rt_sigprocmask, SYS_rt_sigreturn,  SYS_getpid,     SYS_gettid,
    SYS_tgkill,         SYS_close,         SYS_lseek,      SYS_newfstatat,
    SYS_getrandom,      SYS_clock_gettime, SYS_sched_yield};

sock_filter statement(int code, std::uint32_t value, int yes = 0, int no = 0) {
  return {.code = static_cast<std::uint16_t>(code),
          .jt = static_cast<std::uint8_t>(yes),
          .jf = static_cast<std::uint8_t>(no),
          .k = value};
}

bool allow_only_computing() {
  std::vector<sock_filter> filter{statement(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
                                  statement(BPF_JMP | BPF_JEQ | BPF_K, kMachine, 1, 0),
                                  statement(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
                                  statement(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
  for (const long call : kAllowed) {
    filter.push_back(statement(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1));
    filter.push_back(statement(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  filter.push_back(statement(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  const sock_fprog program{.len = static_cast<unsigned short>(filter.size()),
                           .filter = filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

}  // namespace

Result<> confine(std::size_t file_bytes) {
  const rlim_t memory_bytes =
      file_bytes < kMaxMemory_bytes / kMemoryOfAByte
          ? std::min(kMinMemory_bytes + kMemoryOfAByte * file_bytes, kMaxMemory_bytes)
          : kMaxMemory_bytes;
  const std::vector<std::pair<int, rlim_t>> limits{
#if !defined(__SANITIZE_ADDRESS__)  // the address sanitizer reserves terabytes
      {RLIMIT_AS, memory_bytes},
#endif
      {RLIMIT_CPU, kMaxComputing_s},
      {RLIMIT_CORE, 0},
      {RLIMIT_FSIZE, 0},
      {RLIMIT_NOFILE, 3}};
  for (const auto& [kind, value] : limits) {
    const rlimit limit{.rlim_cur = value, .rlim_max = value};
    if (::setrlimit(static_cast<__rlimit_resource>(kind), &limit) != 0) {
      return fail("is read in a process with limits, which this system does not let posed set (" +
                  errno_text() + "); convert the file to .bvh or .glb elsewhere");
    }
  }
  if (allow_only_computing()) return {};
  return fail("is read in a process without rights, which this system cannot start (" +
              errno_text() + "); convert the file to .bvh or .glb elsewhere");
}

}  // namespace posed::fbx
