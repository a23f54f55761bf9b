// Streams that come and go while the publisher runs.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include <catch2/catch.hpp>

#include "tests/unit/daemon/publish/publisher_rig.hpp"

namespace posed::publish {
namespace {

using pipeline::Item;
using pipeline::stream_id;

constexpr std::uint32_t kSlot = 2;
constexpr std::uint32_t kAnn = stream_id(kSlot, 1);
constexpr std::uint32_t kAnnAgain = stream_id(kSlot, 2);

// The counters of one body's slot.
struct Body {
  pipeline::StreamCounters counters;

  StreamInfo info(PublisherRig& rig, std::uint32_t stream) {
    StreamInfo made = rig.toy_info("optitrack-ann", stream);
    made.counters = &counters;
    made.source = "optitrack";
    made.body = "Ann";
    return made;
  }
};

Item event_item(std::uint32_t stream, v1::Event::Kind kind, std::uint64_t sequence,
                double value = 0.0) {
  Item item;
  item.kind = Item::Kind::kEvent;
  item.stream_event = {stream, static_cast<std::uint8_t>(kind), 77, sequence, value};
  return item;
}

// Where a topic came first and last; -1 if it did not.
long first_of(const PublisherRig& rig, const std::string& topic) {
  const auto found = std::ranges::find(rig.topics, topic);
  return found == rig.topics.end() ? -1 : found - rig.topics.begin();
}
long last_of(const PublisherRig& rig, const std::string& topic) {
  const auto found = std::find(rig.topics.rbegin(), rig.topics.rend(), topic);
  return rig.topics.rend() - found - 1;
}

}  // namespace

TEST_CASE("a body's stream comes with its skeleton, is listed, and leaves") {
  Body ann;
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));  // subscribed
  rig.publisher->add(ann.info(rig, kAnn));
  rig.put(toy_frame_item(1, kAnn));
  REQUIRE(rig.receive("pose/optitrack-ann", 1));
  CHECK(first_of(rig, "skeleton/optitrack-ann") >= 0);
  CHECK(first_of(rig, "skeleton/optitrack-ann") < first_of(rig, "pose/optitrack-ann"));
  const auto came = rig.last<v1::Event>("event/optitrack-ann");
  CHECK(came.kind() == v1::Event::KIND_FOUND);
  CHECK(came.text() == "body 'Ann' of source optitrack has come");
  const v1::Stats stats = rig.publisher->stats();
  REQUIRE(stats.stream_size() == 2);
  CHECK(stats.stream(0).source_name().empty());
  CHECK(stats.stream(1).stream() == "optitrack-ann");
  CHECK(stats.stream(1).source_name() == "optitrack");
  CHECK(stats.stream(1).body() == "Ann");
  CHECK(stats.stream(1).state() == "waiting");

  rig.put(event_item(kAnn, v1::Event::KIND_ENDED, 1));
  rig.publisher->remove(kAnn);
  CHECK(ann.counters.publisher.taken == 2);
  CHECK(rig.publisher->stats().stream_size() == 1);
  REQUIRE(rig.receive("event/optitrack-ann", 2));
  CHECK(rig.last<v1::Event>("event/optitrack-ann").text() ==
        "body 'Ann' of source optitrack has left after frame 1");
  rig.put(toy_frame_item(2, kAnn));  // belongs to nobody
  rig.publisher->remove(kAnn);
  rig.publisher->post_event(kAnn, v1::Event::KIND_WARNING, "too late");
  rig.publisher->set_stages(kAnn, PublisherRig::styled("too late"));
  REQUIRE(rig.receive("stats", rig.seen["stats"] + 2));
  CHECK(rig.last<v1::Stats>("stats").stream_size() == 1);
  CHECK(rig.seen["pose/optitrack-ann"] == 1);
  CHECK(rig.seen["event/optitrack-ann"] == 2);
  CHECK(ann.counters.publisher.taken == 2);
}

