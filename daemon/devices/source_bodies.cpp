#include "daemon/devices/source_bodies.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/devices/source_builder.hpp"
#include "daemon/pipeline/description_row.hpp"
#include "proto/frame/same_skeleton.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::devices {
namespace {

constexpr std::size_t kMaxName = kMaxStreamName - kRawSuffix.size();

char plain(char c) {
  if (c >= 'A' && c <= 'Z') return static_cast<char>(c - 'A' + 'a');
  const bool allowed = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  return allowed ? c : '-';
}

bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

bool same_body(const drivers::Body& a, const drivers::Body& b) {
  return same_skeleton(a.skeleton.get(), b.skeleton.get()) && a.samples.names == b.samples.names &&
         a.samples.units == b.samples.units && a.number == b.number;
}

}  // namespace

std::string plain_stream_name(const std::string& source, const std::string& body) {
  std::string name = source;
  name += "-";
  name += body;
  std::erase_if(name, continues_character);  // of UTF-8: one '-' for each character
  std::ranges::transform(name, name.begin(), plain);
  return name.substr(0, kMaxName);
}

const std::string* BodyNames::name_of(const std::string& source, const std::string& body,
                                      int number) {
  const Body key{source, body, number};
  const auto known = names_.find(key);
  if (known != names_.end()) return &known->second;
  if (kept_[source] >= kMaxKept) return nullptr;
  ++kept_[source];
  const std::string plain = plain_stream_name(source, body);
  std::string name = plain;
  const auto taken = [this](const std::string& one) {
    return taken_.contains(one) || taken_.contains(raw_name(one));
  };
  for (int i = 2; taken(name); ++i) {
    const std::string suffix = "-" + std::to_string(i);
    name = plain.substr(0, kMaxName - suffix.size()) + suffix;
  }
  taken_.insert(name);
  taken_.insert(raw_name(name));
  return &names_.emplace(key, std::move(name)).first->second;
}

SourceBodies::SourceBodies(SharedBodies& shared, OpenSource& source)
    : shared_(shared), source_(source) {}

SourceBodies::~SourceBodies() = default;

void SourceBodies::reserve_only() {
  const auto id = shared_.slots.next_free(true);
  assert(id);  // the config reader makes sure that there is a slot for each stream that it names
  ++made_;
  streams_.push_back({.key = "\n1",
                      .name = source_.config.named[0].stream.name,
                      .id = *id,
                      .body = only_body(source_),
                      .named = true});
}

Result<> SourceBodies::build_only() {
  only_.emplace(make(streams_[0], source_.config.named[0].stream));
  if (!only_->engine) {
    return std::unexpected(Error{only_->refusal, {}, 0, only_->exit_code});
  }
  return {};
}

void SourceBodies::add_only() {
  shared_.host.add(std::move(*only_));
  only_.reset();
}

// One update after the other: the streams of an earlier one must have left before their slots and
// their names can be used again.
std::int64_t SourceBodies::due_ns(std::int64_t now_ns) const {
  const bool busy = sent_ || !leaving_.empty();
  const auto& descriptions = source_.exchange->descriptions;
  const auto outdated = [this](const Stream& stream) { return is_outdated(stream); };
  const bool wanted = (descriptions && descriptions->has_new()) || may_have_slot() ||
                      std::ranges::any_of(streams_, outdated);
  return busy || !wanted ? system::kForever_ns : std::max(now_ns, next_ns_);
}

std::size_t SourceBodies::share() const {
  const std::size_t alike = source_.has_several() ? shared_.several : shared_.single;
  return shared_.max_made / 2 / std::max<std::size_t>(alike, 1);
}

// Whether a body without a slot may get one now.
bool SourceBodies::may_have_slot() const {
  return without_slot_ > 0 && shared_.slots.freed() != freed_;
}

