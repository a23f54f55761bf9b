// A container or a kernel that refuses the poller's system call is told of at the start.
#include <array>
#include <cerrno>
#include <cstddef>
#include <string>
#include <thread>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <catch2/catch.hpp>

#include "daemon/system/event_fd.hpp"

namespace posed::system {
namespace {

// From now on the calling thread, and no other, is refused this system call. False if that cannot
// be done here.
bool refuse(unsigned call) {
  std::array filter{
      sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog program{.len = filter.size(), .filter = filter.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

}  // namespace

TEST_CASE("a poller that could not wait is an error when it is opened") {
  bool refused = false;
  std::string error;
  std::thread([&] {
    refused = refuse(SYS_epoll_pwait2);
    if (auto poller = Poller::open(); !poller) error = poller.error().text();
  }).join();
  if (!refused) {
    WARN("skipped: no system call can be refused here");
    return;
  }
  CHECK(error.contains("epoll_pwait2"));
  CHECK(error.contains("Linux 5.11"));
}

}  // namespace posed::system
