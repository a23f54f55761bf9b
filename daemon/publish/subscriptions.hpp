// Subscriptions limits what a subscriber may subscribe to, and how often. A subscription is the
// beginning of a topic. Those that match an existing topic cost nothing. Others wait for a stream
// that may come later; each uses memory in libzmq's tables, so their number is limited. A
// subscriber that exceeds a limit is to be disconnected: only that removes its subscriptions from
// libzmq.
//
// (libzmq's XPUB_MANUAL, which could refuse single subscriptions, is not usable in 4.3.4: when a
// peer subscribes and leaves before the message is read, libzmq passes on the peer's freed pipe,
// and the next message is sent through it. It also keeps every refused topic.) No socket, no clock
// of its own, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace posed::publish {

inline constexpr std::size_t kMaxWanted = 4096;  // distinct prefixes that could become a topic
// Those of one peer, so that one cannot use up what all have.
inline constexpr std::size_t kMaxWantedOfPeer = kMaxWanted / 4;
// prefixes of one peer that could never become one
inline constexpr std::size_t kMaxImpossible = 8;
inline constexpr double kMaxAtOnce = 8192.0;    // messages of one peer in a burst
inline constexpr double kMaxPerSecond = 256.0;  // messages of one peer a second, over time

// Whether a topic of posed may begin like this: "", "po", "pose/", "pose/left-han", "stats".
[[nodiscard]] bool could_become_topic(std::string_view prefix);

class Subscriptions {
 public:
  // `is_topic` returns whether an existing topic begins with the prefix. `changed` hears when the
  // first peer waits for a prefix, and when none does any more; it may be empty.
  explicit Subscriptions(std::function<bool(std::string_view prefix)> is_topic,
                         std::function<void(const std::string& prefix, bool wanted)> changed = {})
      : is_topic_(std::move(is_topic)), changed_(std::move(changed)) {}

  // The peer subscribes (or, if `on` is false, unsubscribes). Returns false if it exceeds a limit.
  [[nodiscard]] bool ask(int peer, std::string_view prefix, bool on, std::int64_t now_ns);
  // The peer has disconnected: forgets its subscriptions.
  void forget(int peer);

  [[nodiscard]] std::size_t wanted() const noexcept { return wanted_.size(); }

 private:
  struct Peer {
    double budget = kMaxAtOnce;  // messages that it may still send
    std::int64_t asked_ns = 0;
    std::set<std::string, std::less<>> waits;  // its subscriptions that match no topic yet
    std::size_t impossible = 0;                // how many of its prefixes can never become a topic
  };
  [[nodiscard]] bool within_budget(Peer& peer, std::int64_t now_ns) const;
  void drop(const std::string& prefix);

  std::function<bool(std::string_view prefix)> is_topic_;
  std::function<void(const std::string& prefix, bool wanted)> changed_;
  std::map<int, Peer> peers_;
  // number of peers by prefix; only prefixes that could become a topic
  std::map<std::string, std::size_t, std::less<>> wanted_;
};

}  // namespace posed::publish
