#include "daemon/tools/relay/relay.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <set>
#include <span>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/net/peer_guard.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/publish/subscriptions.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/clean.hpp"

namespace posed::relay {
namespace {

// All subscriptions that there may be, and as many changes of them.
constexpr int kSubscriptionsWaiting = static_cast<int>(2 * publish::kMaxWanted);

}  // namespace

Result<Upstream> Upstream::open(void* context, const link::Peer& peer) {
  auto socket =
      TRY(link::DaemonSocket::open(context, ZMQ_XSUB, peer, {.requests = kSubscriptionsWaiting}));
  return Upstream(context, std::move(socket));
}

bool Upstream::subscribe(const std::string& prefix, bool on) {
  return net::send_part(socket_.get(), (on ? '\1' : '\0') + prefix, false);
}

bool Upstream::opens_anew(std::int64_t now_ns) {
  if (!retry_.due(now_ns, established())) return false;
  auto fresh = open(context_, socket_.peer());
  if (!fresh) {
    complain("cannot be tried again: " + fresh.error().text());
    return false;
  }
  std::swap(socket_, fresh->socket_);  // an assignment would end the old socket before its monitor
  retry_.opened();
  return true;
}

void Upstream::complain(const std::string& why) {
  if (std::exchange(complaint_, why) == why) return;
  spdlog::error("the daemon at {} {}", endpoint(), why);
}

void Upstream::handle_news(std::int64_t now_ns) {
  const bool before = established();
  const std::uint64_t cuts = socket_.cuts(), ends = socket_.ends();
  if (const std::string why = socket_.refusal(); !why.empty()) {
    retry_.failed(now_ns);
    complain(why);
  } else if (socket_.cuts() != cuts) {
    spdlog::warn("{} sends more than any daemon does; its connection was ended and is tried again",
                 endpoint());
  } else if (established() != before) {
    spdlog::log(before ? spdlog::level::warn : spdlog::level::info, "{}: {}", endpoint(),
                before ? "connection lost; it is tried again" : "connected");
  }
  if (socket_.ends() != ends) retry_.failed(now_ns);
  if (established()) complaint_.clear();
}

void Upstream::warn_once(std::string_view fault, std::string_view stream) {
  if (!warned_.insert(fault).second) return;
  spdlog::warn("{} sends {}{}{}", endpoint(), fault, stream.empty() ? "" : ": ", clean(stream));
}

namespace {

constexpr std::int64_t kNoStats_ns = 3 * kNanosPerSecond;  // three stats are missing

struct Names {
  std::set<std::string> streams{}, sources{};
};

// What is set already comes from a relay before this one.
void name_clock(v1::Stats& stats) {
  for (v1::StreamStats& stream : *stats.mutable_stream()) {
    if (stream.has_monotonic_to_utc_ns()) continue;
    stream.set_monotonic_to_utc_ns(stats.monotonic_to_utc_ns());
  }
}

// What merged stats may still take.
struct Room {
  std::size_t bytes, parts;
};

// The most that each may have of `whole`: what some do not need is left to the others.
std::size_t fair_share(std::vector<std::size_t> needs, std::size_t whole) {
  std::ranges::sort(needs);
  std::size_t left = whole;
  for (std::size_t i = 0; i < needs.size(); ++i) {
    const std::size_t equal = left / (needs.size() - i);
    if (needs[i] > equal) return equal;
    left -= needs[i];
  }
  return whole;
}

bool append(std::string& merged, const v1::Stats& part, Room& room) {
  if (room.parts == 0 || part.ByteSizeLong() > room.bytes) return false;
  const std::string bytes = part.SerializeAsString();
  const auto parts = message::count_parts(part, std::as_bytes(std::span(bytes)));
  if (!parts || *parts > room.parts) return false;
  room = {.bytes = room.bytes - bytes.size(), .parts = room.parts - *parts};
  merged += bytes;
  return true;
}

// Appends the streams and sources of `bytes` whose names are new, of the first upstream all else
// too. Returns how many have no room.
std::size_t append_new(std::string& merged, const std::string& bytes, Room room, Names& names,
                       bool is_first) {
  std::size_t left_out = 0;
  v1::Stats stats;
  if (!stats.ParseFromString(bytes)) return left_out;
  v1::Stats entries;
  entries.mutable_stream()->Swap(stats.mutable_stream());
  entries.mutable_source()->Swap(stats.mutable_source());
  if (is_first && !append(merged, stats, room)) {
    ++left_out;
    v1::Stats times;
    times.set_time_ns(stats.time_ns());
    times.set_monotonic_to_utc_ns(stats.monotonic_to_utc_ns());
    static_cast<void>(append(merged, times, room));
  }
  v1::Stats one;
  const auto add_one = [&](std::set<std::string>& known, const std::string& name) {
    if (known.contains(name)) return;
    if (append(merged, one, room)) {
      known.insert(name);
    } else {
      ++left_out;
    }
  };
  for (v1::StreamStats& stream : *entries.mutable_stream()) {
    one.Clear();
    one.add_stream()->Swap(&stream);
    add_one(names.streams, one.stream(0).stream());
  }
  for (v1::SourceStats& source : *entries.mutable_source()) {
    one.Clear();
    one.add_source()->Swap(&source);
    add_one(names.sources, one.source(0).name());
  }
  return left_out;
}

}  // namespace

std::optional<std::string> MergedStats::accept(std::size_t upstream, std::string_view bytes,
                                               std::int64_t now_ns, bool& valid) {
  assert(upstream < latest_.size());
  Latest& latest = latest_[upstream];
  {
    v1::Stats stats;
    valid = message::parse_bounded(stats, std::as_bytes(std::span(bytes)));
    latest.ever = valid;
    latest.bytes.clear();
    if (!valid) return std::nullopt;
    latest.at_ns = now_ns;
    if (latest_.size() == 1) return std::string(bytes);
    name_clock(stats);
    latest.bytes = stats.SerializeAsString();
    latest.parts = message::count_parts(stats, std::as_bytes(std::span(latest.bytes))).value_or(0);
  }
  std::vector<std::size_t> answering, bytes_needed, parts_needed;
  for (std::size_t i = 0; i < latest_.size(); ++i) {
    if (!latest_[i].ever || now_ns - latest_[i].at_ns >= kNoStats_ns) continue;
    if (i < upstream) return std::nullopt;  // an earlier one gives the beat
    answering.push_back(i);
    bytes_needed.push_back(latest_[i].bytes.size());
    parts_needed.push_back(latest_[i].parts);
  }
  // posed's own clients take no more, and would lose the streams of all upstreams.
  const Room share{.bytes = fair_share(std::move(bytes_needed), net::kMaxReceivedPart),
                   .parts = fair_share(std::move(parts_needed), message::kMaxMessageParts)};
  std::string merged;
  Names names;
  for (const std::size_t i : answering) {
    latest_[i].left_out += append_new(merged, latest_[i].bytes, share, names, i == upstream);
  }
  return merged;
}

namespace {

constexpr std::string_view kSkeleton = "skeleton/";
constexpr std::int64_t kSkeletonPause_ns = kNanosPerSecond / 20;
// A daemon sends each skeleton every second. After this silence another upstream may have the name.
constexpr std::int64_t kSilent_ns = 3 * kNanosPerSecond;
// After this one the stream has gone.
constexpr std::int64_t kGone_ns = 10 * kNanosPerSecond;

}  // namespace

std::string_view stream_of_topic(std::string_view topic) {
  const auto slash = topic.find('/');
  return slash == std::string_view::npos ? std::string_view() : topic.substr(slash + 1);
}

Admission RelayedStreams::admit(std::string_view stream, std::size_t upstream, bool poses,
                                std::int64_t now_ns) {
  assert(upstream < shares_.size());
  forget_old(now_ns);
  auto found = streams_.find(stream);
  if (found != streams_.end() && found->second.upstream != upstream) {
    const bool silent = now_ns - found->second.received_ns >= kSilent_ns;
    if (!silent && (found->second.poses || !poses)) return Admission::kOthersName;
    forget(found);
    found = streams_.end();
  }
  if (found == streams_.end()) {
    if (!make_room(upstream, poses)) return Admission::kTooMany;
    Stream fresh{.upstream = upstream};
    fresh.due_ns = system::kForever_ns;
    found = streams_.emplace(std::string(stream), std::move(fresh)).first;
    ++shares_[upstream].streams;
  }
  if (poses && !std::exchange(found->second.poses, true)) ++shares_[upstream].posing;
  found->second.received_ns = now_ns;
  return Admission::kPasses;
}

bool RelayedStreams::make_room(std::size_t upstream, bool poses) {
  const Share& share = shares_[upstream];
  const bool all_full = streams_.size() >= link::kMaxLinkStreams;
  if (share.streams < kMaxStreams && !all_full) return true;
  if (poses && share.posing < share.streams) {
    forget_one_of(upstream);
    return true;
  }
  // Then who has most of them gives one to who has fewer.
  const auto most = std::ranges::max_element(shares_, {}, &Share::streams);
  if (share.streams >= kMaxStreams || share.streams + 1 >= most->streams) return false;
  if (!poses && most->posing == most->streams) return false;
  forget_one_of(static_cast<std::size_t>(most - shares_.begin()));
  return true;
}

void RelayedStreams::forget_one_of(std::size_t upstream) {
  auto one = streams_.end();
  for (auto next = streams_.begin(); next != streams_.end(); ++next) {
    if (next->second.upstream != upstream) continue;
    one = next;
    if (!next->second.poses) break;
  }
  assert(one != streams_.end());
  forget(one);
}

void RelayedStreams::keep_skeleton(std::string_view stream, std::string_view bytes,
                                   std::int64_t now_ns) {
  const auto found = streams_.find(stream);
  if (found == streams_.end()) return;
  Stream& kept = found->second;
  Share& share = shares_[kept.upstream];
  share.skeleton_bytes -= kept.skeleton.size();
  kept.skeleton.clear();
  kept.due_ns = system::kForever_ns;
  if (share.skeleton_bytes + bytes.size() > kMaxSkeletonBytes / shares_.size()) return;
  kept.skeleton_topic = std::string(kSkeleton) + found->first;
  kept.skeleton = bytes;
  kept.sent_ns = now_ns;
  share.skeleton_bytes += bytes.size();
}

void RelayedStreams::want_skeletons(std::string_view prefix) {
  for (auto& [name, stream] : streams_) {
    if (stream.skeleton.empty() || !stream.skeleton_topic.starts_with(prefix)) continue;
    stream.due_ns = std::min(stream.due_ns, stream.sent_ns + kSkeletonPause_ns);
    due_ns_ = std::min(due_ns_, stream.due_ns);
  }
}

std::int64_t RelayedStreams::send_due(
    std::int64_t now_ns,
    const std::function<void(std::string_view topic, std::string_view bytes)>& send) {
  if (now_ns < due_ns_) return due_ns_;
  due_ns_ = system::kForever_ns;
  for (auto& [name, stream] : streams_) {
    if (now_ns >= stream.due_ns) {
      send(stream.skeleton_topic, stream.skeleton);
      stream.sent_ns = now_ns;
      stream.due_ns = system::kForever_ns;
    }
    due_ns_ = std::min(due_ns_, stream.due_ns);
  }
  return due_ns_;
}

void RelayedStreams::forget_old(std::int64_t now_ns) {
  if (now_ns < forgot_ns_ + kNanosPerSecond) return;
  forgot_ns_ = now_ns;
  for (auto next = streams_.begin(); next != streams_.end();) {
    const auto one = next++;
    const bool crowded = shares_[one->second.upstream].streams > kMaxStreams / 2;
    if (now_ns - one->second.received_ns >= (crowded ? kSilent_ns : kGone_ns)) forget(one);
  }
}

void RelayedStreams::forget(Streams::iterator one) {
  Share& share = shares_[one->second.upstream];
  --share.streams;
  share.posing -= one->second.poses ? 1 : 0;
  share.skeleton_bytes -= one->second.skeleton.size();
  streams_.erase(one);
}

namespace {

constexpr int kMessagesATurn = 256;
// Messages a second that the first queue is made for; most relays pass on more.
constexpr double kFirstRate_hz = 256.0;
// Half of what a daemon allows one subscriber, so that it never cuts the relay because the relay's
// own subscribers come and go.
constexpr double kMaxChangesAtOnce = publish::kMaxAtOnce / 2.0;
constexpr double kMaxChangesPerSecond = publish::kMaxPerSecond / 2.0;
// The relay always hears these: skeletons for those who come later, stats to see its upstreams.
constexpr std::array<const char*, 2> kOwn{"skeleton/", "stats"};
// An upstream sees the relay as one subscriber.
constexpr std::size_t kMaxPassed = publish::kMaxWantedOfPeer - kOwn.size();

// Whether a daemon publishes under this topic, whatever the stream.
bool is_whole_topic(std::string_view topic) {
  return publish::could_become_topic(topic) && !stream_of_topic(topic).empty();
}

}  // namespace

Result<std::unique_ptr<Relay>> Relay::open(const RelayOptions& options) {
  if (options.from.empty() || options.from.size() > kMaxUpstreams) {
    return misuse("a relay has 1 to " + std::to_string(kMaxUpstreams) + " upstreams");
  }
  auto socket = TRY(publish::PublishSocket::open({.context = options.context,
                                                  .endpoint = options.endpoint,
                                                  .authenticator = options.authenticator,
                                                  .secret_z85 = options.secret_z85,
                                                  .messages_per_s = kFirstRate_hz}));
  std::vector<Upstream> upstreams;
  for (const link::Peer& settings : options.from) {
    auto upstream = TRY(Upstream::open(options.context, settings));
    upstreams.push_back(std::move(upstream));
  }
  return std::unique_ptr<Relay>(new Relay(options, std::move(socket), std::move(upstreams)));
}

Relay::Relay(const RelayOptions& options, publish::PublishSocket socket, std::vector<Upstream> from)
    : authenticator_(options.authenticator),
      socket_(std::move(socket)),
      upstreams_(std::move(from)),
      subscriptions_([](std::string_view) { return false; },
                     [this](const std::string& prefix, bool wanted) {
                       if (wanted) {
                         wanted_.insert(prefix);
                       } else {
                         wanted_.erase(prefix);
                       }
                       changed_.insert(prefix);
                     }),
      budget_(kMaxChangesAtOnce),
      streams_(upstreams_.size()),
      stats_(upstreams_.size()),
      queue_(publish::send_high_water_mark(kFirstRate_hz)) {
  for (Upstream& upstream : upstreams_) subscribe_all(upstream);
}

void Relay::subscribe_all(Upstream& upstream) {
  for (const char* topic : kOwn) static_cast<void>(upstream.subscribe(topic, true));
  for (const std::string& prefix : passed_) static_cast<void>(upstream.subscribe(prefix, true));
}

std::int64_t Relay::turn(std::int64_t now_ns) {
  bool all_received = socket_.receive_subscriptions(
      subscriptions_, now_ns, [this](std::string_view prefix) { streams_.want_skeletons(prefix); });
  pass_subscriptions(now_ns);
  for (std::size_t i = 0; i < upstreams_.size(); ++i) {
    upstreams_[i].handle_news(now_ns);
    if (upstreams_[i].opens_anew(now_ns)) subscribe_all(upstreams_[i]);
    all_received = drain(i, now_ns) && all_received;
  }
  const std::int64_t skeleton_ns =
      streams_.send_due(now_ns, [this](std::string_view topic, std::string_view bytes) {
        send(topic, bytes);
        ++counts_.late_skeletons;
      });
  every_second(now_ns);
  if (!all_received) return now_ns;
  const std::int64_t change_ns =
      changed_.empty() ? system::kForever_ns : now_ns + kNanosPerSecond / 20;
  return std::min({skeleton_ns, change_ns, second_ns_ + kNanosPerSecond});
}

void Relay::wait(std::int64_t timeout_ns) {
  std::array<zmq_pollitem_t, 1 + 2 * kMaxUpstreams> items{};
  int count = 0;
  items[count++] = {socket_.get(), 0, ZMQ_POLLIN, 0};
  for (const Upstream& upstream : upstreams_) {
    items[count++] = {upstream.socket(), 0, ZMQ_POLLIN, 0};
    items[count++] = {nullptr, upstream.news_fd(), ZMQ_POLLIN, 0};
  }
  constexpr std::int64_t kMilli_ns = 1'000'000;
  zmq_poll(items.data(), count,
           (std::max<std::int64_t>(timeout_ns, 0) + kMilli_ns - 1) / kMilli_ns);
}

bool Relay::drain(std::size_t upstream, std::int64_t now_ns) {
  net::Message topic;
  net::Message body;
  for (int i = 0; i < kMessagesATurn; ++i) {
    const link::Received received = upstreams_[upstream].receive(topic, body);
    if (received == link::Received::kNothing) return true;
    if (received == link::Received::kMessage) {
      pass_on(upstream, topic.text(), body, now_ns);
    } else {
      ++counts_.foreign;
    }
  }
  return false;
}

void Relay::pass_on(std::size_t upstream, std::string_view topic, net::Message& body,
                    std::int64_t now_ns) {
  if (topic == "stats") {
    bool valid = false;
    const auto stats = stats_.accept(upstream, body.text(), now_ns, valid);
    if (!valid) ++counts_.foreign;
    if (!stats) return;
    send(topic, *stats);
    counts_.stats_left_out = 0;
    for (std::size_t i = 0; i < upstreams_.size(); ++i) {
      counts_.stats_left_out += stats_.left_out(i);
      if (stats_.left_out(i) > 0) {
        upstreams_[i].warn_once(
            "more stats than it has room for beside the other upstreams: "
            "`top` and `monitor` do not see all of its streams");
      }
    }
    return;
  }
  if (!is_whole_topic(topic) || body.text().size() > link::kMaxStreamMessage) {
    ++counts_.foreign;
    return;
  }
  const std::string_view stream = stream_of_topic(topic);
  const bool poses = topic.starts_with("pose/") || topic.starts_with(kSkeleton);
  const Admission admission = streams_.admit(stream, upstream, poses, now_ns);
  if (admission != Admission::kPasses) {
    ++counts_.clashes;
    upstreams_[upstream].warn_once(
        admission == Admission::kTooMany
            ? "more streams than a relay passes on; those without poses are left out first, as this"
            : "a stream that another upstream sends as well; this one's messages are left out",
        stream);
    return;
  }
  if (topic.starts_with(kSkeleton)) streams_.keep_skeleton(stream, body.text(), now_ns);
  send(topic, body.text());
}

void Relay::send(std::string_view topic, std::string_view bytes) {
  if (!net::send_part(socket_.get(), topic, true)) return;
  static_cast<void>(net::send_part(socket_.get(), bytes, false));
  ++counts_.messages;
  counts_.bytes += topic.size() + bytes.size();
}

void Relay::pass_subscriptions(std::int64_t now_ns) {
  const double earned = seconds(std::max<std::int64_t>(now_ns - budgeted_ns_, 0));
  budget_ = std::min(budget_ + earned * kMaxChangesPerSecond, kMaxChangesAtOnce);
  budgeted_ns_ = now_ns;
  for (auto change = changed_.begin(); change != changed_.end() && budget_ >= 1.0;) {
    const std::string& prefix = *change;
    const bool wanted = wanted_.contains(prefix);
    // What the upstreams do not allow one subscriber waits until others have ended.
    if (wanted && passed_.size() >= kMaxPassed) {
      ++change;
      continue;
    }
    if (wanted != passed_.contains(prefix)) {
      budget_ -= 1.0;
      // An upstream that cannot take it now is one that has been stuck for long: it learns of it
      // when it connects anew, because libzmq then repeats all subscriptions.
      for (Upstream& upstream : upstreams_) {
        static_cast<void>(upstream.subscribe(prefix, wanted));
      }
      if (wanted) {
        passed_.insert(prefix);
      } else {
        passed_.erase(prefix);
      }
    }
    change = changed_.erase(change);
  }
}

void Relay::every_second(std::int64_t now_ns) {
  if (second_ns_ == kNoTime_ns) second_ns_ = now_ns;
  const std::int64_t passed_ns = now_ns - second_ns_;
  if (passed_ns < kNanosPerSecond) return;
  const double rate_hz =
      static_cast<double>(counts_.messages - passed_before_) / seconds(passed_ns);
  second_ns_ = now_ns;
  passed_before_ = counts_.messages;
  // All skeletons may come together, so they have room beside the poses.
  const int queue = publish::send_high_water_mark(rate_hz) +
                    static_cast<int>(std::min(streams_.streams(), kMaxStreams));
  // A queue that becomes shorter can stop a connection for good: libzmq's receiving side reports
  // what it took every half queue, and while it still counts by the old, longer one, the sending
  // side finds the new one full.
  if (queue <= queue_) return;
  queue_ = queue;
  static_cast<void>(net::set_option(socket_.get(), ZMQ_SNDHWM, queue));
}

RelayCounts Relay::counts() const {
  RelayCounts counts = counts_;
  counts.upstreams = static_cast<std::size_t>(
      std::ranges::count_if(upstreams_, [](const Upstream& one) { return one.established(); }));
  counts.subscribers = socket_.guard().peers();
  counts.subscriptions = passed_.size();
  counts.streams = streams_.streams();
  return counts;
}

void Relay::check_subscribers() {
  if (authenticator_ == nullptr) return;
  socket_.guard().cut_unless([this](std::string_view user) {
    return authenticator_->allows(user, net::Domain::kPublish);
  });
}

}  // namespace posed::relay
