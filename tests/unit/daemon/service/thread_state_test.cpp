#include "daemon/service/service.hpp"

#include <catch2/catch.hpp>

#include <chrono>
#include <thread>

#include <unistd.h>

#include "daemon/system/realtime.hpp"

namespace posed::service {
namespace {

TEST_CASE("a thread that the kernel lets wait uninterruptibly is found by its name") {
#ifdef __SANITIZE_THREAD__
  WARN("skipped: the thread sanitizer makes an ordinary fork() of vfork()");
  return;
#endif
  int pipe_ends[2];
  REQUIRE(::pipe(pipe_ends) == 0);
  CHECK_FALSE(waits_for_disk("disk (D) waiter"));
  // The kernel treats who calls vfork() like who waits for a disk, until the child ends.
  std::thread waiter([&] {
    system::name_thread("disk (D) waiter, a long name");
    if (::vfork() == 0) {
      char byte = 0;
      _exit(::read(pipe_ends[0], &byte, 1) == 1 ? 0 : 1);
    }
  });
  bool found = false;
  for (int i = 0; i < 1000 && !found; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    found = waits_for_disk("disk (D) waiter, a long name");
  }
  CHECK(found);
  CHECK_FALSE(waits_for_disk("disk"));
  CHECK_FALSE(waits_for_disk(""));
  REQUIRE(::write(pipe_ends[1], "x", 1) == 1);
  waiter.join();
  CHECK_FALSE(waits_for_disk("disk (D) waiter"));
  ::close(pipe_ends[0]);
  ::close(pipe_ends[1]);
}

}  // namespace
}  // namespace posed::service
