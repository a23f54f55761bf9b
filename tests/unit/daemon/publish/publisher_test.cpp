#include <array>
#include <cstdint>
#include <numeric>

#include <catch2/catch.hpp>

#include "daemon/publish/published_stream.hpp"
#include "daemon/publish/shed_tally.hpp"
#include "tests/unit/daemon/publish/publisher_rig.hpp"

namespace posed::publish {
using pipeline::Item;

TEST_CASE("status reports the stages by name with the times of the last second") {
  PublisherRig rig;
  REQUIRE(rig.receive("stats", 1));
  Item item = toy_frame_item(1);
  item.frame.stamps.decoded_ns = system::monotonic_ns();
  item.frame.stage_us[0] = 50.0F;
  rig.put(item);
  REQUIRE(rig.receive("stats", 2));
  const v1::Stats status = rig.publisher->stats();
  REQUIRE(status.stream(0).stage_size() == 1);
  CHECK(status.stream(0).stage(0).name() == "style");
  CHECK(status.stream(0).stage(0).time().p50_us() == Approx(50.0).epsilon(0.2));
}

TEST_CASE("figures count from the start: by quality, and the times of what is not stale") {
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));
  Item item = toy_frame_item(1);
  item.frame.header.arrival_ns = system::monotonic_ns();
  item.frame.stamps.decoded_ns = item.frame.header.arrival_ns + 3000;
  item.frame.stage_us[0] = 50.0F;
  for (const Quality quality :
       {Quality::kMeasured, Quality::kHeld, Quality::kHeld, Quality::kStale}) {
    item.frame.quality = quality;
    rig.put(item);
  }
  item.kind = Item::Kind::kRawFrame;
  rig.put(item);
  Item stale;
  stale.kind = Item::Kind::kEvent;
  stale.stream_event = {0, v1::Event::KIND_STALE, 77, 41, 0.5};
  rig.put(stale);
  REQUIRE(rig.receive("event/toy", 1));
  const auto figures = rig.publisher->figures();
  REQUIRE(figures.size() == 1);
  CHECK(figures[0].stream == "toy");
  CHECK(figures[0].rate_hz == 100.0);
  CHECK(figures[0].published == std::array<std::uint64_t, 4>{1, 0, 2, 1});
  CHECK(figures[0].silences == 1);
  const auto count_of = [](const DurationBuckets::Counts& counts) {
    return std::accumulate(counts.count.begin(), counts.count.end(), std::uint64_t{0});
  };
  CHECK(count_of(figures[0].decode) == 3);
  CHECK(figures[0].decode.count[0] == 3);  // at most 5 us
  CHECK(figures[0].decode.sum_ns == 9000);
  CHECK(count_of(figures[0].publish) == 3);
  REQUIRE(figures[0].stages.size() == 1);
  CHECK(figures[0].stages[0].first == "style");
  CHECK(count_of(figures[0].stages[0].second) == 3);
  CHECK(figures[0].stages[0].second.sum_ns == Approx(150'000).margin(10));
}

TEST_CASE("each kind of item is published under its topic") {
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));  // sent because of the subscription
  REQUIRE(rig.receive("skeleton/toy-raw", 1));
  Item item = toy_frame_item(41);
  rig.put(item);
  item.kind = Item::Kind::kRawFrame;
  rig.put(item);
  Item sample;
  sample.kind = Item::Kind::kSample;
  sample.sample = {};
  sample.sample.header.sequence = 5;
  sample.sample.value_count = 1;
  sample.sample.value[0] = 0.25F;
  sample.sample.valid[0] = true;
  rig.put(sample);
  Item stale;
  stale.kind = Item::Kind::kEvent;
  stale.stream_event = {0, v1::Event::KIND_STALE, 77, 41, 0.5};
  rig.put(stale);
  rig.publisher->post_event(0, v1::Event::KIND_WARNING, "look here");
  rig.publisher->set_stages(0, PublisherRig::styled("other.style"));
  REQUIRE(rig.receive("event/toy", 2));
  REQUIRE(rig.receive("pose/toy-raw", 1));
  REQUIRE(rig.receive("stats", 2));

  v1::Frame frame;
  REQUIRE(frame.ParseFromString(rig.bodies["pose/toy"]));
  CHECK(frame.stream() == "toy");
  CHECK(frame.sequence() == 41);
  CHECK(frame.device_ns() == 500);
  CHECK(frame.arrival_ns() == 1000);
  CHECK(frame.rotation_xyzw_size() == 20);
  CHECK(frame.angle_rad_size() == 15);
  CHECK(frame.validity() == std::string(5, '\1'));
  CHECK(frame.published_ns() > 0);
  CHECK(frame.stage_us().empty());
  v1::Sample bend;
  REQUIRE(bend.ParseFromString(rig.bodies["sensor/toy"]));
  CHECK(bend.name(0) == "bend");
  CHECK(bend.value(0) == 0.25F);
  v1::Skeleton skeleton;
  REQUIRE(skeleton.ParseFromString(rig.bodies["skeleton/toy"]));
  CHECK(skeleton.joint_name_size() == 5);
  CHECK(skeleton.id() == frame.skeleton_id());
  CHECK(skeleton.channel_axis() == "zxyzxyzxyzxyzxy");
  v1::Event event;
  REQUIRE(event.ParseFromString(rig.bodies["event/toy"]));
  CHECK(event.stream() == "toy");
  v1::Stats stats;
  REQUIRE(stats.ParseFromString(rig.bodies["stats"]));
  REQUIRE(stats.stream_size() == 1);
  CHECK(stats.stream(0).frames() == 1);
  CHECK(stats.stream(0).samples() == 1);
  CHECK(stats.stream(0).model() == "other.style");
  CHECK(stats.stream(0).state() == "waiting");
  CHECK(stats.monotonic_to_utc_ns() > 0);
  CHECK(stats.rss_bytes() > 0);
}

