// Relay: passes on what one or several daemons publish, so that hundreds of subscribers cost the
// capture machine one connection. Messages pass unchanged; subscriptions travel the other way. A
// subscriber that comes later gets the skeletons of its streams at once. Newest data wins: every
// queue is short, and a slow subscriber loses messages for itself alone.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/publish/publish_socket.hpp"
#include "daemon/tools/relay/merged_stats.hpp"
#include "daemon/tools/relay/relayed_streams.hpp"
#include "daemon/tools/relay/upstream.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::relay {

inline constexpr std::size_t kMaxUpstreams = 16;

struct RelayOptions {
  void* context = nullptr;  // the ZeroMQ context; outlives the relay
  std::vector<UpstreamSettings> from{};
  std::string endpoint{};
  // Checks every subscriber; null (in tests): all are admitted.
  net::ZapAuthenticator* authenticator = nullptr;
  std::string secret_z85{};  // the relay's key for its subscribers; empty: no CURVE
};

struct RelayCounts {
  std::uint64_t messages = 0;        // passed on
  std::uint64_t bytes = 0;           // of them
  std::uint64_t late_skeletons = 0;  // sent again for subscribers that came later
  std::uint64_t foreign = 0;         // dropped: not a message of posed
  std::uint64_t clashes = 0;  // dropped: another upstream has a stream of that name, or too many
  std::size_t upstreams = 0;  // connected now
  std::size_t subscribers = 0;
  std::size_t subscriptions = 0;  // distinct
  std::size_t streams = 0;
};

class Relay {
 public:
  // Binds, and connects in the background.
  [[nodiscard]] static Result<std::unique_ptr<Relay>> open(const RelayOptions& options);

  [[nodiscard]] const std::string& endpoint() const noexcept { return socket_.endpoint(); }

  // Does everything that is due and never waits. Returns the latest time of the next call; call
  // earlier if a socket is readable.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);
  // Waits until a socket is readable, but at most so long.
  void wait(std::int64_t timeout_ns);

  [[nodiscard]] RelayCounts counts() const;
  // Disconnects subscribers whose key was withdrawn; needs an authenticator.
  void check_subscribers();

 private:
  Relay(const RelayOptions& options, publish::PublishSocket socket, std::vector<Upstream> from);
  // Passes on what waits from one upstream; returns false if more may wait.
  [[nodiscard]] bool drain(std::size_t upstream, std::int64_t now_ns);
  void pass_on(std::size_t upstream, std::string_view topic, net::Message& body,
               std::int64_t now_ns);
  void send(std::string_view topic, std::string_view bytes);
  // Tells the upstreams which subscriptions have come or gone, at the pace that they accept.
  void pass_subscriptions(std::int64_t now_ns);
  // Makes the queues as long as a quarter of a second of the most that has passed.
  void every_second(std::int64_t now_ns);

  net::ZapAuthenticator* authenticator_;
  publish::PublishSocket socket_;
  std::vector<Upstream> upstreams_;
  publish::Subscriptions subscriptions_;
  std::set<std::string> wanted_, passed_;  // subscriptions: of subscribers; known to the upstreams
  std::set<std::string> changed_;          // in which the two may differ
  double budget_;                          // changes that may still be passed now
  std::int64_t budgeted_ns_ = 0;
  RelayedStreams streams_;
  MergedStats stats_;
  RelayCounts counts_;
  std::int64_t second_ns_ = kNoTime_ns;  // when the last second began, and how many had passed
  std::uint64_t passed_before_ = 0;
  int queue_ = 0;  // messages
};

}  // namespace posed::relay
