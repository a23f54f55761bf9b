#include "daemon/publish/publisher.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/net/peer_guard.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/publish/event_text.hpp"
#include "daemon/publish/frame_output.hpp"
#include "daemon/publish/published_slots.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "proto/text/clean.hpp"

namespace posed::publish {
namespace {

// A skeleton is sent to all its subscribers when one of them subscribes, but at most this often.
constexpr std::int64_t kSkeletonPause_ns = kNanosPerSecond / 20;
// The publisher's thread waits for new items and for messages of subscribers.
Result<std::unique_ptr<system::Poller>> open_poller(const system::EventFd& wake, void* socket) {
  auto poller = TRY(system::Poller::open());
  int socket_fd = -1;
  std::size_t size = sizeof socket_fd;
  if (zmq_getsockopt(socket, ZMQ_FD, &socket_fd, &size) != 0) {
    return fail("ZeroMQ names no descriptor to wait for");
  }
  for (const Result<>& added : {poller->add(wake), poller->add(socket_fd, 0)}) {
    if (!added) return std::unexpected(added.error());
  }
  return poller;
}

}  // namespace

// What other threads ask of the publisher's thread, and results for them. Cold: never used by the
// other hot threads.
struct Publisher::Requests {
  struct Posted {
    std::uint32_t stream;
    v1::Event::Kind kind;
    std::string text;
  };
  // What the publisher does at its next turn; streams come by PublishedSlots::add().
  struct Batch {
    std::vector<Posted> events;
    std::vector<std::uint32_t> leaving;
    bool check = false;
  };

