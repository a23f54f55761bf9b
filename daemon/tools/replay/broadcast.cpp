#include "daemon/tools/replay/broadcast.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <thread>
#include <utility>

#include "daemon/net/security.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/replay/pace.hpp"
#include "daemon/tools/replay/stream_info.hpp"
#include "models/stage_type.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

constexpr auto kLookAgain = std::chrono::milliseconds(1);

// Of the streams of one name, one is there at a time.
double max_frames_per_s(const Replay& replay) {
  std::map<std::string, double> rates_hz;
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    double& rate_hz = rates_hz[replay.stream(id).name];
    rate_hz = std::max(rate_hz, replay.stream(id).settings.rate_hz);
  }
  double frames_per_s = 0.0;
  for (const auto& [name, rate_hz] : rates_hz) frames_per_s += 2.0 * rate_hz;  // raw and styled
  return frames_per_s;
}

}  // namespace

TakeClock::TakeClock(double speed, std::int64_t begin_ns, Clock host)
    : speed_(speed), host_(host), take_ns_(begin_ns), host_ns_(kNoTime_ns) {}

// The clock stands still until the first chunk: the time it takes to open a log must not count as
// age of its frames.
std::int64_t TakeClock::at(std::int64_t host_ns) const {
  if (host_ns_ == kNoTime_ns) return take_ns_;
  return take_ns_ + nanoseconds(seconds(host_ns - host_ns_) * speed_);
}

void TakeClock::reached(std::int64_t arrival_ns) {
  const std::int64_t host_ns = host_();
  const std::scoped_lock lock(mutex_);
  const std::int64_t now_ns = at(host_ns);
  // the recording has returned from a wrong time
  const bool back = arrival_ns < now_ns - Pace::kMaxSilence_ns;
  take_ns_ = back ? arrival_ns : std::max(arrival_ns, now_ns);
  host_ns_ = host_ns;
}

std::int64_t TakeClock::now_ns() const {
  const std::scoped_lock lock(mutex_);
  return at(host_());
}

Broadcast::Broadcast(const BroadcastOptions& options, const Replay& replay, std::size_t slots,
                     std::unique_ptr<system::EventFd> wake)
    : replay_(replay),
      clock_(options.speed, options.begin_ns, system::monotonic_ns),
      counters_(replay.streams()),
      presence_(replay.streams(), Presence::kNotYet),
      ring_(slots),
      wake_(std::move(wake)) {}

Result<std::unique_ptr<Broadcast>> Broadcast::open(const BroadcastOptions& options,
                                                   const Replay& replay) {
  const std::string& endpoint = options.endpoint;
  if (!net::is_loopback(endpoint)) {
    return misuse("the log's run published on " + endpoint +
                  "; a replay knows no keys and publishes on this machine only: say --endpoint "
                  "tcp://127.0.0.1:5570");
  }
  auto wake = TRY(system::EventFd::open());
  const double frames_per_s = max_frames_per_s(replay);
  std::unique_ptr<Broadcast> self(
      new Broadcast(options, replay, pipeline::ring_slots(frames_per_s), std::move(wake)));
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    self->settings_.push_back(replay.stream(id).settings);
  }
  self->context_ = TRY(net::open_context());
  self->authenticator_ = TRY(net::ZapAuthenticator::start(self->context_.get(), std::nullopt));
  publish::PublisherOptions published;
  published.authenticator = self->authenticator_.get();
  published.context = self->context_.get();
  published.endpoint = endpoint;
  published.slots = replay.streams();
  published.messages_per_s = frames_per_s;
  published.clock = system::monotonic_ns;
  published.data_clock = [clock = &self->clock_] { return clock->now_ns(); };
  // at full speed no frame has a meaningful time of publication
  published.stamps = options.speed != 0.0;
  published.more_stats = [file = options.log, speed = options.speed](v1::Stats& stats) {
    stats.set_replay_file(clean(file));
    stats.set_replay_speed(speed);
  };
  auto publisher = publish::Publisher::open(std::move(published), self->ring_, *self->wake_);
  if (!publisher) return std::unexpected(publisher.error());
  self->publisher_ = std::move(*publisher);
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    if (replay.stream(id).is_there_from_start) self->come(id);
  }
  self->thread_ = std::jthread([publisher = self->publisher_.get()] { publisher->run(); });
  return self;
}

