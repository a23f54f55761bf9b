#include "daemon/assembly/streams.hpp"

#include <algorithm>
#include <cassert>
#include <set>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::assembly {
namespace {

bool publishes_raw(const config::SourceConfig& source) {
  const auto raw = [](const config::SourceConfig::NamedBody& named) {
    return named.stream.publish_raw;
  };
  return source.every.publish_raw || std::ranges::any_of(source.named, raw);
}

// Half a second of the frames and samples of one of its bodies. Those of a device with several have
// frames or samples.
std::size_t decoded_slots_of(const devices::OpenSource& source) {
  if (source.has_several()) return pipeline::ring_slots(devices::nominal_rate_hz(source));
  const drivers::Body body = devices::only_body(source);
  const int kinds = (body.skeleton ? 1 : 0) + (body.samples.names.empty() ? 0 : 1);
  return pipeline::ring_slots(devices::expected_rate_hz(source, body) * std::max(kinds, 1));
}

// Names that no body may get: those of all streams that the config names, with their raw input.
std::set<std::string> reserved_names(const std::vector<std::unique_ptr<devices::OpenSource>>& all) {
  std::set<std::string> names;
  for (const auto& source : all) {
    for (const auto& named : source->config.named) {
      names.insert(named.stream.name);
      if (named.stream.publish_raw) names.insert(raw_name(named.stream.name));
    }
  }
  return names;
}

}  // namespace

Result<std::unique_ptr<Streams>> Streams::open(const config::DaemonConfig& config) {
  std::unique_ptr<Streams> self(new Streams(config));
  self->wake_ = TRY(system::EventFd::open());
  self->poller_ = TRY(system::Poller::open());
  TRY(self->poller_->add(*self->wake_));
  self->kept_.wakes(*self->wake_);
  TRY(self->open_sources());
  self->make_room();
  TRY(self->open_builder());
  return self;
}

Result<> Streams::open_sources() {
  for (const config::StreamConfig& stream : config_.streams) {
    TRY(open_source(config::source_of(stream)));
  }
  for (const config::SourceConfig& source : config_.sources) {
    TRY(open_source(source));
  }
  return {};
}

Result<> Streams::open_source(config::SourceConfig config) {
  auto source = TRY(devices::open_source(std::move(config), models_));
  for (const std::string& warning : source->device.warnings) {
    spdlog::warn("{}: {}", source->config.name, warning);
  }
  source->number = static_cast<std::uint32_t>(sources_.size());
  source->exchange = std::make_unique<pipeline::BodyExchange>(*wake_, source->has_several());
  several_ = several_ || source->has_several();
  sources_.push_back(std::move(source));
  return {};
}

// Each stream has its own slots, so that no stream can use up another's, and every event finds one.
// Bodies may get the slots of each other, so the fastest source decides for all of them.
void Streams::make_room() {
  std::size_t decoded_of_body = 0, finished_of_body = 0;
  double body_messages_per_s = 0.0;
  for (const auto& source : sources_) {
    const bool raw = publishes_raw(source->config);
    const std::size_t decoded = decoded_slots_of(*source);
    if (source->has_several()) {
      const double rate_hz = devices::nominal_rate_hz(*source);
      decoded_of_body = std::max(decoded_of_body, decoded);
      finished_of_body = std::max<std::size_t>(finished_of_body, raw ? 2 : 1);
      body_messages_per_s = std::max(body_messages_per_s, rate_hz);
      continue;
    }
    const double rate_hz = devices::expected_rate_hz(*source, devices::only_body(*source));
    source->decoded_slots = decoded;
    source->finished_slots = decoded + (raw ? pipeline::ring_slots(rate_hz) : 0);
    decoded_slots_ += source->decoded_slots;
    finished_slots_ += source->finished_slots;
    messages_per_s_ += rate_hz * (raw ? 2 : 1);
  }
  const double channels = static_cast<double>(finished_of_body);
  finished_of_body *= decoded_of_body;
  for (const auto& source : sources_) {
    if (!source->has_several()) continue;
    source->decoded_slots = decoded_of_body;
    source->finished_slots = finished_of_body;
  }
  // The config reader makes sure that there is room for all streams that the config names.
  slots_ = several_ ? static_cast<std::size_t>(config_.max_streams) : config_.streams.size();
  const std::size_t bodies = slots_ - config_.streams.size();
  decoded_slots_ += bodies * decoded_of_body + slots_;
  finished_slots_ += bodies * finished_of_body + slots_;
  messages_per_s_ += static_cast<double>(bodies) * body_messages_per_s * channels;
  exchange_ = std::make_unique<pipeline::StreamExchange>(slots_, *wake_);
  counters_ = std::make_unique<pipeline::StreamCounters[]>(slots_);
}

Result<> Streams::open_builder() {
  builder_ =
      std::make_unique<devices::SourceBuilder>(sources_, static_cast<std::uint32_t>(slots_),
                                               reserved_names(sources_), models_, kept_, *this);
  return builder_->open();
}

Streams::~Streams() = default;

