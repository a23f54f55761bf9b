#include "daemon/record/broadcast.hpp"

#include <chrono>
#include <thread>
#include <utility>

#include "daemon/control/security.hpp"
#include "daemon/pipeline/clock.hpp"

namespace posed::record {
namespace {

constexpr auto kLookAgain = std::chrono::milliseconds(1);

}  // namespace

Broadcast::Broadcast(std::size_t streams, std::size_t slots, std::unique_ptr<pipeline::Wake> wake)
    : counters_(streams), ring_(slots), wake_(std::move(wake)) {}

Result<std::unique_ptr<Broadcast>> Broadcast::open(const std::string& endpoint,
                                                   const Replay& replay) {
  if (!control::is_loopback(endpoint)) {
    return misuse("the log's run published on " + endpoint +
                  "; a replay knows no keys and publishes on this machine only: say --endpoint "
                  "tcp://127.0.0.1:5570");
  }
  auto wake = pipeline::Wake::open();
  if (!wake) return std::unexpected(wake.error());
  std::vector<publish::StreamInfo> infos;
  double frames_per_s = 0.0;
  const std::uint32_t streams = replay.streams();
  for (std::uint32_t id = 0; id < streams; ++id) {
    const ReplayStream& stream = replay.stream(id);
    infos.push_back({.name = stream.name,
                     .description = stream.description,
                     .rate_hz = stream.settings.rate_hz,
                     .raw = stream.settings.publish_raw,
                     .model = stream.settings.style ? stream.settings.style_model.name
                                                    : stream.settings.gesture_model.name,
                     .counters = nullptr});
    frames_per_s += stream.settings.rate_hz * 2.0;  // raw and styled
  }
  std::unique_ptr<Broadcast> self(
      new Broadcast(streams, pipeline::ring_slots(frames_per_s), std::move(*wake)));
  for (std::uint32_t id = 0; id < streams; ++id) infos[id].counters = &self->counters_[id];
  auto context = control::open_context();
  if (!context) return std::unexpected(context.error());
  self->context_ = std::move(*context);
  auto gatekeeper = control::Gatekeeper::start(self->context_.get(), std::nullopt);
  if (!gatekeeper) return std::unexpected(gatekeeper.error());
  self->gatekeeper_ = std::move(*gatekeeper);
  publish::PublisherOptions options;
  options.gatekeeper = self->gatekeeper_.get();
  options.context = self->context_.get();
  options.endpoint = endpoint;
  options.clock = pipeline::monotonic_ns;
  auto publisher =
      publish::Publisher::open(std::move(options), std::move(infos), self->ring_, *self->wake_);
  if (!publisher) return std::unexpected(publisher.error());
  self->publisher_ = std::move(*publisher);
  self->thread_ = std::jthread([publisher = self->publisher_.get()] { publisher->run(); });
  return self;
}

Broadcast::~Broadcast() {
  if (publisher_) publisher_->stop();
}

void Broadcast::add(const pipeline::Item& item) {
  while (!ring_.push(item)) std::this_thread::sleep_for(kLookAgain);
  wake_->ring();
}

}  // namespace posed::record
