// Trigger gives the datagrams of capture systems their effect: takes. No socket, no thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "daemon/control/request_handler.hpp"
#include "daemon/control/trigger_message.hpp"
#include "proto/frame/time.hpp"

namespace posed::control {

class Trigger {
 public:
  // Takes that may begin at once, and how often beyond that: nobody begins more by hand, and
  // without a limit any program of this machine could fill a recording with takes.
  static constexpr std::int64_t kAtOnce = 20;
  static constexpr std::int64_t kStartEvery_ns = 2 * kNanosPerSecond;

  // `daemon_control` outlives the object.
  Trigger(DaemonControl& daemon_control, Clock clock)
      : daemon_control_(daemon_control), clock_(clock) {}

  // `sender`: the address that sent the datagram. What is refused is counted and written to the
  // log, which holds back repetitions.
  void handle(std::string_view datagram, const std::string& sender);

  [[nodiscard]] std::uint64_t marked() const noexcept { return marked_; }
  [[nodiscard]] std::uint64_t repeated() const noexcept { return repeated_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  [[nodiscard]] bool is_repeated(const TriggerMessage& message, const std::string& sender);
  [[nodiscard]] bool comes_too_fast();

  DaemonControl& daemon_control_;
  Clock clock_;
  // When as many starts will have been allowed as there were; at most kAtOnce of them ahead of now.
  std::int64_t allowed_ns_ = kNoTime_ns;
  std::string last_;  // sender, kind and PacketID of the last command that had one
  std::uint64_t marked_ = 0, repeated_ = 0, refused_ = 0;
};

}  // namespace posed::control
