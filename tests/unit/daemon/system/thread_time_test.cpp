#include "daemon/system/thread_time.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>

namespace posed::system {

TEST_CASE("the kernel counts what a thread runs") {
  const auto before = time_of_thread(gettid());
  if (!before) {
    WARN("skipped: this kernel does not count");
    return;
  }
  std::optional<ThreadTime> after = before;
  for (int look = 0; look < 1'000'000 && after->ran_ns == before->ran_ns; ++look) {
    after = time_of_thread(gettid());
    REQUIRE(after);
  }
  const ThreadTime passed = *after - *before;
  CHECK(passed.ran_ns > 0);
  CHECK(passed.waited_ns >= 0);
  CHECK_FALSE(time_of_thread(-1));
}

}  // namespace posed::system
