#include "daemon/devices/source_bodies.hpp"

#include <algorithm>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/devices/source_builder.hpp"
#include "daemon/pipeline/description_row.hpp"
#include "daemon/system/clock.hpp"
#include "proto/frame/same_skeleton.hpp"

namespace posed::devices {
namespace {

constexpr double kUsualRate_hz = 120.0;  // of mocap systems that do not say
// Streams that one run of the daemon makes. A device log has no room for more.
constexpr std::size_t kMaxMade = 60'000;

bool same_body(const drivers::Body& a, const drivers::Body& b) {
  return same_skeleton(a.skeleton.get(), b.skeleton.get()) && a.samples.names == b.samples.names &&
         a.samples.units == b.samples.units;
}

}  // namespace

double nominal_rate_hz(const BodySource& source) {
  if (source.config.rate_hz > 0.0) return source.config.rate_hz;
  const double rate_hz = source.source->device.description.rate_hz;
  return rate_hz > 0.0 ? rate_hz : kUsualRate_hz;
}

SourceBodies::SourceBodies(SharedBodies& shared, BodySource& source)
    : shared_(shared), source_(source) {}

SourceBodies::~SourceBodies() = default;

// One update after the other: the streams of an earlier one must have left before their slots and
// their names can be used again.
std::int64_t SourceBodies::due_ns(std::int64_t now_ns) const {
  const bool busy = sent_ || !leaving_.empty();
  if (busy || !(source_.exchange->descriptions.has_new() || may_have_slot())) {
    return system::kForever_ns;
  }
  return std::max(now_ns, next_ns_);
}

// Whether a body without a slot may get one now.
bool SourceBodies::may_have_slot() const {
  return without_slot_ > 0 && shared_.slots.freed() != freed_;
}

void SourceBodies::turn(std::int64_t now_ns) {
  take_back();
  if (shared_.is_stopped() || due_ns(now_ns) > now_ns) return;
  next_ns_ = now_ns + SourceBuilder::kBetweenUpdates_ns;
  static_cast<void>(source_.exchange->descriptions.take(description_));
  build();
}

bool SourceBodies::gone(std::uint32_t id) {
  for (std::vector<Stream>* list : {&leaving_, &streams_}) {
    const auto found = std::ranges::find(*list, id, &Stream::id);
    if (found == list->end()) continue;
    const Stream stream = std::move(*found);
    list->erase(found);
    forget(stream);
    return true;
  }
  return false;
}

// An update that the reader has taken ends the use of the one before it.
void SourceBodies::take_back() {
  const auto taken = [this](const pipeline::SourceUpdate*) { used_ = std::move(sent_); };
  while (source_.exchange->taken.consume(taken)) {
  }
}

void SourceBodies::build() {
  auto layout = source_.source->driver->make_layout(description_);
  if (!layout) {
    return warn(
        "it describes its bodies in a way that posed cannot use, so they stay as they are: " +
        layout.error().text());
  }
  if ((*layout)->bodies.size() > kMaxBodies) {
    return warn(
        fmt::format("it describes {} bodies; posed takes {} of one source, so they stay as"
                    " they are",
                    (*layout)->bodies.size(), kMaxBodies));
  }
  without_slot_ = without_name_ = 0;
  freed_ = shared_.slots.freed();
  auto update = std::make_unique<pipeline::SourceUpdate>();
  std::vector<Stream> now = streams_of((*layout)->bodies, *update);
  if (shared_.is_stopped()) return;  // perhaps not all of them, so the reader must not have them
  const std::vector<Stream> before = std::exchange(streams_, std::move(now));
  for (const Stream& stream : before) {
    if (std::ranges::find(streams_, stream.id, &Stream::id) != streams_.end()) continue;
    // The worker has to end a stream that runs; a refused one goes at once.
    if (stream.refused) forget(stream);
    if (!stream.refused) leaving_.push_back(stream);
  }
  std::vector<std::uint32_t> ids(update->bodies.size());
  std::ranges::transform(update->bodies, ids.begin(), &pipeline::ReadBody::stream);
  update->log = pipeline::pack_description(ids, description_);
  update->layout = std::move(*layout);
  sent_ = std::move(update);
  // never full: the next update waits until this one was taken
  static_cast<void>(source_.exchange->updates.push(sent_.get()));
  shared_.host.call_reader();
  tell();
}

// What is odd about a description that is in use.
void SourceBodies::tell() {
  const std::uint64_t replaced = source_.exchange->descriptions.replaced();
  const std::uint64_t skipped = replaced - std::exchange(replaced_, replaced);
  if (too_many_made_) {
    warn(
        fmt::format("its bodies came and went {} times, so new ones are not streamed; look why it"
                    " loses them, and start posed again",
                    shared_.made));
  } else if (without_slot_ > 0) {
    warn(
        fmt::format("{} of its bodies are not streamed, because all streams are in use; raise"
                    " max_streams in the config",
                    without_slot_));
  } else if (without_name_ > 0) {
    warn(
        "it has named more bodies than posed remembers, so new ones are not streamed; start posed"
        " again");
  } else if (skipped > 0) {
    warn(
        "it changes its description faster than posed follows, which is twice a second; the newest"
        " one counts");
  } else {
    warned_.clear();
  }
}

void SourceBodies::warn(const std::string& sentence) {
  if (sentence == warned_) return;
  warned_ = sentence;
  shared_.host.warn(source_, sentence);
}

// The streams of these bodies. Those that stay are the same as before; the others are new, and
// known to the host from now on.
std::vector<SourceBodies::Stream> SourceBodies::streams_of(const std::vector<drivers::Body>& bodies,
                                                           pipeline::SourceUpdate& update) {
  std::vector<Stream> streams;
  std::map<std::string, int> called;
  for (const drivers::Body& body : bodies) {
    if (shared_.is_stopped()) break;
    pipeline::ReadBody& read = update.bodies.emplace_back();
    const int number = ++called[body.name];
    const config::StreamConfig* config = wanted(body.name, number);
    if (config == nullptr) continue;
    auto stream = stream_of(body, number, *config);
    if (!stream) continue;
    if (!stream->refused) read = read_body(*stream);
    streams.push_back(std::move(*stream));
  }
  return streams;
}

// How the body is streamed; null if nobody wants it.
const config::StreamConfig* SourceBodies::wanted(const std::string& body, int number) const {
  const auto named =
      std::ranges::find(source_.config.named, body, &config::SourceConfig::NamedBody::body);
  if (named != source_.config.named.end() && number == 1) return &named->stream;
  return source_.config.all ? &source_.config.every : nullptr;
}

std::optional<SourceBodies::Stream> SourceBodies::stream_of(const drivers::Body& body, int number,
                                                            const config::StreamConfig& config) {
  Stream stream;
  stream.key = body.name + "\n" + std::to_string(number);
  const auto now = std::ranges::find(streams_, stream.key, &Stream::key);
  if (now != streams_.end() && same_body(now->body, body)) return *now;
  stream.body = body;
  if (!choose_name(stream, number, config)) return std::nullopt;
  if (!choose_slot(stream, now == streams_.end() ? nullptr : &*now)) return std::nullopt;
  add(stream, config);
  return stream;
}

bool SourceBodies::choose_name(Stream& stream, int number, const config::StreamConfig& config) {
  stream.named = !config.name.empty();
  stream.name = config.name;
  if (stream.named) return true;
  const std::string* const name =
      shared_.names.name_of(source_.config.name, stream.body.name, number);
  if (name == nullptr) ++without_name_;
  if (name != nullptr) stream.name = *name;
  return name != nullptr;
}

// `earlier`: the body's stream until now, whose slot and numbers this one takes over.
bool SourceBodies::choose_slot(Stream& stream, const Stream* earlier) {
  too_many_made_ = shared_.made >= kMaxMade;
  if (too_many_made_) return false;
  const auto id =
      earlier != nullptr ? StreamSlots::next(earlier->id) : shared_.slots.take(stream.named);
  if (!id) ++without_slot_;
  if (!id) return false;
  stream.id = *id;
  ++shared_.made;
  if (earlier == nullptr) {
    pipeline::restart(shared_.host.counters(stream.id), shared_.numbers[stream.name]);
  }
  return true;
}

void SourceBodies::add(Stream& stream, const config::StreamConfig& config) {
  NewStream added{.id = stream.id,
                  .source = source_,
                  .body = stream.body,
                  .config = config,
                  .rate_hz = rate_of(stream.body)};
  added.config.name = stream.name;
  if (auto made = make_engine_of(added); !made) added.refusal = made.error().text();
  stream.refused = !added.engine.has_value();
  shared_.host.add(std::move(added));
}

Result<> SourceBodies::make_engine_of(NewStream& stream) const {
  auto stages = load_stages(stream.config, stream.body.skeleton, stream.rate_hz, shared_.models,
                            shared_.partners);
  if (!stages) return std::unexpected(stages.error());
  stream.stages = std::move(*stages);
  auto bound = bind_stages(stream.stages);
  if (!bound) return std::unexpected(bound.error());
  stream.bound = std::move(*bound);
  auto engine = make_engine(stream.id, stream.stages, stream.bound);
  if (!engine) return std::unexpected(engine.error());
  stream.engine = std::move(*engine);
  return {};
}

double SourceBodies::rate_of(const drivers::Body& body) const {
  if (source_.config.rate_hz > 0.0) return source_.config.rate_hz;
  return body.rate_hz > 0.0 ? body.rate_hz : nominal_rate_hz(source_);
}

pipeline::ReadBody SourceBodies::read_body(const Stream& stream) const {
  return {.stream = stream.id,
          .counters = &shared_.host.counters(stream.id),
          .slots = shared_.host.decoded_slots()};
}

void SourceBodies::forget(const Stream& stream) {
  shared_.host.remove(stream.id);
  shared_.numbers[stream.name] = pipeline::next_numbers(shared_.host.counters(stream.id));
  const auto has_slot = [&](const Stream& other) {
    return pipeline::slot_of(other.id) == pipeline::slot_of(stream.id);
  };
  if (std::ranges::none_of(streams_, has_slot)) shared_.slots.give_back(stream.id, stream.named);
}

}  // namespace posed::devices
