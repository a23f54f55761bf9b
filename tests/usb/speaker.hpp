// Speaker: a simulated glove in use. It moves its emulator's hand and sends one report after the
// other, plugged in or not.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/glove/glove_emulator.hpp"
#include "tests/unit/drivers/emulated.hpp"
#include "tests/usb/hid_glove.hpp"

namespace posed::test {

class Speaker {
 public:
  using Report = std::vector<std::byte>;

  Speaker(HidGlove& glove, std::unique_ptr<drivers::Emulator> emulator)
      : glove_(glove),
        emulator_(std::move(emulator)),
        thread_([this](const std::stop_token& stop) { speak(stop); }) {}

  // All reports sent so far, in order.
  [[nodiscard]] std::vector<Report> said() const {
    const std::lock_guard lock(mutex_);
    return said_;
  }

 private:
  static constexpr std::chrono::milliseconds kPeriod{5};
  static constexpr std::size_t kPoses = 100;

  void speak(const std::stop_token& stop) {
    std::int64_t now_ns = 0;
    for (std::size_t i = 0; !stop.stop_requested(); std::this_thread::sleep_for(kPeriod)) {
      Report report;
      emulator_->receive(glove_.received(), now_ns, report);
      if (emulator_->next_due_ns() != kNoTime_ns) {
        now_ns = emulator_->next_due_ns();
        emulator_->pose(0, drivers::glove::hand_frame(closing_hand(i++ % kPoses, kPoses)));
        emulator_->emit(now_ns, report);
      }
      const std::lock_guard lock(mutex_);
      if (!report.empty() && glove_.say(report)) said_.push_back(report);
    }
  }

  HidGlove& glove_;
  std::unique_ptr<drivers::Emulator> emulator_;
  mutable std::mutex mutex_;
  std::vector<Report> said_;
  std::jthread thread_;
};

}  // namespace posed::test
