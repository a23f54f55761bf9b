// The datagrams by which capture systems start and stop each other's recordings: one XML document
// with the root CaptureStart or CaptureStop, whose children hold their values in an attribute
// VALUE. Senders order the children differently and add others. Untrusted bytes in; cold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::control {

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

}  // namespace posed::control
