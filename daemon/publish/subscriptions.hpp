// Subscriptions: what one subscriber may ask for, and how often. A subscription is the beginning of
// a topic. Those that begin a topic of ours cost nothing. Others wait for a stream that may come
// later; each costs memory in libzmq's tables, so there is an end to them. Who goes beyond it is to
// be cut off: that alone takes its subscriptions out of libzmq again.
//
// (libzmq's XPUB_MANUAL, by which a subscription could be refused one by one, is not usable in
// 4.3.4: when a peer subscribes and leaves before we look, it hands us the peer's freed pipe, and
// the next message is sent through it. It also keeps every refused topic.)
// No socket, no clock of its own, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace posed::publish {

inline constexpr std::size_t kMaxWanted = 4096;   // distinct ones that could become a topic
inline constexpr std::size_t kMaxImpossible = 8;  // of one peer, that could never
inline constexpr double kMaxAtOnce = 8192.0;      // messages of one peer at once
inline constexpr double kMaxPerSecond = 256.0;    // and over time

// Whether topics of a posed may begin so: "", "po", "pose/", "pose/left-han", "stats".
[[nodiscard]] bool could_become_topic(std::string_view prefix);

class Subscriptions {
 public:
  // `is_topic` says whether a topic that exists begins with the prefix.
  explicit Subscriptions(std::function<bool(std::string_view prefix)> is_topic)
      : is_topic_(std::move(is_topic)) {}

  // The peer subscribes (or, with `on` false, unsubscribes). False: it has gone too far.
  [[nodiscard]] bool ask(int peer, std::string_view prefix, bool on, std::int64_t now_ns);
  // The peer is gone, and what it asked for with it.
  void forget(int peer);

  [[nodiscard]] std::size_t wanted() const noexcept { return wanted_.size(); }

 private:
  struct Peer {
    double budget = kMaxAtOnce;  // messages that it may still send
    std::int64_t asked_ns = 0;
    std::set<std::string, std::less<>> waits;  // what it asked for that is no topic yet
    std::size_t impossible = 0;                // of those
  };
  [[nodiscard]] bool within_budget(Peer& peer, std::int64_t now_ns) const;
  void drop(const std::string& prefix);

  std::function<bool(std::string_view prefix)> is_topic_;
  std::map<int, Peer> peers_;
  std::map<std::string, std::size_t, std::less<>> wanted_;  // by how many peers; possible ones only
};

}  // namespace posed::publish
