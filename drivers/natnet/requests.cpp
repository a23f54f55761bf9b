#include "drivers/natnet/requests.hpp"

#include "drivers/natnet/protocol.hpp"

namespace posed::drivers::natnet {

Requests::Requests(bool unicast)
    : connect_{.datagram = encode_connect()},
      rate_{.datagram = encode_text(MessageId::kRequest, "FrameRate")},
      bodies_{.datagram = encode_message(MessageId::kRequestModelDef, {})},
      alive_{.datagram = encode_message(MessageId::kKeepAlive, {}), .wanted = unicast} {}

// A server that says who it is may have restarted, with other bodies. RT-safe.
void Requests::accept_server_info() noexcept {
  connect_.wanted = false;
  rate_.wanted = true;
  bodies_.wanted = true;
}

// RT-safe.
bool Requests::is_due(Question& question, std::int64_t now_ns) noexcept {
  if (!question.wanted || now_ns < question.next_ns) return false;
  question.next_ns = now_ns + kAgain_ns;
  return true;
}

// The rate before the bodies, whose description carries it. RT-safe.
std::span<const std::byte> Requests::next(std::int64_t now_ns) noexcept {
  if (received_ns_ != kNoTime_ns && now_ns - received_ns_ > kSilence_ns) connect_.wanted = true;
  if (is_due(connect_, now_ns)) return connect_.datagram;
  if (connect_.wanted) return {};
  if (is_due(rate_, now_ns)) return rate_.datagram;
  if (is_due(bodies_, now_ns)) return bodies_.datagram;
  if (is_due(alive_, now_ns)) return alive_.datagram;
  return {};
}

}  // namespace posed::drivers::natnet