TEST_CASE("the next generation takes its slot at its first item, with its skeleton before it") {
  Body ann;
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));
  rig.publisher->add(ann.info(rig, kAnn));
  rig.put(toy_frame_item(1, kAnn));
  REQUIRE(rig.receive("pose/optitrack-ann", 1));

  StreamInfo next = ann.info(rig, kAnnAgain);
  Skeleton taller = test::toy_skeleton();
  taller.joints[1].offset_m.y() += 0.1;
  next.skeleton = std::make_shared<const Skeleton>(taller);
  next.stages = PublisherRig::styled("next.style");
  rig.publisher->add(std::move(next));
  REQUIRE(rig.receive("stats", rig.seen["stats"] + 1));
  REQUIRE(rig.publisher->stats().stream_size() == 2);
  CHECK(rig.publisher->stats().stream(1).model().empty());  // it still waits
  const auto before = rig.last<v1::Skeleton>("skeleton/optitrack-ann");
  rig.topics.clear();
  rig.put(event_item(kAnn, v1::Event::KIND_SHED, 2, 1.0));  // reported at once
  rig.put(event_item(kAnn, v1::Event::KIND_SHED, 4, 3.0));  // would wait for a second
  rig.put(toy_frame_item(7, kAnnAgain));
  REQUIRE(rig.receive("pose/optitrack-ann", 2));
  const auto after = rig.last<v1::Skeleton>("skeleton/optitrack-ann");
  CHECK(after.offset_m(4) != before.offset_m(4));
  CHECK(last_of(rig, "skeleton/optitrack-ann") < last_of(rig, "pose/optitrack-ann"));
  CHECK(last_of(rig, "skeleton/optitrack-ann") >= 0);
  // The first came, one frame was skipped, three were, the next came.
  CHECK(rig.seen["event/optitrack-ann"] == 4);
  rig.publisher->remove(kAnn);
  REQUIRE(rig.publisher->stats().stream_size() == 2);
  CHECK(rig.publisher->stats().stream(1).model() == "next.style");
  rig.put(toy_frame_item(8, kAnnAgain));
  REQUIRE(rig.receive("pose/optitrack-ann", 3));
}

TEST_CASE("the next generation takes its slot when the earlier one is removed") {
  Body ann;
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));
  rig.publisher->add(ann.info(rig, kAnn));
  rig.publisher->add(ann.info(rig, kAnnAgain));
  rig.publisher->set_stages(kAnnAgain, PublisherRig::styled("second.style"));
  REQUIRE(rig.receive("event/optitrack-ann", 1));
  REQUIRE(rig.receive("skeleton/optitrack-ann", 1));
  CHECK(rig.publisher->stats().stream(1).model().empty());
  rig.publisher->remove(kAnn);
  CHECK(rig.publisher->stats().stream(1).model() == "second.style");
  REQUIRE(rig.receive("event/optitrack-ann", 2));
  rig.publisher->remove(kAnnAgain);
  CHECK(rig.publisher->stats().stream_size() == 1);
}

TEST_CASE("a body that a stage cannot serve is listed with the reason, and nothing else") {
  Body ann;
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));
  StreamInfo info = ann.info(rig, kAnn);
  info.refusal = "the style model lacks the joint Hips; leave the body out";
  rig.publisher->add(std::move(info));
  REQUIRE(rig.receive("event/optitrack-ann", 1));
  const auto warning = rig.last<v1::Event>("event/optitrack-ann");
  CHECK(warning.kind() == v1::Event::KIND_WARNING);
  CHECK(warning.text() == "the style model lacks the joint Hips; leave the body out");
  REQUIRE(rig.receive("stats", rig.seen["stats"] + 2));
  const auto stats = rig.last<v1::Stats>("stats");
  REQUIRE(stats.stream_size() == 2);
  CHECK(stats.stream(1).state() == "refused");
  CHECK(stats.stream(1).refusal() == warning.text());
  CHECK(rig.seen["skeleton/optitrack-ann"] == 0);
  CHECK(rig.seen["event/optitrack-ann"] == 1);
  rig.publisher->remove(kAnn);
  CHECK(rig.publisher->stats().stream_size() == 1);
}

