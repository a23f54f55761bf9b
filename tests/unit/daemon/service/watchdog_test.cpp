#include "daemon/service/service.hpp"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <string>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/support/temp_folder.hpp"

namespace posed::service {
namespace {

constexpr std::int64_t kWithin_ns = 2 * kNanosPerSecond;
constexpr std::int64_t kLook_ns = kWithin_ns / Watchdog::kLooks;

struct TwoThreads {
  system::Pulse reader, writer;
  std::string disk_waiter;               // the thread of which the kernel says so
  std::vector<std::string> asked_about;  // whose state the kernel was asked
  Watchdog watchdog{
      {{.thread = "reader", .pulse = &reader}, {.thread = "writer", .pulse = &writer}},
      kWithin_ns,
      [this](const std::string& thread) {
        asked_about.push_back(thread);
        return thread == disk_waiter;
      }};
  std::int64_t now_ns = 17 * kNanosPerSecond;

  // The next look, after `ns`.
  Watchdog::Finding after(std::int64_t ns) {
    now_ns += ns;
    return watchdog.look(now_ns);
  }
};

TEST_CASE("watchdog: a sign of life at each look, while all threads go on") {
  TwoThreads two;
  int signs = 0;
  static_cast<void>(two.after(0));
  for (int i = 0; i < 100; ++i) {  // 50 ms a turn: 5 s
    two.reader.beat();
    two.writer.beat();
    const auto found = two.after(kNanosPerSecond / 20);
    CHECK(found.stuck.empty());
    signs += found.alive ? 1 : 0;
  }
  CHECK(signs == 10);
  CHECK(two.asked_about.empty());
}

TEST_CASE("watchdog: one thread without progress ends the signs and is named once") {
  TwoThreads two;
  static_cast<void>(two.after(0));
  two.reader.beat();
  const auto stuck = two.after(kLook_ns);
  CHECK_FALSE(stuck.alive);
  CHECK(stuck.stuck == std::vector<std::string>{"writer"});
  two.reader.beat();
  const auto still = two.after(kLook_ns);
  CHECK_FALSE(still.alive);
  CHECK(still.stuck.empty());
  two.reader.beat();
  two.writer.beat();
  const auto again = two.after(kLook_ns);
  CHECK(again.alive);
  CHECK(again.again == std::vector<std::string>{"writer"});
  two.writer.beat();
  CHECK(two.after(kLook_ns).stuck == std::vector<std::string>{"reader"});
}

TEST_CASE("watchdog: a thread that waits for the disk is named once, and the signs go on") {
  TwoThreads two;
  static_cast<void>(two.after(0));
  two.disk_waiter = "writer";
  two.reader.beat();
  const auto waits = two.after(kLook_ns);
  CHECK(waits.alive);
  CHECK(waits.waiting == std::vector<std::string>{"writer"});
  CHECK(two.asked_about == std::vector<std::string>{"writer"});
  two.reader.beat();
  const auto still = two.after(kLook_ns);
  CHECK(still.alive);
  CHECK(still.waiting.empty());
  SECTION("it goes on") {
    two.reader.beat();
    two.writer.beat();
    CHECK(two.after(kLook_ns).again == std::vector<std::string>{"writer"});
  }
  SECTION("another one is stuck meanwhile") {
    const auto stuck = two.after(kLook_ns);
    CHECK_FALSE(stuck.alive);
    CHECK(stuck.stuck == std::vector<std::string>{"reader"});
  }
  SECTION("the disk answers, and it is stuck nevertheless") {
    two.disk_waiter.clear();
    two.reader.beat();
    const auto stuck = two.after(kLook_ns);
    CHECK_FALSE(stuck.alive);
    CHECK(stuck.stuck == std::vector<std::string>{"writer"});
  }
}

TEST_CASE("watchdog: nothing is found between two looks, however often it is called") {
  TwoThreads two;
  static_cast<void>(two.after(0));
  for (int i = 0; i < 9; ++i) {
    const auto found = two.after(kLook_ns / 10);
    CHECK_FALSE(found.alive);
    CHECK(found.stuck.empty());
  }
}

TEST_CASE("watchdog: a time that no clock can count is as good as never, and no time is none") {
  const std::string usec =
      GENERATE("18446744073709551614", "9223372036854776", "soon", "-1", "", "2000000");
  INFO(usec);
  const test::TempFolder folder;
  const std::string path = (folder.path() / "notify").string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int systemd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  REQUIRE(::bind(systemd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  ::setenv("WATCHDOG_USEC", usec.c_str(), 1);
  Service service({});
  char byte = 0;
  int sent = 0;
  for (std::int64_t i = 0; i < 100; ++i) {
    service.turn(i * kWithin_ns);
    while (::recv(systemd, &byte, 1, 0) > 0) ++sent;  // or its queue fills, and turn() waits
  }
  ::unsetenv("NOTIFY_SOCKET");
  ::unsetenv("WATCHDOG_USEC");
  CHECK((sent > 0) == (usec == "2000000"));
  ::close(systemd);
}

}  // namespace
}  // namespace posed::service