TEST_CASE(
    "skipped frames are reported at once, then as a sum once a second, and every one is counted") {
  constexpr std::int64_t kStep_ns = kNanosPerSecond / 100;
  ShedTally tally;
  std::uint64_t reported = 0, lines = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {  // ten seconds; one frame of four is published
    tally.add(4 * i + 1, 3);
    const auto sum = tally.next_sum(static_cast<std::int64_t>(i) * kStep_ns);
    if (!sum) continue;
    CHECK(sum->first == reported / 3 * 4 + 1);
    CHECK(sum->last == 4 * i + 3);
    reported += sum->frames;
    ++lines;
  }
  CHECK(lines == 10);
  const auto rest = tally.next_sum(999 * kStep_ns, true);
  REQUIRE(rest);
  CHECK(reported + rest->frames == 3000);
  CHECK_FALSE(tally.next_sum(2000 * kStep_ns, true));
}

TEST_CASE("a flood of skipped frames is one event, and its sum when the stream ends") {
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));  // subscribed
  Item item;
  item.kind = Item::Kind::kEvent;
  for (std::uint64_t i = 0; i < 50; ++i) {
    item.stream_event = {0, v1::Event::KIND_SHED, 77, 10 * i + 1, 9.0};
    rig.put(item);
  }
  item.stream_event = {0, v1::Event::KIND_ENDED, 78, 500, 0.0};
  rig.put(item);
  std::vector<std::string> texts;
  for (std::string last; !last.contains("has ended"); texts.push_back(last)) {
    REQUIRE(rig.receive("event/toy", static_cast<int>(texts.size()) + 1));
    v1::Event event;
    REQUIRE(event.ParseFromString(rig.bodies["event/toy"]));
    last = event.text();
  }
  CHECK(texts[0] == "9 frames, 1 to 9, were skipped: newer ones waited");
  CHECK(texts[texts.size() - 2].contains("to 499, were skipped"));
  std::uint64_t reported = 0;
  for (const std::string& text : texts) {
    if (text.contains("skipped")) reported += std::stoull(text);
  }
  CHECK(reported == 450);
  CHECK(texts.size() < 50);  // three, unless the machine was very slow
}

// The stream of a glove that may be unplugged.
struct Right {
  pipeline::StreamCounters counters;
  pipeline::SourceCounters source;
  PublishedStream published{info()};

  StreamInfo info() {
    StreamInfo info;
    info.name = "right";
    info.comes_and_goes = true;
    info.counters = &counters;
    info.source_counters = &source;
    return info;
  }
};

TEST_CASE("a glove counts as unplugged only after the reader has started") {
  Right glove;
  PublishedStream& published = glove.published;
  CHECK_FALSE(published.stats().away());
  glove.source.link_ns = 7;
  CHECK(published.stats().away());
  CHECK(published.report(1.0).link_ns() == 7);
  glove.source.connected = true;
  CHECK_FALSE(published.stats().away());
}

