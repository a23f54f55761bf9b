#include "tests/support/virtual_bodies.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <catch2/catch.hpp>

#include "tests/support/virtual_stream_context.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {

void PublishedStream::count(const Frame& frame, bool is_raw, bool in_lists) {
  ++(is_raw ? published.raw : published.frames);
  REQUIRE(is_valid(frame));
  published.root_z_m.insert(std::lround(frame.root_position_m[2]));
  if (is_raw) return;
  const std::uint64_t sequence = frame.header.sequence;
  REQUIRE(sequence >= published.newest);  // a pose may be repeated under its number
  if (sequence > published.newest) ++published.numbers;
  published.newest = sequence;
  if (!in_lists) return;
  published.sequences.push_back(sequence);
  published.at_s.push_back(seconds(virtual_now_ns - kVirtualBegin_ns));
}

VirtualBodies::VirtualBodies(const std::vector<std::unique_ptr<VirtualStreamContext>>& only,
                             std::vector<VirtualSource> sources, std::size_t bodies,
                             std::size_t max_made, bool keeps_log)
    : only_(only),
      wake_(system::EventFd::open().value()),
      counters_(only.size() + (sources.empty() ? 0 : bodies)),
      only_published_(only.size()),
      max_made_(max_made),
      keeps_log_(keeps_log) {
  kept_.wakes(*wake_);
  std::size_t slots_of_body = 0;
  for (const VirtualSource& source : sources) {
    slots_of_body = std::max(slots_of_body, source.slots);
  }
  for (const auto& context : only_) {
    all_slots_ += context->stream.slots + 1;
    open_only(*context);
  }
  for (VirtualSource& source : sources) {
    source.slots = slots_of_body;
    open_source(std::move(source));
  }
  all_slots_ += (counters_.size() - only_.size()) * (slots_of_body + 1);
  exchange_ = std::make_unique<pipeline::StreamExchange>(counters_.size(), *wake_);
}

VirtualBodies::~VirtualBodies() = default;

void VirtualBodies::open_only(VirtualStreamContext& context) {
  const VirtualStream& stream = context.stream;
  config::StreamConfig config;
  config.name = stream.name;
  config.driver = stream.description.driver;
  config.publish_raw = stream.settings.publish_raw;
  config.stale_after_s = stream.settings.stale_after_s;
  config.default_stages = false;
  for (std::size_t i = 0; i < stream.settings.stages.size(); ++i) {
    const pipeline::StageSettings& stage = stream.settings.stages[i];
    config.stages.push_back({.type = stage.type, .parameters = stage.parameters});
    if (i >= stream.model_files.size() || stream.model_files[i].empty()) continue;
    const std::string name = stream.name + "-" + std::to_string(i);
    model_folder_.write(name, stream.model_files[i]);
    config.stages.back().model = model_folder_.path() / name;
  }
  auto source = std::make_unique<devices::OpenSource>();
  source->config = config::source_of(config);
  source->device.description = stream.description;
  open(std::move(source), context.device, stream.slots);
}

void VirtualBodies::open_source(VirtualSource virtual_source) {
  auto source = std::make_unique<devices::OpenSource>();
  source->config = std::move(virtual_source.config);
  source->device.description =
      drivers::find_driver(source->config.driver)->expect(source->config.options).value();
  owned_devices_.push_back(
      std::make_unique<ScriptedDevice>(source->device.description, std::move(virtual_source.links),
                                       virtual_source.repeat_s, std::move(virtual_source.poll)));
  files_.push_back(std::move(virtual_source.files));
  open(std::move(source), *owned_devices_.back(), virtual_source.slots);
}

void VirtualBodies::open(std::unique_ptr<devices::OpenSource> source, ScriptedDevice& device,
                         std::size_t slots) {
  source->number = static_cast<std::uint32_t>(sources_.size());
  source->driver = drivers::find_driver(source->device.description.driver);
  source->exchange = std::make_unique<pipeline::BodyExchange>(*wake_, source->has_several());
  source->decoded_slots = source->finished_slots = slots;
  devices_.push_back(&device);
  sources_.push_back(std::move(source));
}

record::RecordedSetup VirtualBodies::setup() const {
  return record::recorded_setup(sources_, counters_.size());
}

void VirtualBodies::add_to(pipeline::Reader& reader) {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    pipeline::ReadSource read{.device = devices_[i]->next(),
                              .counters = &sources_[i]->counters,
                              .slot = &devices_[i]->slot(),
                              .exchange = sources_[i]->exchange.get()};
    if (i < only_.size()) {
      const std::string& calibration = only_[i]->stream.calibration;
      if (!calibration.empty()) read.calibration = only_[i]->compile(calibration);
      read.body = {.stream = static_cast<std::uint32_t>(i),
                   .counters = &counters_[i],
                   .slots = sources_[i]->decoded_slots};
    }
    reader.add(read);
  }
}

void VirtualBodies::start(pipeline::Worker& worker, pipeline::Reader& reader,
                          record::RecordRings* record_sink, std::function<void()> meanwhile) {
  worker_ = &worker;
  reader_ = &reader;
  record_sink_ = record_sink;
  std::set<std::string> reserved;
  for (const auto& source : sources_) {
    for (const auto& named : source->config.named) reserved.insert(named.stream.name);
  }
  builder_ = std::make_unique<devices::SourceBuilder>(
      sources_, static_cast<std::uint32_t>(counters_.size()), std::move(reserved), models_, kept_,
      *this, max_made_);
  const auto opened = builder_->open();
  INFO((opened ? "" : opened.error().text()));
  REQUIRE(opened);
  builder_->begin();
  meanwhile_ = std::move(meanwhile);
  add_to(reader);
  builder_due_ns_ = virtual_now_ns;
}

