#include "daemon/assembly/body_streams.hpp"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/devices/about_stream.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"

namespace posed::assembly {
namespace {

bool publishes_raw(const config::SourceConfig& source) {
  const auto raw = [](const config::SourceConfig::NamedBody& named) {
    return named.stream.publish_raw;
  };
  return source.every.publish_raw || std::ranges::any_of(source.named, raw);
}

}  // namespace

Result<std::unique_ptr<BodyStreams>> BodyStreams::open(const config::DaemonConfig& config,
                                                       std::uint32_t first) {
  if (config.sources.empty()) return nullptr;
  std::unique_ptr<BodyStreams> self(new BodyStreams());
  auto wake = system::EventFd::open();
  if (!wake) return std::unexpected(wake.error());
  self->wake_ = std::move(*wake);
  auto poller = system::Poller::open();
  if (!poller) return std::unexpected(poller.error());
  self->poller_ = std::move(*poller);
  if (auto added = self->poller_->add(*self->wake_); !added) return std::unexpected(added.error());
  for (const config::SourceConfig& source : config.sources) {
    const auto number = first + static_cast<std::uint32_t>(self->sources_.size());
    if (auto opened = self->open_source(source, number); !opened) {
      return std::unexpected(opened.error());
    }
  }
  self->first_ = first;
  // The config reader makes sure that there is room for all streams that the config names.
  self->count_ = static_cast<std::size_t>(config.max_streams) - first;
  const bool raw = std::ranges::any_of(config.sources, publishes_raw);
  double rate_hz = 0.0;  // of the fastest source
  for (const auto& source : self->sources_) {
    rate_hz = std::max(rate_hz, devices::nominal_rate_hz(*source));
  }
  self->decoded_slots_ = pipeline::ring_slots(rate_hz);
  self->messages_per_s_ = rate_hz * static_cast<double>(self->count_) * (raw ? 2.0 : 1.0);
  self->finished_slots_ = self->decoded_slots_ * (raw ? 2 : 1);
  self->exchange_ = std::make_unique<pipeline::StreamExchange>(first + self->count_, *self->wake_);
  self->counters_ = std::make_unique<pipeline::StreamCounters[]>(self->count_);
  return self;
}

Result<> BodyStreams::open_source(const config::SourceConfig& config, std::uint32_t number) {
  auto source = devices::open_source(config, models_);
  if (!source) return std::unexpected(source.error());
  for (const std::string& warning : (*source)->device.warnings) {
    spdlog::warn("{}: {}", config.name, warning);
  }
  auto one = std::make_unique<devices::BodySource>();
  one->config = config;
  one->number = number;
  one->source = std::move(*source);
  one->exchange = std::make_unique<pipeline::BodyExchange>(*wake_);
  sources_.push_back(std::move(one));
  return {};
}

BodyStreams::~BodyStreams() = default;

void BodyStreams::add_to(pipeline::Reader& reader) {
  for (const auto& source : sources_) {
    devices::OpenSource& device = *source->source;
    reader.add({.device = device.device.transport ? &device.device : nullptr,
                .counters = &device.counters,
                .slot = device.slot.get(),
                .bodies = source->exchange.get()});
  }
}

Result<> BodyStreams::start(StreamUsers users, std::set<std::string> reserved) {
  users_ = std::move(users);
  for (const auto& source : sources_) {
    drivers::Transport* const transport = source->source->device.transport.get();
    if (transport == nullptr) continue;
    if (auto started = transport->start(system::monotonic_ns()); !started) {
      return devices::of_source(source->config.name, started.error());
    }
  }
  std::size_t named = 0;
  for (const auto& source : sources_) named += source->config.named.size();
  builder_ = std::make_unique<devices::SourceBuilder>(
      sources_, devices::StreamSlots(first_, static_cast<std::uint32_t>(count_), named),
      std::move(reserved), models_, users_.partners, *this);
  thread_ = std::thread([this] { run(); });
  for (const auto& source : sources_) {
    if (!devices::DeviceSupervisor::wanted(*source->source)) continue;
    devices::SupervisorPorts ports{
        .reader = users_.reader, .clock = system::monotonic_ns, .report = {}};
    ports.report = [this, &source = *source](v1::Event::Kind kind, const std::string& text) {
      report(source, kind, text);
    };
    supervisors_.push_back(
        std::make_unique<devices::DeviceSupervisor>(*source->source, std::move(ports)));
  }
  return {};
}

void BodyStreams::run() {
  system::name_thread(kThreadName);
  while (true) {
    wake_->going_to_sleep();  // before the turn, so that what comes during it ends the wait
    if (builder_->stopped()) break;
    pulse_.beat();
    const std::int64_t due_ns = builder_->turn(system::monotonic_ns());
    static_cast<void>(poller_->wait(system::time_left_ns(due_ns, system::monotonic_ns)));
    wake_->awake();
  }
}

void BodyStreams::stop_supervisors() noexcept {
  for (const auto& supervisor : supervisors_) supervisor->stop();
}

void BodyStreams::stop() noexcept {
  supervisors_.clear();
  if (!thread_.joinable()) return;
  builder_->stop();
  wake_->notify();
  thread_.join();
}

pipeline::StreamCounters& BodyStreams::counters(std::uint32_t stream) {
  return counters_[pipeline::slot_of(stream) - first_];
}

void BodyStreams::add(devices::NewStream stream) {
  if (users_.record && stream.engine) users_.record(stream);
  const std::uint32_t id = stream.id;
  const devices::OpenSource& source = *stream.source.source;
  {
    const std::scoped_lock lock(mutex_);
    source_of_[id] = &stream.source;
  }
  drivers::Description description = source.device.description;
  description.skeleton = stream.body.skeleton;
  description.samples = stream.body.samples;
  description.rate_hz = stream.rate_hz;
  users_.publisher->add({.stream = id,
                         .name = stream.config.name,
                         .description = std::move(description),
                         .skeleton = stream.stages.published,
                         .rate_hz = stream.rate_hz,
                         .stages = publish::stage_infos(stream.stages.settings),
                         .raw = stream.config.publish_raw,
                         .comes_and_goes = source.slot != nullptr,
                         .present = source.present,
                         .counters = &counters(id),
                         .source_counters = &source.counters,
                         .source = stream.source.config.name,
                         .body = stream.body.name,
                         .refusal = stream.refusal});
  if (!stream.engine) return;
  stream.engine->clock = system::monotonic_ns;
  auto context = users_.worker->make_context(std::move(*stream.engine), stream.rate_hz,
                                             counters(id), finished_slots_);
  for (pipeline::Command& command : stream.bound.first_commands) command.stream = id;
  context->set_first_commands(std::move(stream.bound.first_commands));
  users_.handler->add_stream({.stream = id,
                              .name = stream.config.name,
                              .publishes_raw = stream.config.publish_raw,
                              .skeleton = stream.body.skeleton,
                              .settings = std::move(stream.stages.settings),
                              .models = std::move(stream.bound.models),
                              .device = source.present,
                              .options = source.options,
                              .calibration = nullptr,
                              .source = stream.source.config.name});
  // never full: at most one stream waits for each slot
  static_cast<void>(exchange_->coming.push(context.get()));
  contexts_[id] = std::move(context);
}

std::optional<std::uint32_t> BodyStreams::take_gone() {
  std::optional<std::uint32_t> id;
  static_cast<void>(exchange_->gone.consume(
      [&](const pipeline::StreamContext* context) { id = context->stream(); }));
  return id;
}

void BodyStreams::remove(std::uint32_t stream) {
  contexts_.erase(stream);
  users_.publisher->remove(stream);
  users_.handler->remove_stream(stream);
  const std::scoped_lock lock(mutex_);
  source_of_.erase(stream);
}

void BodyStreams::report(const devices::BodySource& source, v1::Event::Kind kind,
                         const std::string& text) {
  const std::scoped_lock lock(mutex_);
  bool told = false;
  for (const auto& [stream, of] : source_of_) {
    if (of != &source) continue;
    users_.publisher->post_event(stream, kind, text);
    told = true;
  }
  if (told) return;
  const bool bad = kind == v1::Event::KIND_WARNING || kind == v1::Event::KIND_LOST;
  spdlog::log(bad ? spdlog::level::warn : spdlog::level::info, "{}: {}", source.config.name, text);
}

}  // namespace posed::assembly
