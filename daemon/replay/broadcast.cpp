#include "daemon/replay/broadcast.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "daemon/net/security.hpp"
#include "daemon/replay/pace.hpp"
#include "daemon/system/clock.hpp"

namespace posed::replay {
namespace {

constexpr auto kLookAgain = std::chrono::milliseconds(1);

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
  auto wake = system::EventFd::open();
  if (!wake) return std::unexpected(wake.error());
  std::vector<publish::StreamInfo> infos;
  double frames_per_s = 0.0;
  const std::uint32_t streams = replay.streams();
  for (std::uint32_t id = 0; id < streams; ++id) {
    const ReplayStream& stream = replay.stream(id);
    infos.push_back({.name = stream.name,
                     .description = stream.description,
                     .rate_hz = stream.settings.rate_hz,
                     .stages = pipeline::stage_types_of(stream.settings),
                     .raw = stream.settings.publish_raw,
                     .model = pipeline::first_model(stream.settings),
                     .counters = nullptr});
    frames_per_s += stream.settings.rate_hz * 2.0;  // raw and styled
  }
  std::unique_ptr<Broadcast> self(
      new Broadcast(options, replay, pipeline::ring_slots(frames_per_s), std::move(*wake)));
  for (std::uint32_t id = 0; id < streams; ++id) {
    infos[id].counters = &self->counters_[id];
    self->settings_.push_back(replay.stream(id).settings);
    pipeline::publish_parameters(replay.engine(id), self->counters_[id].pipeline);
  }
  auto context = net::open_context();
  if (!context) return std::unexpected(context.error());
  self->context_ = std::move(*context);
  auto authenticator = net::ZapAuthenticator::start(self->context_.get(), std::nullopt);
  if (!authenticator) return std::unexpected(authenticator.error());
  self->authenticator_ = std::move(*authenticator);
  publish::PublisherOptions published;
  published.authenticator = self->authenticator_.get();
  published.context = self->context_.get();
  published.endpoint = endpoint;
  published.clock = system::monotonic_ns;
  published.data_clock = [clock = &self->clock_] { return clock->now_ns(); };
  // at full speed no frame has a meaningful time of publication
  published.stamps = options.speed != 0.0;
  published.more_stats = [file = options.log, speed = options.speed](v1::Stats& stats) {
    stats.set_replay_file(file);
    stats.set_replay_speed(speed);
  };
  auto publisher =
      publish::Publisher::open(std::move(published), std::move(infos), self->ring_, *self->wake_);
  if (!publisher) return std::unexpected(publisher.error());
  self->publisher_ = std::move(*publisher);
  self->thread_ = std::jthread([publisher = self->publisher_.get()] { publisher->run(); });
  return self;
}

Broadcast::~Broadcast() {
  if (publisher_) publisher_->stop();
}

void Broadcast::add(const pipeline::Item& item) {
  if (item.kind == pipeline::Item::Kind::kEvent) note(item.stream_event);
  if (item.kind == pipeline::Item::Kind::kFrame) {
    const std::uint32_t stream = item.frame.header.stream;
    pipeline::publish_parameters(replay_.engine(stream), counters_[stream].pipeline);
  }
  while (!ring_.push(item)) std::this_thread::sleep_for(kLookAgain);
  wake_->notify();
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
      pipeline::publish_parameters(replay_.engine(event.stream), counters);
      if (event.change.kind == pipeline::StageChange::Kind::kModel) {
        pipeline::StreamSettings& settings = settings_[event.stream];
        for (pipeline::StageSettings& stage : settings.stages) {
          if (stage.type == event.change.type) stage.model_name = event.after.text();
        }
        publisher_->set_model_name(event.stream, pipeline::first_model(settings));
      }
      break;
    default:
      break;
  }
}

}  // namespace posed::replay