TEST_CASE("of a hand that is away no gesture is recognised") {
  Right glove;
  auto& [counters, source, published] = glove;
  source.connected = true;
  source.link_ns = 7;
  counters.pipeline.state = pipeline::StreamState::kLive;
  Frame frame;
  frame.label = {'g'};
  frame.label_probability = 1.0F;
  published.count(frame, {});
  CHECK(published.stats().label() == "g");
  CHECK(published.stats().label_probability() == 1.0F);
  source.connected = false;
  CHECK(published.stats().label().empty());
  CHECK(published.stats().label_probability() == 0.0F);
  source.connected = true;
  counters.pipeline.state = pipeline::StreamState::kStale;
  CHECK(published.stats().label().empty());
  frame.source = Source::kLabels;
  published.count(frame, {});
  CHECK(published.stats().label() == "g");
}

TEST_CASE("a stream is lossy for ten seconds after its last loss") {
  pipeline::StreamCounters counters;
  pipeline::SourceCounters source;
  StreamInfo info;
  info.name = "walker";
  info.counters = &counters;
  info.source_counters = &source;
  PublishedStream published(std::move(info));
  CHECK_FALSE(published.report(1.0).lossy());
  for (auto* const loss : {&counters.pipeline.shed, &counters.pipeline.dropped}) {
    *loss = 1;
    for (int second = 0; second < 10; ++second) CHECK(published.report(1.0).lossy());
    CHECK(published.report(1.0).shed() == 1);
    CHECK_FALSE(published.stats().lossy());
  }
  source.kernel_dropped = 7;
  CHECK(published.report(1.0).lossy());
  CHECK(published.stats().lossy());
}

TEST_CASE("the status is current, although stats are published once a second") {
  PublisherRig rig;
  REQUIRE(rig.receive("stats", 1));
  rig.counters.pipeline.parameter[0].target = 0.5;
  rig.counters.pipeline.state = pipeline::StreamState::kLive;
  rig.publisher->set_stages(0, PublisherRig::styled("other.style"));
  v1::Stats stats = rig.publisher->stats();
  REQUIRE(stats.stream_size() == 1);
  CHECK(stats.stream(0).alpha_target() == 0.5F);
  CHECK(stats.stream(0).state() == "live");
  CHECK(stats.stream(0).model() == "other.style");
  REQUIRE(stats.stream(0).stage_size() == 1);
  const v1::StageStats& stage = stats.stream(0).stage(0);
  CHECK(stage.model() == "other.style");
  REQUIRE(stage.word_size() == 1);
  CHECK(stage.word(0) == "sway");
  std::map<std::string, std::string> texts;
  for (const v1::ParameterStats& parameter : stage.parameter()) {
    texts[parameter.name()] = parameter.text();
  }
  CHECK(texts.at("weights") == "sway=1");
  CHECK(texts.at("mask").empty());
  CHECK(stats.stream(0).outcome_size() == kOutcomes);
  Item item = toy_frame_item(41);
  item.frame.source = Source::kLabels;
  item.frame.label = {'g'};
  rig.put(item);
  REQUIRE(rig.receive("pose/toy", 1));
  const std::int64_t until_ns = system::monotonic_ns() + 10 * kNanosPerSecond;
  while (rig.publisher->stats().stream(0).frames() == 0 && system::monotonic_ns() < until_ns) {
  }
  stats = rig.publisher->stats();
  CHECK(stats.stream(0).frames() == 1);
  CHECK(stats.stream(0).label() == "g");
  CHECK(stats.stream(0).source() == v1::SOURCE_LABELS);
  CHECK(stats.stream(0).outcome_size() == kOutcomes);
}

TEST_CASE("a busy port gives one sentence that names it") {
  PublisherRig rig;
  pipeline::Ring<Item> ring(64);
  const net::Context other = net::open_context().value();  // the context of another daemon
  PublisherOptions options;
  options.context = other.get();
  options.endpoint = rig.publisher->endpoint();
  options.clock = system::monotonic_ns;
  const auto second = Publisher::open(std::move(options), ring, *rig.wake);
  REQUIRE_FALSE(second);
  CHECK(second.error().message.find(rig.publisher->endpoint()) != std::string::npos);
}

}  // namespace posed::publish