  mutable std::mutex mutex;  // guards everything but `asked`
  Batch batch;
  std::atomic<bool> asked{false};  // `batch` or the slots' additions have something new
  bool served = false;             // a thread is in run()
  // Removals, counted since the start: a caller waits until its own is done.
  std::uint64_t removals = 0, removals_done = 0;
  std::condition_variable done;
  v1::Stats stats;  // the last ones, without the streams
};

Result<std::unique_ptr<Publisher>> Publisher::open(PublisherOptions options,
                                                   pipeline::Ring<pipeline::Item>& in,
                                                   system::EventFd& wake) {
  auto socket = TRY(PublishSocket::open({.context = options.context,
                                         .endpoint = options.endpoint,
                                         .authenticator = options.authenticator,
                                         .secret_z85 = options.secret_z85,
                                         .messages_per_s = options.messages_per_s}));
  auto poller = TRY(open_poller(wake, socket.get()));
  return std::unique_ptr<Publisher>(
      new Publisher(std::move(options), in, wake, std::move(socket), std::move(poller)));
}

Publisher::Publisher(PublisherOptions options, pipeline::Ring<pipeline::Item>& in,
                     system::EventFd& wake, PublishSocket socket,
                     std::unique_ptr<system::Poller> poller)
    : options_(std::move(options)),
      in_(in),
      wake_(wake),
      socket_(std::move(socket)),
      subscriptions_([this](std::string_view prefix) { return is_topic(prefix); }),
      poller_(std::move(poller)),
      slots_(std::make_unique<PublishedSlots>(options_.slots)),
      requests_(std::make_unique<Requests>()) {
  if (!options_.data_clock) options_.data_clock = options_.clock;
}

Publisher::~Publisher() = default;

const std::string& Publisher::endpoint() const noexcept { return socket_.endpoint(); }

void Publisher::handle_all() {
  while (in_.consume([this](const pipeline::Item& item) { handle(item); })) {
  }
}

std::int64_t Publisher::turn(std::int64_t now_ns) {
  announce_new();  // outputs must know a stream before its first frame, too
  handle_all();
  do_what_was_asked();
  // Also at the first turn, so that a status request that comes at once already finds the streams.
  if (reported_ns_ == kNoTime_ns || now_ns >= reported_ns_ + kNanosPerSecond) {
    every_second(now_ns);
  }
  const bool all_received = socket_.receive_subscriptions(
      subscriptions_, now_ns, [this](std::string_view prefix) { want_skeletons(prefix); });
  const std::int64_t skeleton_ns = send_skeletons(now_ns);
  if (!all_received) return now_ns;
  return std::min(reported_ns_ + kNanosPerSecond, skeleton_ns);
}

void Publisher::finish(std::int64_t now_ns) {
  handle_all();
  slots_->for_each([this](PublishedStream& published) { report_shed(published, true); });
  every_second(now_ns);
}

void Publisher::run() {
  begin_serving();
  while (!stop_.load(std::memory_order_acquire)) {
    pulse_.beat();
    const std::int64_t due_ns = turn(options_.clock());
    wake_.going_to_sleep();
    if (in_.empty() && !asked() && !stop_.load(std::memory_order_acquire)) {
      static_cast<void>(poller_->wait(system::time_left_ns(due_ns, options_.clock)));
    }
    wake_.awake();
  }
  finish(options_.clock());
  end_serving();
}

void Publisher::send(std::string_view topic, const google::protobuf::MessageLite& message) {
  zmq_msg_t body;
  const std::size_t size = message.ByteSizeLong();
  if (zmq_msg_init_size(&body, size) != 0) return;  // out of memory: this message is lost
  message.SerializeWithCachedSizesToArray(static_cast<std::uint8_t*>(zmq_msg_data(&body)));
  if (!net::send_part(socket_.get(), topic, true) ||
      zmq_msg_send(&body, socket_.get(), ZMQ_DONTWAIT) < 0) {
    zmq_msg_close(&body);
  }
}

PublishedStream* Publisher::stream_of(const pipeline::Item& item) {
  const std::uint32_t id = pipeline::stream_of(item);
  if (PublishedStream* const published = slots_->current(id)) return published;
  slots_->place_additions();
  if (slots_->find(id) == nullptr) return nullptr;
  // It is the first item of a later generation, so there are no more of the earlier ones.
  const std::uint32_t slot = pipeline::slot_of(id);
  while (slots_->current(id) == nullptr) {
    report_shed(*slots_->holder(slot), true);
    slots_->holder(slot)->leave_outputs();
    slots_->advance(slot);
  }
  announce_new();
  return slots_->current(id);
}

void Publisher::handle(const pipeline::Item& item) {
  using Kind = pipeline::Item::Kind;
  PublishedStream* const published = stream_of(item);
  if (published == nullptr) return;
  pipeline::count(published->info.counters->publisher.taken);
  switch (item.kind) {
    case Kind::kFrame:
    case Kind::kRawFrame:
      handle_frame(*published, item.frame, item.kind == Kind::kRawFrame);
      break;
    case Kind::kSample:
      published->count_sample();
      for (FrameOutput* const output : published->outputs) output->sample(item.sample);
      send(published->styled.sensor_topic, published->styled.samples.encode(item.sample));
      break;
    case Kind::kEvent:
      handle_notice(*published, item.stream_event);
      break;
  }
}

void Publisher::handle_notice(PublishedStream& published, const pipeline::StreamEvent& event) {
  const auto kind = static_cast<v1::Event::Kind>(event.kind);
  if (kind == v1::Event::KIND_SHED) {
    published.shed.add(event.sequence, static_cast<std::uint64_t>(event.value));
    return report_shed(published, false);
  }
  if (kind == v1::Event::KIND_STALE) published.count_silence();
  std::string text = sentence(event);
  if (kind == v1::Event::KIND_ENDED) {
    report_shed(published, true);
    const StreamInfo& info = published.info;
    if (!info.source.empty()) text = has_left(info.source, info.body, event.sequence);
  }
  send_event(published, kind, event.time_ns, event.sequence, text);
}

void Publisher::report_shed(PublishedStream& published, bool at_end) {
  const std::int64_t now_ns = options_.clock();
  const auto sum = published.shed.next_sum(now_ns, at_end);
  if (!sum) return;
  send_event(published, v1::Event::KIND_SHED, options_.data_clock(), sum->first, sentence(*sum));
}

void Publisher::handle_frame(PublishedStream& published, const Frame& frame, bool raw) {
  Channel& channel = raw ? *published.raw : published.styled;
  const v1::Frame& bare = channel.frames.encode(frame);
  if (options_.record_sink != nullptr && options_.record_sink->wants_published()) {
    bare.SerializeToString(&scratch_);
    options_.record_sink->published(frame.header.stream, frame.header.sequence, raw,
                                    std::as_bytes(std::span(scratch_)));
  }
  StageStamps stamps = frame.stamps;
  if (options_.stamps) stamps.published_ns = options_.data_clock();
  // Frames that a replay computes are not timed.
  const bool timed = !raw && stamps.decoded_ns != kNoTime_ns;
  const std::size_t stages = timed ? published.info.stages.size() : 0;
  send(channel.pose_topic, channel.frames.stamp(stamps, std::span(frame.stage_us).first(stages)));
  if (raw) {
    if (options_.raw_tap != nullptr) options_.raw_tap->raw_frame(frame);
    return;
  }
  published.count(frame, stamps);
  for (FrameOutput* const output : published.outputs) output->frame(frame);
}

void Publisher::send_event(PublishedStream& published, v1::Event::Kind kind, std::int64_t time_ns,
                           std::uint64_t sequence, const std::string& text) {
  const v1::Event event = event_message(published.info.name, kind, time_ns, sequence, text);
  const bool bad = kind == v1::Event::KIND_STALE || kind == v1::Event::KIND_SHED ||
                   kind == v1::Event::KIND_LOST || kind == v1::Event::KIND_CLOCK_JUMPED ||
                   (kind >= v1::Event::KIND_RECORDING_GAP && kind <= v1::Event::KIND_WARNING);
  spdlog::log(bad ? spdlog::level::warn : spdlog::level::info, "{}: {}", event.stream(), text);
  send(published.styled.event_topic, event);
}

bool Publisher::is_topic(std::string_view prefix) const {
  if (std::string_view("stats").starts_with(prefix)) return true;
  const auto begins_one_of = [&](const Channel& channel) {
    return channel.pose_topic.starts_with(prefix) || channel.skeleton_topic.starts_with(prefix) ||
           channel.sensor_topic.starts_with(prefix) || channel.event_topic.starts_with(prefix);
  };
  bool found = false;
  slots_->for_each([&](const PublishedStream& published) {
    found = found || begins_one_of(published.styled) ||
            (published.raw && begins_one_of(*published.raw));
  });
  return found;
}

// Schedules the skeletons of all topics that begin with `prefix`, after a subscription.
void Publisher::want_skeletons(std::string_view prefix) {
  const auto want = [&](Channel& channel) {
    if (!channel.skeleton_topic.starts_with(prefix)) return;
    channel.skeleton_due_ns =
        std::min(channel.skeleton_due_ns, channel.skeleton_sent_ns + kSkeletonPause_ns);
  };
  slots_->for_each([&](PublishedStream& published) {
    want(published.styled);
    if (published.raw) want(*published.raw);
  });
}

// A subscriber must know the skeleton before the first pose.
void Publisher::announce_new() {
  const auto send_skeleton = [this](Channel& channel) {
    if (!channel.skeleton) return;
    channel.skeleton_sent_ns = options_.clock();
    channel.skeleton_due_ns = channel.skeleton_sent_ns + kNanosPerSecond;
    send(channel.skeleton_topic, *channel.skeleton);
  };
  slots_->for_each_new([&](PublishedStream& published) {
    const StreamInfo& info = published.info;
    if (!info.refusal.empty()) {
      return send_event(published, v1::Event::KIND_WARNING, options_.data_clock(), 0, info.refusal);
    }
    send_skeleton(published.styled);
    if (published.raw) send_skeleton(*published.raw);
    connect_outputs(published);
    if (info.source.empty()) return;
    send_event(published, v1::Event::KIND_FOUND, options_.data_clock(), 0,
               body_words(info.source, info.body) + " has come" +
                   (info.remark.empty() ? "" : ": " + info.remark));
  });
}

void Publisher::connect_outputs(PublishedStream& published) {
  for (FrameOutput* const output : options_.outputs) {
    if (!output->wants(published.info.name)) continue;
    output->stream_comes(published.info);
    published.outputs.push_back(output);
  }
}

std::int64_t Publisher::send_skeletons(std::int64_t now_ns) {
  std::int64_t next_ns = system::kForever_ns;
  const auto send_one = [&](Channel& channel) {
    if (!channel.skeleton) return;
    if (now_ns >= channel.skeleton_due_ns) {
      send(channel.skeleton_topic, *channel.skeleton);
      channel.skeleton_sent_ns = now_ns;
      channel.skeleton_due_ns = now_ns + kNanosPerSecond;
    }
    next_ns = std::min(next_ns, channel.skeleton_due_ns);
  };
  slots_->for_each([&](PublishedStream& published) {
    send_one(published.styled);
    if (published.raw) send_one(*published.raw);
  });
  return next_ns;
}

void Publisher::every_second(std::int64_t now_ns) {
  const bool first = reported_ns_ == kNoTime_ns;
  const double since_s = first ? 0.0 : seconds(now_ns - reported_ns_);
  const std::int64_t cpu_ns = system::cpu_time_ns();
  if (first) reported_cpu_ns_ = cpu_ns;
  v1::Stats stats;
  const std::int64_t data_ns = options_.data_clock();
  stats.set_time_ns(data_ns);
  stats.set_monotonic_to_utc_ns(system::clock_ns(CLOCK_REALTIME) - data_ns);
  stats.set_rss_bytes(system::resident_bytes());
  stats.set_cpu_percent(
      static_cast<float>(100.0 * seconds(cpu_ns - reported_cpu_ns_) / std::max(since_s, 1e-3)));
  keep_stats(stats);
  slots_->for_each([&](PublishedStream& published) {
    *stats.add_stream() = published.report(since_s);
    report_shed(published, false);
  });
  slots_->fill_left(stats);
  add_sources(stats);
  add_outputs(stats);
  if (options_.more_stats) options_.more_stats(stats);
  reported_ns_ = now_ns;
  reported_cpu_ns_ = cpu_ns;
  send("stats", stats);
}

template <typename Change>
void Publisher::ask(Change&& change) {
  {
    const std::scoped_lock lock(requests_->mutex);
    change(requests_->batch);
  }
  requests_->asked.store(true);
  wake_.notify();
}

void Publisher::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_.notify();
}

