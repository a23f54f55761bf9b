// An emulated glove whose hand takes the poses that a test sets, on its own thread.
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <utility>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/fit.hpp"

namespace posed::test {

class PosingGlove {
 public:
  using Pose = drivers::glove::Pose;

  explicit PosingGlove(const std::string& driver = "cyberglove",
                       emulate::EmulatedPort port = emulate::EmulatedPort::open_pty({}).value(),
                       const drivers::Options& options = {})
      : glove_(
            drivers::find_driver(driver)->emulate(options).value(), std::move(port),
            emulate::hand_motion([this](double) { return drivers::glove::hand_in(pose_.load()); }),
            {}),
        thread_([this](const std::stop_token& stop) { glove_.run(stop); }) {}

  [[nodiscard]] std::string port() const { return glove_.port(); }
  void hold(Pose pose) { pose_ = pose; }

 private:
  std::atomic<Pose> pose_{Pose::kFlat};
  emulate::EmulatedDevice glove_;
  std::jthread thread_;
};

}  // namespace posed::test
