// The messages between the bridge and a page. From the page: a word in JSON (text), or a numbered
// request to the daemon (binary). To the page: what the daemon published behind its topic (binary),
// and the bridge's own words in JSON (text). The page's are untrusted. No socket; pure functions.
// Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "daemon/tools/view/outbox.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"

namespace posed::view {

// Bytes of a message of the page: a request of the largest size that a daemon takes, numbered.
inline constexpr std::size_t kMaxPageMessage = 64 * 1024 + 4;
inline constexpr std::size_t kMaxWord = 1024;  // bytes of its JSON

struct ReadyWord {};  // the page can show one more pose of each stream
struct ClockWord {    // asks for the bridge's clock
  double t0 = 0.0;    // the page's own time, given back
};
struct UnknownWord {};  // of a newer page, or nonsense: ignored
using PageWord = std::variant<UnknownWord, ReadyWord, ClockWord>;

[[nodiscard]] PageWord read_word(std::string_view text);

struct PageRequest {
  std::uint32_t number = 0;  // the page's, for the reply
  v1::ControlRequest request{};
  std::string refusal{};  // why it does not pass, one sentence; empty: it may pass
};

// An Error if there is not even a number.
[[nodiscard]] Result<PageRequest> read_request(std::string_view bytes);

// What the daemon published: the length of the topic, the topic, the body. The topic has at most
// 255 bytes.
[[nodiscard]] Bytes with_topic(std::string_view topic, std::string_view body);
// The topic of the reply to a request of the page.
[[nodiscard]] std::string reply_topic(std::uint32_t number);
// A reply that the bridge gives itself: refused, and why.
[[nodiscard]] Parcel refusal_reply(std::uint32_t number, const std::string& sentence);

// Whether the page may change anything, and why not.
struct ControlRight {
  bool may = false;
  std::string reason = "not known yet";  // empty when it may
  bool operator==(const ControlRight&) const = default;
};
// Whether the daemon answers, in words.
struct DaemonState {
  bool alive = false;
  std::string sentence{};
  bool operator==(const DaemonState&) const = default;
};
struct Greeting {
  std::string version{};
  std::string connect{};      // the daemon's endpoint
  bool same_machine = false;  // the daemon's clock is the bridge's
};

[[nodiscard]] Parcel hello_word(const Greeting& greeting, const ControlRight& right);
[[nodiscard]] Parcel control_word(const ControlRight& right);
[[nodiscard]] Parcel daemon_word(const DaemonState& state);
[[nodiscard]] Parcel clock_word(double t0, std::int64_t monotonic_ns);
[[nodiscard]] Parcel no_reply_word(std::uint32_t number, const std::string& sentence);

}  // namespace posed::view