void Streams::begin(StreamUsers users) {
  users_ = std::move(users);
  for (const auto& source : sources_) {
    if (!source->has_several()) continue;
    for (const auto& named : source->config.named) {
      users_.handler->add_known(control::known_stream(named.stream, source->config.name));
    }
  }
  builder_->begin();
  for (const auto& source : sources_) {
    pipeline::ReadSource read{.device = source->device.transport ? &source->device : nullptr,
                              .counters = &source->counters,
                              .slot = source->slot.get(),
                              .calibration = source->calibration.get(),
                              .exchange = source->exchange.get()};
    // The only body of such a source has the slot of its number.
    if (!source->has_several()) {
      read.body = {.stream = source->number,
                   .counters = &counters(source->number),
                   .slots = source->decoded_slots};
    }
    users_.reader->add(read);
  }
}

Result<> Streams::start() {
  for (const auto& source : sources_) {
    drivers::Transport* const transport = source->device.transport.get();
    if (transport == nullptr) continue;
    if (auto started = transport->start(system::monotonic_ns()); !started) {
      return devices::in_source(*source, started.error());
    }
  }
  if (several_) thread_ = std::thread([this] { run(); });
  for (const auto& source : sources_) {
    if (!devices::DeviceSupervisor::wanted(*source)) continue;
    devices::SupervisorPorts ports{
        .reader = users_.reader, .clock = system::monotonic_ns, .report = {}};
    ports.report = [this, &source = *source](v1::Event::Kind kind, const std::string& text) {
      report(source, kind, text);
    };
    supervisors_.push_back(std::make_unique<devices::DeviceSupervisor>(*source, std::move(ports)));
  }
  return {};
}

void Streams::run() {
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

void Streams::stop_supervisors() noexcept {
  for (const auto& supervisor : supervisors_) supervisor->stop();
}

void Streams::stop() noexcept {
  supervisors_.clear();
  if (!thread_.joinable()) return;
  builder_->stop();
  wake_->notify();
  thread_.join();
}

void Streams::add(devices::NewStream stream) {
  if (users_.record && stream.engine) users_.record(stream);
  const std::uint32_t id = stream.id;
  const devices::OpenSource& source = stream.source;
  // People know the stream of a device with one body by its own name alone.
  const std::string source_name = source.has_several() ? source.config.name : std::string();
  {
    const std::scoped_lock lock(mutex_);
    there_[id] = {.source = &source, .name = stream.config.name};
  }
  users_.handler->add_known(control::known_stream(stream.config, source_name));
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
                         .source = source_name,
                         .body = stream.body.name,
                         .remark = stream.body.remark,
                         .number = stream.body.number,
                         .refusal = stream.refusal});
  if (!stream.engine) return;
  if (!stream.stages.remark.empty()) {
    spdlog::info("{}: {}", stream.config.name, stream.stages.remark);
  }
  for (const auto& model : stream.bound.models) {
    if (model && !model->remark.empty()) spdlog::info("{}: {}", stream.config.name, model->remark);
  }
  stream.engine->clock = system::monotonic_ns;
  auto context = users_.worker->make_context(std::move(*stream.engine), stream.rate_hz,
                                             counters(id), source.finished_slots);
  for (pipeline::Command& command : stream.bound.first_commands) command.stream = id;
  context->set_first_commands(std::move(stream.bound.first_commands));
  users_.handler->add_stream({.stream = id,
                              .name = stream.config.name,
                              .publishes_raw = stream.config.publish_raw,
                              .skeleton = stream.body.skeleton,
                              .settings = std::move(stream.stages.settings),
                              .models = std::move(stream.bound.models),
                              .device = source.present,
                              .options = source.config.options,
                              .source_number = source.number,
                              .source = source_name});
  const bool handed_over = exchange_->coming.push(context.get());
  assert(handed_over);  // at most one stream waits for each slot
  contexts_[id] = std::move(context);
}

std::optional<std::uint32_t> Streams::next_gone() {
  std::optional<std::uint32_t> id;
  static_cast<void>(exchange_->gone.consume(
      [&](const pipeline::StreamContext* context) { id = context->stream(); }));
  return id;
}

void Streams::remove(std::uint32_t stream) {
  contexts_.erase(stream);
  users_.publisher->remove(stream);
  users_.handler->remove_stream(stream);
  const std::scoped_lock lock(mutex_);
  there_.erase(stream);
}

Streams::Counts Streams::counts() const {
  const std::scoped_lock lock(mutex_);
  Counts counts{.live = 0, .all = there_.size()};
  for (const auto& [id, stream] : there_) {
    if (counters_of(id).pipeline.state.load() == pipeline::StreamState::kLive) ++counts.live;
  }
  return counts;
}

std::vector<std::string> Streams::names() const {
  std::vector<std::string> names;
  for (const auto& source : sources_) {
    for (const auto& named : source->config.named) names.push_back(named.stream.name);
  }
  const std::scoped_lock lock(mutex_);
  for (const auto& [id, stream] : there_) {
    if (std::ranges::find(names, stream.name) == names.end()) names.push_back(stream.name);
  }
  return names;
}

void Streams::report(const devices::OpenSource& source, v1::Event::Kind kind,
                     const std::string& text) {
  const std::scoped_lock lock(mutex_);
  bool posted = false;
  for (const auto& [id, stream] : there_) {
    if (stream.source != &source) continue;
    users_.publisher->post_event(id, kind, text);
    posted = true;
  }
  if (posted) return;
  const bool bad = kind == v1::Event::KIND_WARNING || kind == v1::Event::KIND_LOST;
  spdlog::log(bad ? spdlog::level::warn : spdlog::level::info, "{}: {}", source.config.name, text);
}

}  // namespace posed::assembly
