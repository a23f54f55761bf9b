// Trigger gives the datagrams of capture systems their effect: takes. No socket, no thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "daemon/control/request_handler.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::control {

// The datagrams by which capture systems start and stop each other's recordings: one XML document
// with the root CaptureStart or CaptureStop, whose children hold their values in an attribute
// VALUE. Senders order the children differently and add others. Untrusted bytes in; cold.
inline constexpr std::size_t kMaxTrigger = 8 * 1024;  // bytes of a datagram

struct TriggerMessage {
  bool start = true;
  // Untrusted texts as sent; empty where the sender left them out.
  std::string name{}, notes{}, description{}, session{};
  std::string delay{};      // milliseconds; some senders write words here
  std::string packet_id{};  // decimal digits
  std::string result{};     // of a stop: "SUCCESS", "FAIL", "CANCEL"
  std::string timecode{};   // "hh:mm:ss:ff"; empty also if it is not of that form
};

// Closing zeros and white space, a BOM and leading white space are allowed. Entities and document
// types are refused, and so is everything else that is not one whole element. The error is a
// sentence for people.
Result<TriggerMessage> parse_trigger(std::string_view datagram);

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
