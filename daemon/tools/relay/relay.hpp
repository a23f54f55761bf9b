// Upstream: a relay's one connection to a daemon, or to another relay. It connects in the
// background and again whenever the connection is lost; libzmq then repeats the subscriptions.
// After a refusal a new one tries again. Only few messages wait, so what comes after a stall is
// new. One thread uses it. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/publish/publish_socket.hpp"
#include "daemon/system/event_fd.hpp"
#include "daemon/tools/link/daemon_socket.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::relay {

class Upstream {
 public:
  // `context` outlives it.
  static Result<Upstream> open(void* context, const link::Peer& peer);

  [[nodiscard]] void* socket() const noexcept { return socket_.get(); }
  // Readable: handle_news().
  [[nodiscard]] int news_fd() const noexcept { return socket_.news_fd(); }
  [[nodiscard]] const std::string& endpoint() const noexcept { return socket_.peer().endpoint; }

  // Returns false if the connection cannot take more subscriptions now.
  [[nodiscard]] bool subscribe(const std::string& prefix, bool on);

  [[nodiscard]] link::Received receive(net::Message& topic, net::Message& body) noexcept {
    return socket_.receive(topic, body);
  }

  // Reads what happened to the connection, and logs when it was made, lost or refused.
  void handle_news(std::int64_t now_ns);
  // Tries again some time after a refusal or an end: returns true if a new socket has been opened,
  // which knows no subscriptions.
  [[nodiscard]] bool opens_anew(std::int64_t now_ns);
  [[nodiscard]] bool established() const noexcept { return socket_.established(); }
  // Logs what the upstream sends that it should not, the first time. `fault` is a literal; `stream`
  // is an example, or empty.
  void warn_once(std::string_view fault, std::string_view stream = {});

 private:
  Upstream(void* context, link::DaemonSocket socket)
      : context_(context), socket_(std::move(socket)) {}
  // Logs why there is no connection, unless that was said last.
  void complain(const std::string& why);

  void* context_;
  link::DaemonSocket socket_;
  link::Retry retry_{};
  std::string complaint_{};  // since the connection stood last
  std::set<std::string_view> warned_{};
};

// MergedStats: the stats of several daemons as those of one, so that `posed top` and `posed
// monitor` see all streams of a relay.
class MergedStats {
 public:
  explicit MergedStats(std::size_t upstreams) : latest_(upstreams) {}

  // Stats came from an upstream. Returns what to publish: of one upstream its own bytes; of several
  // the streams and sources of all that are not silent, each stream with the clock of its own
  // machine, and everything else as the first of them says it, whenever that one sends its stats.
  // Of a stream or source that several of them name, the first one's counts: relays in a circle
  // send everything back. They are never more than posed's clients take: each upstream has its
  // share of the bytes and parts. Empty: nothing now. `valid` is false for bytes that are no stats.
  [[nodiscard]] std::optional<std::string> accept(std::size_t upstream, std::string_view bytes,
                                                  std::int64_t now_ns, bool& valid);
  // How many streams and sources of an upstream had no room so far.
  [[nodiscard]] std::uint64_t left_out(std::size_t upstream) const {
    return latest_[upstream].left_out;
  }

 private:
  struct Latest {
    std::string bytes{};  // as bytes, because a hostile message takes much more memory parsed
    std::size_t parts = 0;
    std::int64_t at_ns = 0;
    bool ever = false;
    std::uint64_t left_out = 0;
  };
  std::vector<Latest> latest_;  // [upstream]
};

// Of each upstream, and link::kMaxLinkStreams of all.
inline constexpr std::size_t kMaxStreams = 1024;
inline constexpr std::size_t kMaxSkeletonBytes = 16 * 1024 * 1024;  // of all upstreams together

// The stream of a topic such as "pose/walker"; empty for other topics.
[[nodiscard]] std::string_view stream_of_topic(std::string_view topic);

enum class Admission : std::uint8_t { kPasses, kOthersName, kTooMany };

