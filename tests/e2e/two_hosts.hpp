// Two computers on one network: the test's own network namespace, in which posed runs, and another
// one for the device. For a process that runs inside `unshare --user --map-root-user --net`, where
// it may make network interfaces without being root.
#pragma once

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include <catch2/catch.hpp>

namespace posed::test {

class TwoHosts {
 public:
  static constexpr const char* kStage = "10.9.8.1";   // where posed runs, interface stage0
  static constexpr const char* kDevice = "10.9.8.2";  // interface device0

  TwoHosts() {
    stage_ = ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    REQUIRE(::unshare(CLONE_NEWNET) == 0);
    device_ = ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    REQUIRE(::setns(stage_, CLONE_NEWNET) == 0);
    run("ip link set lo up");
    plug();
  }
  ~TwoHosts() {
    ::close(stage_);
    ::close(device_);
  }
  TwoHosts(const TwoHosts&) = delete;
  TwoHosts& operator=(const TwoHosts&) = delete;

  // What `work` opens or starts is on the device's computer, and stays there.
  template <typename Work>
  void on_device(const Work& work) const {
    REQUIRE(::setns(device_, CLONE_NEWNET) == 0);
    work();
    REQUIRE(::setns(stage_, CLONE_NEWNET) == 0);
  }

  // The network interfaces come, and go with all that the system knew about them.
  void plug() const {
    run("ip link add stage0 type veth peer name device0");
    run("ip link set device0 netns /proc/" + std::to_string(::getpid()) + "/fd/" +
        std::to_string(device_));
    run("ip address add " + std::string(kStage) + "/24 dev stage0 && ip link set stage0 up");
    on_device([] {
      run("ip address add " + std::string(kDevice) + "/24 dev device0 && ip link set device0 up");
      run("ip route add 224.0.0.0/4 dev device0");
    });
  }
  void unplug() const { run("ip link delete stage0"); }

  static void run(const std::string& command) {
    INFO(command);
    REQUIRE(std::system(command.c_str()) == 0);
  }

 private:
  int stage_ = -1, device_ = -1;
};

}  // namespace posed::test