Broadcast::~Broadcast() {
  if (publisher_) publisher_->stop();
}

publish::StreamInfo Broadcast::info_of(std::uint32_t id) {
  const ReplayStream& stream = replay_.stream(id);
  publish::StreamInfo info = stream_info(id, stream);
  info.stages = publish::stage_infos(settings_[id]);
  info.counters = &counters_[id];
  info.source_counters = &source_counters_;
  info.source = stream.source;
  info.body = stream.body;
  return info;
}

// If the log lacks the end of the stream that had the name before, it ends now.
void Broadcast::come(std::uint32_t stream) {
  for (std::uint32_t id = 0; id < replay_.streams(); ++id) {
    if (presence_[id] == Presence::kHere && replay_.stream(id).name == replay_.stream(stream).name)
      leave(id);
  }
  presence_[stream] = Presence::kHere;
  publish_values(stream);
  publisher_->add(info_of(stream));
}

void Broadcast::leave(std::uint32_t stream) {
  presence_[stream] = Presence::kGone;
  publisher_->remove(stream);
}

void Broadcast::publish_values(std::uint32_t stream) {
  const pipeline::StreamEngine* const engine = replay_.engine(stream);
  if (engine != nullptr) pipeline::publish_values(*engine, counters_[stream].pipeline);
}

void Broadcast::add(const pipeline::Item& item) {
  const std::uint32_t stream = pipeline::stream_of(item);
  if (presence_[stream] == Presence::kNotYet) come(stream);
  if (presence_[stream] == Presence::kGone) return;
  const bool is_event = item.kind == pipeline::Item::Kind::kEvent;
  if (is_event) note(item.stream_event);
  if (item.kind == pipeline::Item::Kind::kFrame) publish_values(stream);
  while (!ring_.push(item)) std::this_thread::sleep_for(kLookAgain);
  wake_->notify();
  const bool ends = is_event && item.stream_event.kind == v1::Event::KIND_ENDED;
  if (ends && !replay_.stream(stream).body.empty()) leave(stream);
}

// A stage's other model or text.
void Broadcast::note_change(const pipeline::StreamEvent& event) {
  using Kind = pipeline::StageChange::Kind;
  pipeline::StreamSettings& settings = settings_[event.stream];
  const auto stage =
      std::ranges::find(settings.stages, event.change.type, &pipeline::StageSettings::type);
  if (stage == settings.stages.end()) return;
  if (event.change.kind == Kind::kModel) {
    stage->model_name = event.after.text();
  } else if (event.change.kind == Kind::kCommand) {
    const std::string command(stage->type->commands[event.change.index].name);
    if (!is_live_text(*stage->type, command)) return;
    stage->parameters[command] = std::string(event.after.text());
    // People are told of some defaults in words that the config does not take: "whole body".
    const auto check = stage->type->check;
    if (check != nullptr && check(stage->parameters, true))
      stage->parameters[command] = std::string();
  } else {
    return;
  }
  publisher_->set_stages(event.stream, publish::stage_infos(settings));
}

// Updates what the pipeline's counters and the control thread knew in the live run.
void Broadcast::note(const pipeline::StreamEvent& event) {
  using pipeline::StreamState;
  auto& counters = counters_[event.stream].pipeline;
  switch (event.kind) {
    case v1::Event::KIND_STARTED:
    case v1::Event::KIND_RECOVERED:
      counters.state.store(StreamState::kLive);
      break;
    case v1::Event::KIND_STALE:
      counters.state.store(StreamState::kStale);
      break;
    case v1::Event::KIND_ENDED:
      counters.state.store(StreamState::kEnded);
      break;
    case v1::Event::KIND_SHED:
      pipeline::count(counters.shed, static_cast<std::uint64_t>(event.value));
      break;
    case v1::Event::KIND_CONTROL:
      publish_values(event.stream);
      note_change(event);
      break;
    default:
      break;
  }
}

}  // namespace posed::replay
