// Runs an emulator on a pseudo-terminal, on its own thread, in place of the real glove.
#pragma once

#include <poll.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include "drivers/emulator.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::test {

class ServedEmulator {
 public:
  // `emulator` must outlive it and is used only by its thread until then.
  explicit ServedEmulator(drivers::Emulator& emulator)
      : emulator_(emulator), thread_([this] { serve(); }) {}
  ~ServedEmulator() {
    stop_ = true;
    thread_.join();
  }
  ServedEmulator(const ServedEmulator&) = delete;
  ServedEmulator& operator=(const ServedEmulator&) = delete;

  [[nodiscard]] const std::string& port() const { return terminal_.port(); }

 private:
  static std::int64_t now_ns() {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  }

  void serve() {
    std::array<std::byte, 256> received{};
    while (!stop_) {
      pollfd ready{.fd = terminal_.fd(), .events = POLLIN, .revents = 0};
      drivers::Emulator::Bytes out;
      if (::poll(&ready, 1, 1) > 0 && (ready.revents & POLLIN) != 0) {
        const ssize_t got = ::read(terminal_.fd(), received.data(), received.size());
        if (got > 0) {
          emulator_.receive(std::span(received).first(static_cast<std::size_t>(got)), now_ns(),
                            out);
        }
      }
      const std::int64_t due_ns = emulator_.next_due_ns();
      if (due_ns != kNoTime_ns && due_ns <= now_ns()) emulator_.emit(now_ns(), out);
      // Bytes that nobody reads are lost, as on a serial line.
      if (!out.empty()) unread_ += ::write(terminal_.fd(), out.data(), out.size()) < 0 ? 1 : 0;
    }
  }

  drivers::Emulator& emulator_;
  PseudoTerminal terminal_;
  std::atomic<bool> stop_{false};
  int unread_ = 0;
  std::thread thread_;  // last: it uses the others
};

}  // namespace posed::test