// A stage is made for its partners, so it is made again when one comes or has become another
// stream. A partner that has only left sends nothing more. A refused stream may fit what control
// has set.
bool SourceBodies::is_outdated(const Stream& stream) const {
  if (made_ >= share() && !stream.named) return false;
  const auto& state = shared_.host.counters(stream.id).pipeline.state;
  const bool ended = !stream.refused && state.load() == pipeline::StreamState::kEnded;
  if (ended) return false;  // nothing more comes to it
  const bool changed = shared_.kept.changes(stream.name) != stream.changes;
  if (stream.missed_change || (stream.refused && changed)) return true;
  return std::ranges::any_of(stream.partners, [this](const auto& partner) {
    const auto now = shared_.partners.find(partner.first);
    return now != shared_.partners.end() && now->second.stream != partner.second;
  });
}

void SourceBodies::turn(std::int64_t now_ns) {
  take_back();
  if (shared_.is_stopped() || due_ns(now_ns) > now_ns) return;
  // Beyond its share a source makes streams seldom, and only for bodies that the config names.
  next_ns_ = now_ns + (made_ < share() ? SourceBuilder::kBetweenUpdates_ns
                                       : SourceBuilder::kBetweenLateUpdates_ns);
  std::vector<std::byte> newest = description_;
  auto& descriptions = source_.exchange->descriptions;
  if (descriptions) static_cast<void>(descriptions->receive(newest));
  build(std::move(newest));
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

void SourceBodies::build(std::vector<std::byte> description) {
  auto update = std::make_unique<pipeline::SourceUpdate>();
  const std::vector<drivers::Body> only{source_.has_several() ? drivers::Body{}
                                                              : only_body(source_)};
  if (source_.has_several()) {
    auto layout = source_.driver->make_layout(description);
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
    use_mapping_on(**layout);
    update->layout = std::move(*layout);
  }
  description_ = std::move(description);
  without_slot_ = without_name_ = 0;
  too_many_made_ = false;
  freed_ = shared_.slots.freed();
  std::vector<Stream> now = streams_of(update->layout ? update->layout->bodies : only, *update);
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
  sent_ = std::move(update);
  const bool sent = source_.exchange->updates.push(sent_.get());
  assert(sent);  // the next update waits until the reader has accepted this one
  shared_.host.call_reader();
  report_oddities();
}

// The user's word about the joints of the bodies, or a sentence, once, why it is not theirs.
void SourceBodies::use_mapping_on(drivers::SourceLayout& layout) {
  if (!source_.mapping) return;
  std::string misfit = drivers::use_mapping(*source_.mapping, layout);
  if (!misfit.empty() && misfit != misfit_) shared_.host.warn(source_, misfit);
  misfit_ = std::move(misfit);
}

// What is odd about a description that is in use.
void SourceBodies::report_oddities() {
  const auto& descriptions = source_.exchange->descriptions;
  const std::uint64_t replaced = descriptions ? descriptions->replaced() : 0;
  const std::uint64_t skipped = replaced - std::exchange(replaced_, replaced);
  if (too_many_made_) {
    warn(
        fmt::format("its bodies came and went {} times, so new ones are not streamed unless the"
                    " config names them; look why it loses them, and start posed again",
                    share()));
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
// known to the host from now on. Those whose stages name partners are built last, because these may
// be among the others.
std::vector<SourceBodies::Stream> SourceBodies::streams_of(const std::vector<drivers::Body>& bodies,
                                                           pipeline::SourceUpdate& update) {
  struct Wanted {
    std::size_t body;
    int number;
    const config::StreamConfig* config;
  };
  std::vector<Wanted> all;
  std::map<std::string, int> called;
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    const int number = ++called[bodies[body].name];
    const config::StreamConfig* const config = wanted(bodies[body].name, number);
    if (config != nullptr) all.push_back({body, number, config});
  }
  std::ranges::stable_partition(all,
                                [](const Wanted& one) { return partners_of(*one.config).empty(); });
  update.bodies.resize(bodies.size());
  std::vector<Stream> streams;
  for (const Wanted& one : all) {
    if (shared_.is_stopped()) break;
    auto stream = stream_of(bodies[one.body], one.number, *one.config);
    if (!stream) continue;
    if (!stream->refused) update.bodies[one.body] = read_body(*stream);
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
  if (now != streams_.end() && same_body(now->body, body) && !is_outdated(*now)) return *now;
  stream.body = body;
  if (!choose_name(stream, number, config)) return std::nullopt;
  if (!choose_slot(stream, now == streams_.end() ? nullptr : &*now)) return std::nullopt;
  NewStream made = make(stream, config);
  shared_.host.add(std::move(made));
  // Control took the stream for absent until now.
  stream.missed_change = shared_.kept.changes(stream.name) != stream.changes;
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
  if (made_ >= share() && !stream.named) {
    too_many_made_ = true;
    return false;
  }
  const auto id =
      earlier != nullptr ? StreamSlots::next(earlier->id) : shared_.slots.next_free(stream.named);
  if (!id) ++without_slot_;
  if (!id) return false;
  stream.id = *id;
  ++made_;
  if (earlier == nullptr) {
    pipeline::restart(shared_.host.counters(stream.id), shared_.numbers[stream.name]);
  }
  return true;
}

NewStream SourceBodies::make(Stream& stream, const config::StreamConfig& config) {
  shared_.host.is_alive();
  stream.changes = shared_.kept.changes(stream.name);
  for (const std::string& name : partners_of(config)) {
    const auto partner = shared_.partners.find(name);
    stream.partners[name] =
        partner == shared_.partners.end() ? pipeline::kNoStream : partner->second.stream;
  }
  NewStream made{.id = stream.id,
                 .source = source_,
                 .body = stream.body,
                 .config = config,
                 .rate_hz = expected_rate_hz(source_, stream.body)};
  made.config.name = stream.name;
  if (auto engine = make_engine_of(made); !engine) {
    made.refusal = engine.error().text();
    made.exit_code = engine.error().exit_code;
  }
  stream.refused = !made.engine.has_value();
  if (!stream.refused) {
    shared_.partners[stream.name] = {
        .stream = stream.id,
        .about = {.skeleton = made.stages.published, .rate_hz = made.stages.settings.rate_hz}};
  }
  return made;
}

Result<> SourceBodies::make_engine_of(NewStream& stream) const {
  // A device with one body that does not state its rate leaves it open.
  const double rate_hz = source_.has_several() ? stream.rate_hz : stream.body.rate_hz;
  auto stages = TRY(load_stages(stream.config, stream.body.skeleton, rate_hz, shared_.models,
                                shared_.partners, &shared_.kept));
  stream.stages = std::move(stages);
  auto bound = TRY(bind_stages(stream.stages, shared_.models));
  stream.bound = std::move(bound);
  auto engine = TRY(make_engine(stream.id, stream.stages, stream.bound));
  stream.engine = std::move(engine);
  return {};
}

pipeline::ReadBody SourceBodies::read_body(const Stream& stream) const {
  return {.stream = stream.id,
          .counters = &shared_.host.counters(stream.id),
          .slots = source_.decoded_slots};
}

void SourceBodies::forget(const Stream& stream) {
  shared_.host.remove(stream.id);
  const auto partner = shared_.partners.find(stream.name);
  if (partner != shared_.partners.end() && partner->second.stream == stream.id) {
    shared_.partners.erase(partner);
  }
  shared_.numbers[stream.name] = pipeline::next_numbers(shared_.host.counters(stream.id));
  const auto has_slot = [&](const Stream& other) {
    return pipeline::slot_of(other.id) == pipeline::slot_of(stream.id);
  };
  if (std::ranges::none_of(streams_, has_slot)) shared_.slots.give_back(stream.id, stream.named);
}

}  // namespace posed::devices