bool VirtualBodies::reader_is_called() const {
  const auto has_update = [](const auto& source) { return !source->exchange->updates.empty(); };
  const auto has_device = [](const auto& device) { return !device->slot().in.empty(); };
  return std::ranges::any_of(sources_, has_update) || std::ranges::any_of(devices_, has_device);
}

std::int64_t VirtualBodies::supervisor_due_ns() const {
  std::int64_t due_ns = system::kForever_ns;
  for (const auto& device : devices_) due_ns = std::min(due_ns, device->due_ns());
  return due_ns;
}

void VirtualBodies::supervise() {
  for (const auto& device : devices_) device->supervise(*reader_);
}

// Sleeps and wakes as the daemon's builder does, by the same EventFd.
std::int64_t VirtualBodies::due_ns() {
  if (builder_due_ns_ <= virtual_now_ns) return builder_due_ns_;
  std::uint64_t notified = 0;
  if (read(wake_->fd(), &notified, sizeof notified) > 0) builder_due_ns_ = virtual_now_ns;
  return builder_due_ns_;
}

void VirtualBodies::turn() {
  wake_->awake();
  wake_->going_to_sleep();
  builder_due_ns_ = builder_->turn(virtual_now_ns);
}

PublishedStream& VirtualBodies::find(std::uint32_t stream) {
  INFO("stream " << stream);
  const auto found = streams_.find(stream);
  REQUIRE(found != streams_.end());
  REQUIRE(found->second->context != nullptr);
  // Of a device with one body, whose stream stays when its source has ended.
  REQUIRE((found->second->about.body.empty() || !found->second->published.ended));
  return found->second->published;
}

void VirtualBodies::publish_end(PublishedStream& stream) {
  stream.ended = true;
  builder_due_ns_ = virtual_now_ns;  // it may wait for this in remove()
}

VirtualDaemon::Published VirtualBodies::published(std::uint32_t source) const {
  VirtualDaemon::Published published = only_published_[source];
  for (const auto& [id, stream] : streams_) {
    if (pipeline::slot_of(id) == source) published += stream->published.published;
  }
  return published;
}

std::optional<std::uint32_t> VirtualBodies::stream_of(const std::string& body) const {
  for (const auto& [id, stream] : streams_) {
    if (stream->about.body == body && stream->context) return id;
  }
  return std::nullopt;
}

void VirtualBodies::finish() {
  while (!streams_.empty()) keep(streams_.begin()->first, false);
}

void VirtualBodies::keep(std::uint32_t stream, bool left) {
  const auto found = streams_.find(stream);
  REQUIRE(found != streams_.end());
  const pipeline::StreamCounters& counts = counters(stream);
  VirtualBody& about = found->second->about;
  about.left = left;
  about.published = std::move(found->second->published.published);
  about.decoded = counts.reader.frames;
  about.unpublished = counts.pipeline.dropped;
  about.lost = counts.reader.dropped + counts.pipeline.shed + about.unpublished;
  if (about.body.empty()) {
    only_published_[pipeline::slot_of(stream)] += about.published;
  } else if (keeps_log_) {
    log_.push_back(std::move(about));
  }
  streams_.erase(found);
}

pipeline::StreamCounters& VirtualBodies::counters(std::uint32_t stream) {
  return counters_[pipeline::slot_of(stream)];
}

// In the order of assembly::Streams::add.
void VirtualBodies::add(devices::NewStream stream) {
  const std::uint32_t id = stream.id;
  if (record_sink_ != nullptr && stream.engine) {
    record_sink_->add_stream(record::recorded_stream(stream));
  }
  auto added = std::make_unique<Stream>(VirtualBody{.stream = id,
                                                    .source = stream.source.config.name,
                                                    .body = stream.body.name,
                                                    .name = stream.config.name,
                                                    .refusal = stream.refusal},
                                        PublishedStream(id, stream.config.name, counters(id)),
                                        std::move(stream.bound.models));
  if (stream.engine) {
    stream.engine->clock = virtual_clock;
    added->context = worker_->make_context(std::move(*stream.engine), stream.rate_hz, counters(id),
                                           stream.source.finished_slots);
    for (pipeline::Command& command : stream.bound.first_commands) command.stream = id;
    added->context->set_first_commands(std::move(stream.bound.first_commands));
    REQUIRE(exchange_->coming.push(added->context.get()));
  }
  REQUIRE(streams_.emplace(id, std::move(added)).second);
  if (meanwhile_) meanwhile_();
}

// The daemon's publisher ends a removal after the items that are in its ring. Here the builder
// waits for the stream's last item.
std::optional<std::uint32_t> VirtualBodies::next_gone() {
  while (exchange_->gone.consume(
      [this](const pipeline::StreamContext* context) { gone_.push_back(context->stream()); })) {
  }
  const auto is_published = [this](std::uint32_t id) { return streams_.at(id)->published.ended; };
  const auto found = std::ranges::find_if(gone_, is_published);
  if (found == gone_.end()) return std::nullopt;
  const std::uint32_t id = *found;
  gone_.erase(found);
  return id;
}

void VirtualBodies::remove(std::uint32_t stream) { keep(stream, true); }

void VirtualBodies::warn(const devices::OpenSource& /*source*/, const std::string& sentence) {
  REQUIRE_FALSE(sentence.empty());
  ++warnings_;
}

}  // namespace posed::test
