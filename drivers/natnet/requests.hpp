// Requests: what to ask a NatNet server next. It is asked who it is until it answers and again when
// it was silent, for its frame rate, for its bodies whenever they may have changed, and over
// unicast it also says every second that somebody listens. One datagram per call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/frame/time.hpp"

namespace posed::drivers::natnet {

class Requests {
 public:
  // How often next() should be called.
  static constexpr std::int64_t kPeriod_ns = 100'000'000;

  explicit Requests(bool unicast);  // cold

  // What came from the server. RT-safe.
  void received(std::int64_t arrival_ns) noexcept { received_ns_ = arrival_ns; }
  void accept_server_info() noexcept;
  void accept_rate() noexcept { rate_.wanted = false; }
  void accept_bodies() noexcept { bodies_.wanted = false; }
  void bodies_changed() noexcept { bodies_.wanted = true; }

  // The datagram to send now; empty: none. RT-safe.
  [[nodiscard]] std::span<const std::byte> next(std::int64_t now_ns) noexcept;

 private:
  static constexpr std::int64_t kAgain_ns = kNanosPerSecond;
  static constexpr std::int64_t kSilence_ns = 2 * kNanosPerSecond;

  struct Question {
    std::vector<std::byte> datagram;
    bool wanted = true;
    std::int64_t next_ns = kNoTime_ns;  // not before
  };
  // Whether it is to be asked now; if so, not again for a while.
  [[nodiscard]] static bool is_due(Question& question, std::int64_t now_ns) noexcept;

  Question connect_, rate_, bodies_, alive_;
  std::int64_t received_ns_ = kNoTime_ns;
};

}  // namespace posed::drivers::natnet
