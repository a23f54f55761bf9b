#include "daemon/devices/source_builder.hpp"

#include <algorithm>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/pipeline/description_row.hpp"
#include "daemon/system/clock.hpp"
#include "proto/text/clean.hpp"

namespace posed::devices {
namespace {

constexpr double kUsualRate_hz = 120.0;  // of mocap systems that do not say

bool same(const drivers::Body& a, const drivers::Body& b) {
  const auto id = [](const drivers::Body& body) { return body.skeleton ? body.skeleton->id : 0; };
  return id(a) == id(b) && (a.skeleton == nullptr) == (b.skeleton == nullptr) &&
         a.samples.names == b.samples.names && a.samples.units == b.samples.units;
}

}  // namespace

double nominal_rate_hz(const BodySource& source) {
  if (source.config.rate_hz > 0.0) return source.config.rate_hz;
  const double rate_hz = source.source->device.description.rate_hz;
  return rate_hz > 0.0 ? rate_hz : kUsualRate_hz;
}

// The bodies of one source as streams.
class SourceBuilder::Source {
 public:
  Source(SourceBuilder& builder, BodySource& source) : builder_(builder), source_(source) {}

  // Builds what the newest description says, if it is time. Returns when to come again.
  std::int64_t turn(std::int64_t now_ns) {
    take_back();
    if (sent_ || !leaving_.empty() || !source_.exchange->descriptions.has_new()) {
      return system::kForever_ns;
    }
    if (now_ns < next_ns_) return next_ns_;
    next_ns_ = now_ns + kBetweenUpdates_ns;
    if (source_.exchange->descriptions.take(description_)) build();
    return system::kForever_ns;
  }

  // Whether the stream was one of this source.
  bool gone(std::uint32_t id) {
    const auto left = std::ranges::find(leaving_, id, &Stream::id);
    const auto ended = std::ranges::find(streams_, id, &Stream::id);
    if (left == leaving_.end() && ended == streams_.end()) return false;
    auto& list = left != leaving_.end() ? leaving_ : streams_;
    const auto found = left != leaving_.end() ? left : ended;
    const Stream stream = *found;
    list.erase(found);
    forget(stream);
    return true;
  }

 private:
  struct Stream {
    std::string key;  // which of the source's bodies
    std::string name;
    std::uint32_t id = 0;
    drivers::Body body;
    bool refused = false;
  };

  // An update that the reader has taken ends the use of the one before it.
  void take_back() {
    const auto taken = [this](const pipeline::SourceUpdate*) { used_ = std::move(sent_); };
    while (source_.exchange->taken.consume(taken)) {
    }
  }

  void forget(const Stream& stream) {
    builder_.remove(stream.id, stream.name);
    const auto has_slot = [&](const Stream& other) {
      return pipeline::slot_of(other.id) == pipeline::slot_of(stream.id);
    };
    if (std::ranges::none_of(streams_, has_slot)) builder_.slots_.give_back(stream.id);
  }

  void warn(const std::string& sentence) {
    if (sentence == warned_) return;
    warned_ = sentence;
    builder_.host_.warn(source_, sentence);
  }

  void build() {
    auto layout = source_.source->driver->make_layout(description_);
    if (!layout) {
      return warn(
          "it describes its bodies in a way that posed cannot use, so they stay as they"
          " are: " +
          layout.error().text());
    }
    if ((*layout)->bodies.size() > kMaxBodies) {
      return warn(
          fmt::format("it describes {} bodies; posed takes {} of one source, so they stay"
                      " as they are",
                      (*layout)->bodies.size(), kMaxBodies));
    }
    without_slot_ = 0;
    auto update = std::make_unique<pipeline::SourceUpdate>();
    std::vector<Stream> streams = streams_of((*layout)->bodies, *update);
    leave_out(streams);
    streams_ = std::move(streams);
    std::vector<std::uint32_t> ids(update->bodies.size());
    std::ranges::transform(update->bodies, ids.begin(), &pipeline::ReadBody::stream);
    update->log = pipeline::pack_description(ids, description_);
    update->layout = std::move(*layout);
    sent_ = std::move(update);
    // never full: the next update waits until this one was taken
    static_cast<void>(source_.exchange->updates.push(sent_.get()));
    builder_.host_.call_reader();
    tell();
  }

  // What is odd about a description that is in use.
  void tell() {
    const std::uint64_t replaced = source_.exchange->descriptions.replaced();
    const std::uint64_t skipped = replaced - std::exchange(replaced_, replaced);
    if (without_slot_ > 0) {
      warn(
          fmt::format("{} of its bodies are not streamed, because all streams are in use; raise"
                      " max_streams in the config",
                      without_slot_));
    } else if (skipped > 0) {
      warn(
          "it changes its description faster than posed follows, which is twice a second; the"
          " newest one counts");
    } else {
      warned_.clear();
    }
  }

