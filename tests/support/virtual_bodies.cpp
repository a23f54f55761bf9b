#include "tests/support/virtual_bodies.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <catch2/catch.hpp>

#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {

void PublishedStream::count(const Frame& frame, bool is_raw, bool in_lists) {
  ++(is_raw ? published.raw : published.frames);
  REQUIRE(is_sound(frame));
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

VirtualBodies::VirtualBodies(std::vector<VirtualSource> sources, std::uint32_t first,
                             std::size_t streams, bool keeps_log)
    : first_(first),
      wake_(system::EventFd::open().value()),
      counters_(streams),
      keeps_log_(keeps_log) {
  for (VirtualSource& source : sources) {
    auto one = std::make_unique<devices::BodySource>();
    one->config = std::move(source.config);
    one->number = first + static_cast<std::uint32_t>(sources_.size());
    one->source = std::make_unique<devices::OpenSource>();
    one->source->name = one->config.name;
    one->source->driver = drivers::find_driver(one->config.driver);
    one->source->options = one->config.options;
    one->source->device.description = one->source->driver->expect(one->config.options).value();
    one->exchange = std::make_unique<pipeline::BodyExchange>(*wake_);
    devices_.push_back(std::make_unique<ScriptedDevice>(one->source->device.description,
                                                        std::move(source.links), source.repeat_s,
                                                        std::move(source.poll)));
    sources_.push_back(std::move(one));
    files_.push_back(std::move(source.files));
    slots_ = std::max(slots_, source.slots);
  }
  exchange_ = std::make_unique<pipeline::StreamExchange>(first + streams, *wake_);
}

VirtualBodies::~VirtualBodies() = default;

void VirtualBodies::add_to(record::RecordedSetup& setup) const {
  const record::RecordedSetup own = record::recorded_setup({}, sources_, counters_.size());
  for (const auto& source : own.sources) {
    setup.add_bodies(source.row, source.rate_hz, source.bodies);
  }
  setup.slots_to_come = own.slots_to_come;
}

void VirtualBodies::add_to(pipeline::Reader& reader) {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    reader.add({.device = devices_[i]->next(),
                .counters = &sources_[i]->source->counters,
                .slot = &devices_[i]->slot(),
                .bodies = sources_[i]->exchange.get()});
  }
}

void VirtualBodies::start(pipeline::Worker& worker, pipeline::Reader& reader,
                          record::RecordRings* record_sink, std::set<std::string> reserved,
                          pipeline::PartnerStreams partners, std::function<void()> meanwhile) {
  worker_ = &worker;
  reader_ = &reader;
  record_sink_ = record_sink;
  std::size_t named_bodies = 0;
  meanwhile_ = std::move(meanwhile);
  partners_ = std::move(partners);
  for (const auto& source : sources_) {
    for (const auto& named : source->config.named) reserved.insert(named.stream.name);
    named_bodies += source->config.named.size();
  }
  builder_ = std::make_unique<devices::SourceBuilder>(
      sources_,
      devices::StreamSlots(first_, static_cast<std::uint32_t>(counters_.size()), named_bodies),
      std::move(reserved), models_, partners_, *this);
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
  REQUIRE_FALSE(found->second->published.ended);
  return found->second->published;
}

void VirtualBodies::publish_end(PublishedStream& stream) {
  stream.ended = true;
  builder_due_ns_ = virtual_now_ns;  // it may wait for this in remove()
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
  if (keeps_log_) log_.push_back(std::move(about));
  streams_.erase(found);
}

pipeline::StreamCounters& VirtualBodies::counters(std::uint32_t stream) {
  return counters_[pipeline::slot_of(stream) - first_];
}

// In the order of assembly::BodyStreams::add.
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
    added->context =
        worker_->make_context(std::move(*stream.engine), stream.rate_hz, counters(id), slots_);
    for (pipeline::Command& command : stream.bound.first_commands) command.stream = id;
    added->context->set_first_commands(std::move(stream.bound.first_commands));
    REQUIRE(exchange_->coming.push(added->context.get()));
  }
  REQUIRE(streams_.emplace(id, std::move(added)).second);
  meanwhile_();
}

// The daemon's publisher ends a removal after the items that are in its ring. Here the builder
// waits for the stream's last item.
std::optional<std::uint32_t> VirtualBodies::take_gone() {
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

void VirtualBodies::warn(const devices::BodySource& /*source*/, const std::string& sentence) {
  REQUIRE_FALSE(sentence.empty());
  ++warnings_;
}

}  // namespace posed::test