void Publisher::add(StreamInfo stream) {
  slots_->add(std::make_unique<PublishedStream>(std::move(stream)));
  const std::scoped_lock lock(requests_->mutex);
  if (!requests_->served) return slots_->place_additions();
  requests_->asked.store(true);
  wake_.notify();
}

void Publisher::remove(std::uint32_t stream) {
  std::unique_lock lock(requests_->mutex);
  if (!requests_->served) {
    slots_->place_additions();
    handle_all();
    return remove_now(stream);
  }
  requests_->batch.leaving.push_back(stream);
  const std::uint64_t mine = ++requests_->removals;
  requests_->asked.store(true);
  wake_.notify();
  requests_->done.wait(lock, [&] { return requests_->removals_done >= mine; });
}

void Publisher::set_stages(std::uint32_t stream, std::vector<StageInfo> stages) {
  slots_->set_stages(stream, std::move(stages));
}

void Publisher::post_event(std::uint32_t stream, v1::Event::Kind kind, std::string text) {
  ask([&](Requests::Batch& batch) { batch.events.push_back({stream, kind, std::move(text)}); });
}

void Publisher::check_subscribers() {
  ask([](Requests::Batch& batch) { batch.check = true; });
}

v1::Stats Publisher::stats() const {
  v1::Stats stats;
  {
    const std::scoped_lock lock(requests_->mutex);
    stats = requests_->stats;
  }
  slots_->fill(stats);
  stats.set_time_ns(options_.data_clock());
  add_sources(stats);
  add_outputs(stats);
  if (options_.more_stats) options_.more_stats(stats);
  return stats;
}