TEST_CASE("a stream is removed after its items in the ring, and its counters are then free") {
  PublisherRig rig;
  for (std::uint32_t generation = 1; generation <= 50; ++generation) {
    const auto ann = std::make_unique<Body>();
    const std::uint32_t id = stream_id(kSlot, generation);
    rig.publisher->add(ann->info(rig, id));
    for (std::uint64_t i = 1; i <= 20; ++i) rig.put(toy_frame_item(i, id));
    rig.publisher->remove(id);
    CHECK(ann->counters.publisher.taken == 20);
  }
  CHECK(rig.publisher->stats().stream_size() == 1);
}

TEST_CASE("what was published of streams that have left still counts") {
  Body ann;
  PublisherRig rig;
  REQUIRE(rig.receive("skeleton/toy", 1));
  rig.publisher->add(ann.info(rig, kAnn));
  rig.put(toy_frame_item(1, kAnn));
  rig.put(toy_frame_item(2, kAnn));
  Item sample;
  sample.kind = Item::Kind::kSample;
  sample.sample.header.stream = kAnn;
  sample.sample.value_count = 1;
  rig.put(sample);
  REQUIRE(rig.receive("sensor/optitrack-ann", 1));
  CHECK(rig.publisher->stats().left_frames() == 0);
  rig.publisher->add(ann.info(rig, kAnnAgain));
  rig.put(toy_frame_item(3, kAnnAgain));  // takes the slot
  REQUIRE(rig.receive("pose/optitrack-ann", 3));
  CHECK(rig.publisher->stats().left_frames() == 2);
  rig.publisher->remove(kAnn);
  CHECK(rig.publisher->stats().left_frames() == 2);
  rig.publisher->remove(kAnnAgain);
  CHECK(rig.publisher->stats().left_frames() == 3);
  CHECK(rig.publisher->stats().left_samples() == 1);
  REQUIRE(rig.receive("stats", rig.seen["stats"] + 2));
  CHECK(rig.last<v1::Stats>("stats").left_frames() == 3);
}

TEST_CASE("without a publisher's thread the caller removes the stream itself") {
  Body ann;
  PublisherRig rig(false);
  rig.publisher->add(ann.info(rig, kAnn));
  rig.put(toy_frame_item(1, kAnn));
  rig.publisher->remove(kAnn);
  CHECK(ann.counters.publisher.taken == 1);
  (void)rig.publisher->turn(system::monotonic_ns());
  CHECK(rig.publisher->stats().stream_size() == 1);
  rig.publisher->add(ann.info(rig, kAnnAgain));
  (void)rig.publisher->turn(system::monotonic_ns());
  CHECK(rig.publisher->stats().stream_size() == 2);
  rig.thread = std::thread([&] { rig.publisher->run(); });
  rig.stop();
  rig.publisher->remove(kAnnAgain);  // its thread has ended
  CHECK(rig.publisher->stats().stream_size() == 1);
}

TEST_CASE("streams come and go while others ask for the status") {
  PublisherRig rig;
  std::atomic<bool> done{false};
  std::thread asker([&] {
    while (!done) {
      const v1::Stats stats = rig.publisher->stats();
      if (stats.stream_size() < 1 || stats.stream(0).stream() != "toy") std::abort();
      rig.publisher->set_stages(kAnn, PublisherRig::styled("x.style"));
      rig.publisher->post_event(kAnn, v1::Event::KIND_WARNING, "x");
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  });
  std::thread stopper;
  for (int i = 0; i < 200; ++i) {
    if (i == 150) stopper = std::thread([&] { rig.publisher->stop(); });
    const auto ann = std::make_unique<Body>();
    rig.publisher->add(ann->info(rig, kAnn));
    (void)rig.ring.push(toy_frame_item(1, kAnn));
    rig.wake->notify();
    rig.publisher->remove(kAnn);
  }
  done = true;
  asker.join();
  stopper.join();
  CHECK(rig.publisher->stats().stream_size() == 1);
}

}  // namespace posed::publish
