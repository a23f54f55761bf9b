#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "daemon/system/event_fd.hpp"
#include "daemon/system/process.hpp"
#include "daemon/tools/relay/relay.hpp"
#include "proto/frame/time.hpp"

namespace posed::relay {
namespace {

constexpr std::int64_t kNow_ns = 100 * kNanosPerSecond;

struct SentSkeletons {
  std::vector<std::string> topics;
  std::int64_t due_ns = 0;
};

SentSkeletons send_due(RelayedStreams& streams, std::int64_t now_ns) {
  SentSkeletons sent;
  sent.due_ns = streams.send_due(
      now_ns, [&](std::string_view topic, std::string_view) { sent.topics.emplace_back(topic); });
  return sent;
}

TEST_CASE("a topic's stream is what follows its kind") {
  CHECK(stream_of_topic("pose/walker-raw") == "walker-raw");
  CHECK(stream_of_topic("stats").empty());
  CHECK(stream_of_topic("pose/").empty());
}

TEST_CASE("who subscribes later gets the skeletons that match, but not more than 20 a second") {
  RelayedStreams streams;
  for (const char* name : {"ann", "bob"}) {
    REQUIRE(streams.admit(name, 0, kNow_ns));
    streams.keep_skeleton(name, std::string("bones of ") + name, kNow_ns);
  }
  CHECK(send_due(streams, kNow_ns + kNanosPerSecond).topics.empty());
  CHECK(send_due(streams, kNow_ns + kNanosPerSecond).due_ns == system::kForever_ns);
  const std::int64_t later_ns = kNow_ns + kNanosPerSecond;
  streams.want_skeletons("skeleton/a");
  CHECK(send_due(streams, later_ns).topics == std::vector<std::string>{"skeleton/ann"});
  streams.want_skeletons("skeleton/ann");  // the next one comes at once
  const SentSkeletons held = send_due(streams, later_ns + 1);
  CHECK(held.topics.empty());
  CHECK(held.due_ns == later_ns + kNanosPerSecond / 20);
  CHECK(send_due(streams, held.due_ns).topics.size() == 1);
  streams.want_skeletons("");
  CHECK(send_due(streams, held.due_ns + kNanosPerSecond).topics.size() == 2);
  streams.want_skeletons("pose/");
  CHECK(send_due(streams, held.due_ns + 2 * kNanosPerSecond).topics.empty());
}

TEST_CASE("a name belongs to the upstream that sends it, until that one is silent") {
  RelayedStreams streams;
  CHECK(streams.admit("ann", 0, kNow_ns));
  CHECK_FALSE(streams.admit("ann", 1, kNow_ns + kNanosPerSecond));
  CHECK(streams.admit("ann", 0, kNow_ns + kNanosPerSecond));
  CHECK(streams.admit("ann", 1, kNow_ns + 5 * kNanosPerSecond));
  CHECK_FALSE(streams.admit("ann", 0, kNow_ns + 6 * kNanosPerSecond));
}

TEST_CASE(
    "streams and the bytes of their skeletons are bounded, and those that have gone are "
    "forgotten") {
  RelayedStreams streams;
  const std::string large(kMaxSkeletonBytes / 4, 'x');
  for (std::size_t i = 0; i < kMaxStreams; ++i) {
    const std::string name = "s" + std::to_string(i);
    REQUIRE(streams.admit(name, 0, kNow_ns));
    streams.keep_skeleton(name, large, kNow_ns);
  }
  CHECK(streams.skeleton_bytes() == kMaxSkeletonBytes);
  CHECK_FALSE(streams.admit("one-more", 0, kNow_ns));
  streams.keep_skeleton("s1", "small", kNow_ns);  // it replaces the large one
  CHECK(streams.skeleton_bytes() == kMaxSkeletonBytes - large.size() + 5);
  const std::int64_t later_ns = kNow_ns + 11 * kNanosPerSecond;
  REQUIRE(streams.admit("one-more", 0, later_ns));
  CHECK(streams.streams() == 1);
  CHECK(streams.skeleton_bytes() == 0);
  streams.keep_skeleton("unknown", "x", later_ns);
  CHECK(streams.skeleton_bytes() == 0);
}

std::string toy_stats(const std::string& stream, std::int64_t time_ns) {
  v1::Stats stats;
  stats.set_time_ns(time_ns);
  stats.set_monotonic_to_utc_ns(time_ns + 1000);
  stats.add_stream()->set_stream(stream);
  stats.add_source()->set_name(stream + "-source");
  return stats.SerializeAsString();
}

TEST_CASE("stats of one upstream pass as they are, those of several as one") {
  bool valid = false;
  MergedStats one(1);
  CHECK(one.accept(0, toy_stats("ann", 5), kNow_ns, valid) == toy_stats("ann", 5));
  CHECK_FALSE(one.accept(0, "\xFF\xFF", kNow_ns, valid));
  CHECK_FALSE(valid);

  MergedStats two(2);
  CHECK(two.accept(1, toy_stats("bob", 7), kNow_ns, valid));  // the other has not answered yet
  v1::Stats merged;
  REQUIRE(merged.ParseFromString(*two.accept(0, toy_stats("ann", 5), kNow_ns + 1, valid)));
  CHECK(merged.time_ns() == 5);
  REQUIRE(merged.stream().size() == 2);
  CHECK(merged.stream(0).stream() == "ann");
  CHECK(merged.stream(1).stream() == "bob");
  CHECK(merged.stream(0).monotonic_to_utc_ns() == 1005);  // each on its own machine's clock
  CHECK(merged.stream(1).monotonic_to_utc_ns() == 1007);
  CHECK(merged.source().size() == 2);
  CHECK_FALSE(two.accept(1, toy_stats("bob", 8), kNow_ns + 2, valid));  // the first gives the beat
  const auto alone = two.accept(1, toy_stats("bob", 9), kNow_ns + 4 * kNanosPerSecond, valid);
  REQUIRE(alone);
  REQUIRE(merged.ParseFromString(*alone));
  CHECK(merged.stream().size() == 1);
}

TEST_CASE("relays in a circle do not make the stats grow") {
  bool valid = false;
  MergedStats relay(2);  // of a daemon, and of the relay that it is itself an upstream of
  std::string all = toy_stats("bob", 1);
  for (int second = 0; second < 20; ++second) {
    const std::int64_t now_ns = kNow_ns + second * kNanosPerSecond;
    static_cast<void>(relay.accept(1, all, now_ns, valid));
    const auto merged = relay.accept(0, toy_stats("ann", 5), now_ns, valid);
    REQUIRE(merged);
    all = *merged;
  }
  v1::Stats merged;
  REQUIRE(merged.ParseFromString(all));
  CHECK(merged.stream().size() == 2);
  CHECK(merged.source().size() == 2);
}

TEST_CASE("stats of half a million empty parts are refused before memory is spent on them") {
  std::string bomb;
  while (bomb.size() < 1'000'000) bomb += std::string("\x1a\x00", 2);  // an empty StreamStats
  MergedStats relay(3);
  const auto before = system::resident_bytes();
  bool valid = true;
  for (std::size_t upstream = 0; upstream < 3; ++upstream) {
    CHECK_FALSE(relay.accept(upstream, bomb, kNow_ns, valid));
    CHECK_FALSE(valid);
  }
  CHECK(system::resident_bytes() < before + 32'000'000);
}

}  // namespace
}  // namespace posed::relay