std::vector<StreamFigures> Publisher::figures() const { return slots_->figures(); }

void Publisher::add_sources(v1::Stats& stats) const {
  for (const SourceInfo& info : options_.sources) {
    v1::SourceStats& source = *stats.add_source();
    source.set_name(info.name);
    source.set_driver(info.driver);
    source.set_identity(clean(info.present->description()->identity));
    source.set_away(is_away(*info.counters, info.comes_and_goes));
    source.set_connections(info.counters->connections.load());
    for (const auto& outcome : info.counters->outcome) source.add_outcome(outcome.load());
    source.set_kernel_dropped(info.counters->kernel_dropped.load());
    const auto of_source = [&](const v1::StreamStats& stream) {
      return stream.source_name() == info.name;
    };
    source.set_streams(
        static_cast<std::uint32_t>(std::ranges::count_if(stats.stream(), of_source)));
  }
}

void Publisher::add_outputs(v1::Stats& stats) const {
  for (const FrameOutput* const output : options_.outputs) output->fill(*stats.add_output());
}

bool Publisher::asked() const noexcept { return requests_->asked.load(); }

void Publisher::do_what_was_asked() {
  if (!requests_->asked.exchange(false)) return;
  Requests::Batch batch;
  {
    const std::scoped_lock lock(requests_->mutex);
    std::swap(batch, requests_->batch);
  }
  slots_->place_additions();
  announce_new();
  for (const Requests::Posted& event : batch.events) {
    PublishedStream* const published = slots_->find(event.stream);
    if (published == nullptr) continue;  // it has left
    send_event(*published, event.kind, options_.data_clock(), 0, event.text);
  }
  if (!batch.leaving.empty()) {
    handle_all();  // items that came after this turn's first look, but before the removal
    for (const std::uint32_t stream : batch.leaving) remove_now(stream);
    const std::scoped_lock lock(requests_->mutex);
    requests_->removals_done += batch.leaving.size();
    requests_->done.notify_all();
  }
  if (!batch.check || options_.authenticator == nullptr) return;
  socket_.guard().cut_unless([this](std::string_view user) {
    return options_.authenticator->allows(user, net::Domain::kPublish);
  });
}

void Publisher::remove_now(std::uint32_t stream) {
  if (PublishedStream* const published = slots_->find(stream)) {
    report_shed(*published, true);
    published->leave_outputs();
  }
  slots_->remove(stream);
}

void Publisher::begin_serving() {
  const std::scoped_lock lock(requests_->mutex);
  requests_->served = true;
}

// After this call no thread may block on the publisher.
void Publisher::end_serving() {
  while (true) {
    do_what_was_asked();
    const std::scoped_lock lock(requests_->mutex);
    requests_->served = !requests_->batch.leaving.empty();
    if (!requests_->served) return;
  }
}

void Publisher::keep_stats(v1::Stats stats) {
  const std::scoped_lock lock(requests_->mutex);
  requests_->stats = std::move(stats);
}

}  // namespace posed::publish