  // The streams of these bodies. Those that stay are the same as before; the others are new, and
  // known to the host from now on.
  std::vector<Stream> streams_of(const std::vector<drivers::Body>& bodies,
                                 pipeline::SourceUpdate& update) {
    std::vector<Stream> streams;
    std::map<std::string, int> called;
    for (const drivers::Body& body : bodies) {
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
  [[nodiscard]] const config::StreamConfig* wanted(const std::string& body, int number) const {
    const auto named =
        std::ranges::find(source_.config.named, body, &config::SourceConfig::NamedBody::body);
    if (named != source_.config.named.end() && number == 1) return &named->stream;
    return source_.config.all ? &source_.config.every : nullptr;
  }

  std::optional<Stream> stream_of(const drivers::Body& body, int number,
                                  const config::StreamConfig& config) {
    const std::string key = body.name + "\n" + std::to_string(number);
    const auto now = std::ranges::find(streams_, key, &Stream::key);
    if (now != streams_.end() && same(now->body, body)) return *now;
    Stream stream;
    stream.key = key;
    stream.body = body;
    stream.name = config.name;
    if (stream.name.empty()) {
      const std::string* const name =
          builder_.names_.name_of(source_.config.name, body.name, number);
      if (name == nullptr) return std::nullopt;
      stream.name = *name;
    }
    const bool follows = now != streams_.end();
    const auto id = follows ? StreamSlots::next(now->id) : builder_.slots_.take();
    if (!id) {
      ++without_slot_;
      return std::nullopt;
    }
    stream.id = *id;
    if (!follows) {
      const Numbers first = builder_.numbers_[stream.name];
      pipeline::restart(builder_.host_.counters(stream.id), first.frame, first.sample);
    }
    add(stream, config);
    return stream;
  }

  void add(Stream& stream, const config::StreamConfig& config) {
    NewStream added{.id = stream.id,
                    .source = source_,
                    .body = stream.body,
                    .config = config,
                    .rate_hz = rate_of(stream.body)};
    added.config.name = stream.name;
    if (auto made = make_engine_of(added); !made) added.refusal = made.error().text();
    stream.refused = !added.engine.has_value();
    builder_.host_.add(std::move(added));
  }

  static Result<> make_engine_of(NewStream& stream) {
    auto stages = load_stages(stream.config, stream.body.skeleton, stream.rate_hz);
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

  [[nodiscard]] double rate_of(const drivers::Body& body) const {
    if (source_.config.rate_hz > 0.0) return source_.config.rate_hz;
    if (body.rate_hz > 0.0) return body.rate_hz;
    return nominal_rate_hz(source_);
  }

  [[nodiscard]] pipeline::ReadBody read_body(const Stream& stream) const {
    pipeline::StreamCounters& counters = builder_.host_.counters(stream.id);
    return {.stream = stream.id,
            .counters = &counters,
            .slots = builder_.host_.decoded_slots(),
            .first = {.stream = stream.id,
                      .frame = counters.reader.frames.load() + 1,
                      .sample = counters.reader.samples.load() + 1}};
  }

  // The streams that are not among the next ones. The worker has to end those that run; a refused
  // one goes at once.
  void leave_out(const std::vector<Stream>& next) {
    for (Stream& stream : streams_) {
      if (std::ranges::find(next, stream.id, &Stream::id) != next.end()) continue;
      if (!stream.refused) {
        leaving_.push_back(std::move(stream));
        continue;
      }
      builder_.remove(stream.id, stream.name);
      const auto has_slot = [&](const Stream& other) {
        return pipeline::slot_of(other.id) == pipeline::slot_of(stream.id);
      };
      if (std::ranges::none_of(next, has_slot)) builder_.slots_.give_back(stream.id);
    }
  }

  SourceBuilder& builder_;
  BodySource& source_;
  std::vector<Stream> streams_;                                // as the description in use says
  std::vector<Stream> leaving_;                                // not yet ended by the worker
  std::unique_ptr<const pipeline::SourceUpdate> sent_, used_;  // under way, and in use
  std::int64_t next_ns_ = 0;
  std::vector<std::byte> description_;
  std::uint64_t replaced_ = 0;
  std::size_t without_slot_ = 0;
  std::string warned_;  // the last sentence
};

SourceBuilder::SourceBuilder(std::vector<std::unique_ptr<BodySource>>& sources, StreamSlots slots,
                             std::set<std::string> reserved, StreamHost& host)
    : host_(host), slots_(std::move(slots)), names_(std::move(reserved)) {
  for (const auto& source : sources) {
    sources_.push_back(std::make_unique<Source>(*this, *source));
  }
}

SourceBuilder::~SourceBuilder() = default;

std::int64_t SourceBuilder::turn(std::int64_t now_ns) {
  remove_gone();
  std::int64_t due_ns = system::kForever_ns;
  for (const auto& source : sources_) due_ns = std::min(due_ns, source->turn(now_ns));
  return due_ns;
}

void SourceBuilder::remove_gone() {
  while (const auto gone = host_.take_gone()) {
    for (const auto& source : sources_) {
      if (source->gone(*gone)) break;
    }
  }
}

// A stream that returns under its name goes on with its numbers.
void SourceBuilder::remove(std::uint32_t stream, const std::string& name) {
  host_.remove(stream);
  const pipeline::ReaderCounters& reader = host_.counters(stream).reader;
  numbers_[name] = {.frame = reader.frames.load() + 1, .sample = reader.samples.load() + 1};
}

}  // namespace posed::devices