// RelayedStreams: what a relay knows of the streams that pass it. Each stream belongs to the
// upstream that sends it; a second one that sends a stream of the same name is not mixed in. The
// last skeleton of each stream is kept for subscribers that come later. Every upstream has room of
// its own, and its share of what all may have, so that none costs another a stream. No socket, no
// clock of its own, one thread. Cold: allocates.
class RelayedStreams {
 public:
  explicit RelayedStreams(std::size_t upstreams) : shares_(upstreams) {}

  // A message of the stream came from an upstream (its index): a pose or skeleton (`poses`), or
  // something else. Tells whether it may pass. A stream that has sent poses comes before one that
  // has not: it takes its name from another upstream, or its place among kMaxStreams.
  [[nodiscard]] Admission admit(std::string_view stream, std::size_t upstream, bool poses,
                                std::int64_t now_ns);

  // The skeleton of an admitted stream has just been passed on. One beyond its upstream's share of
  // kMaxSkeletonBytes is not kept.
  void keep_skeleton(std::string_view stream, std::string_view bytes, std::int64_t now_ns);

  // Somebody has subscribed to the topics that begin with `prefix`: their skeletons become due, at
  // once or 50 ms after they were last sent, because all their subscribers get them again.
  void want_skeletons(std::string_view prefix);

  // Gives the skeletons that are due to `send`; returns when the next one is.
  [[nodiscard]] std::int64_t send_due(
      std::int64_t now_ns,
      const std::function<void(std::string_view topic, std::string_view bytes)>& send);

  [[nodiscard]] std::size_t streams() const noexcept { return streams_.size(); }
  [[nodiscard]] std::size_t skeleton_bytes(std::size_t upstream) const {
    return shares_[upstream].skeleton_bytes;
  }

 private:
  struct Stream {
    std::size_t upstream = 0;
    bool poses = false;  // it has sent some
    std::int64_t received_ns = 0;
    std::string skeleton_topic{}, skeleton{};  // empty: none is kept
    std::int64_t sent_ns = 0, due_ns = 0;      // of the skeleton
  };
  using Streams = std::map<std::string, Stream, std::less<>>;
  struct Share {  // of an upstream
    std::size_t streams = 0, posing = 0, skeleton_bytes = 0;
  };
  // Returns false if the upstream may have no more streams.
  [[nodiscard]] bool make_room(std::size_t upstream, bool poses);
  // Forgets a stream of this upstream, rather one without poses.
  void forget_one_of(std::size_t upstream);
  // Forgets streams that have sent nothing for a while; at most once a second.
  void forget_old(std::int64_t now_ns);
  void forget(Streams::iterator one);

  Streams streams_;
  std::vector<Share> shares_;                  // [upstream]
  std::int64_t due_ns_ = system::kForever_ns;  // no skeleton is due before
  std::int64_t forgot_ns_ = 0;
};

inline constexpr std::size_t kMaxUpstreams = 16;

struct RelayOptions {
  void* context = nullptr;  // the ZeroMQ context; outlives the relay
  std::vector<link::Peer> from{};
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
  std::uint64_t stats_left_out = 0;  // streams and sources that had no room in merged stats
  std::size_t upstreams = 0;         // connected now
  std::size_t subscribers = 0;
  std::size_t subscriptions = 0;  // distinct
  std::size_t streams = 0;
};

// Relay: passes on what one or several daemons publish, so that hundreds of subscribers cost the
// capture machine one connection. Messages pass unchanged; subscriptions travel the other way. A
// subscriber that comes later gets the skeletons of its streams at once. Newest data wins: every
// queue is short, and a slow subscriber loses messages for itself alone.
class Relay {
 public:
  // Binds, and connects in the background.
  static Result<std::unique_ptr<Relay>> open(const RelayOptions& options);

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
  // Tells an upstream that knows of no subscription.
  void subscribe_all(Upstream& upstream);
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
