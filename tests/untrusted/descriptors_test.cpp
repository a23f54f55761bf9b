// A process has a limited number of file descriptors. Untrusted clients must not take them all, nor
// make libzmq's listener retry accept() in a busy loop.
#include <vector>

#include "tests/support/asked_again.hpp"
#include "tests/untrusted/target.hpp"

namespace posed::test {
namespace {

// 200 peers at a daemon that may open 64 descriptors.
struct Crowd {
  double cpu_share = 0.0;
  std::uint64_t lost = 0;  // by an innocent subscriber
};

Crowd crowd() {
  Target target;
  target.most_files = 64;
  target.start();
  Innocent innocent(target.publish);
  std::vector<RawPeer> peers;
  for (int i = 0; i < 100; ++i) {
    peers.emplace_back(target.publish);
    peers.emplace_back(target.control);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const double cpu_s = target.daemon->cpu_s();
  const auto start = std::chrono::steady_clock::now();
  CHECK(innocent.receives(60));
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
  const double share = (target.daemon->cpu_s() - cpu_s) / passed.count();
  peers.clear();
  CHECK(target.ctl({"stop"}).code == 0);
  return {.cpu_share = share, .lost = innocent.lost};
}

TEST_CASE("connections beyond the daemon's descriptor limit are cut, and cost no CPU") {
  const Crowd seen = asked_again(crowd, [](const Crowd& one) { return one.lost == 0; });
  std::printf("200 peers, 64 descriptors: cpu %.1f %%\n", 100.0 * seen.cpu_share);
  CHECK(seen.cpu_share < 0.2);
  CHECK(seen.lost == 0);
}

}  // namespace
}  // namespace posed::test
