#include <catch2/catch.hpp>

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "daemon/system/event_fd.hpp"
#include "daemon/system/process.hpp"
#include "daemon/tools/relay/relay.hpp"
#include "proto/frame/time.hpp"
#include "proto/message/bounded_parse.hpp"

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
  RelayedStreams streams(1);
  for (const char* name : {"ann", "bob"}) {
    REQUIRE(streams.admit(name, 0, true, kNow_ns) == Admission::kPasses);
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
  RelayedStreams streams(2);
  CHECK(streams.admit("ann", 0, true, kNow_ns) == Admission::kPasses);
  const std::int64_t soon_ns = kNow_ns + kNanosPerSecond;
  CHECK(streams.admit("ann", 1, true, soon_ns) == Admission::kOthersName);
  CHECK(streams.admit("ann", 0, false, soon_ns) == Admission::kPasses);
  const std::int64_t later_ns = kNow_ns + 5 * kNanosPerSecond;
  CHECK(streams.admit("ann", 1, true, later_ns) == Admission::kPasses);
  CHECK(streams.admit("ann", 0, true, later_ns + kNanosPerSecond) == Admission::kOthersName);
}

TEST_CASE("who sends poses takes the name of one who sends none") {
  RelayedStreams streams(2);
  CHECK(streams.admit("ann", 0, false, kNow_ns) == Admission::kPasses);
  CHECK(streams.admit("ann", 1, false, kNow_ns + 1) == Admission::kOthersName);
  CHECK(streams.admit("ann", 1, true, kNow_ns + 2) == Admission::kPasses);
  CHECK(streams.admit("ann", 0, true, kNow_ns + 3) == Admission::kOthersName);
  CHECK(streams.streams() == 1);
}

TEST_CASE("the names and skeletons of one upstream leave the other's room alone") {
  RelayedStreams streams(2);
  const std::string large(kMaxSkeletonBytes / 16, 'x');
  for (std::size_t i = 0; i < kMaxStreams + 100; ++i) {
    const std::string name = "n" + std::to_string(i);
    const Admission expected = i < kMaxStreams ? Admission::kPasses : Admission::kTooMany;
    REQUIRE(streams.admit(name, 0, true, kNow_ns) == expected);
    streams.keep_skeleton(name, large, kNow_ns);
  }
  CHECK(streams.skeleton_bytes(0) == kMaxSkeletonBytes / 2);
  for (const char* name : {"ann", "bob"}) {
    CHECK(streams.admit(name, 1, true, kNow_ns) == Admission::kPasses);
    streams.keep_skeleton(name, large, kNow_ns);
  }
  CHECK(streams.skeleton_bytes(1) == 2 * large.size());
}

TEST_CASE("upstreams share what a page can show, and many hostile ones leave one its streams") {
  constexpr std::size_t kHostile = 15, kOwn = 120;
  RelayedStreams streams(kHostile + 1);
  for (std::size_t i = 0; i < kMaxStreams; ++i) {
    for (std::size_t upstream = 0; upstream < kHostile; ++upstream) {
      static_cast<void>(streams.admit(std::to_string(upstream) + "/" + std::to_string(i), upstream,
                                      true, kNow_ns));
    }
  }
  CHECK(streams.streams() == link::kMaxLinkStreams);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < kOwn; ++i) {
      CHECK(streams.admit("ann" + std::to_string(i), kHostile, true, kNow_ns) ==
            Admission::kPasses);
      static_cast<void>(streams.admit("x" + std::to_string(i), 0, true, kNow_ns));
    }
  }
  CHECK(streams.streams() == link::kMaxLinkStreams);
}

TEST_CASE("in one upstream, too, streams with poses come before names, and ended ones go") {
  RelayedStreams streams(1);
  std::int64_t now_ns = kNow_ns;
  const auto names = [&](std::size_t first) {
    for (std::size_t i = first; i < first + 1100; ++i) {
      static_cast<void>(streams.admit("n" + std::to_string(i), 0, false, now_ns));
    }
  };
  names(0);
  CHECK(streams.streams() == kMaxStreams);
  CHECK(streams.admit("glove", 0, false, now_ns) == Admission::kTooMany);
  CHECK(streams.admit("ann", 0, true, now_ns) == Admission::kPasses);
  CHECK(streams.streams() == kMaxStreams);
  for (int i = 0; i < 20; ++i) {
    now_ns += kNanosPerSecond;
    names(0);
    CHECK(streams.admit("ann", 0, true, now_ns) == Admission::kPasses);
  }
  // The names end, others come: half of the places are free after 3 s, and all after 10 s.
  now_ns += 4 * kNanosPerSecond;
  CHECK(streams.admit("glove", 0, false, now_ns) == Admission::kPasses);
  CHECK(streams.streams() <= kMaxStreams / 2 + 1);
  now_ns += 7 * kNanosPerSecond;
  CHECK(streams.admit("glove", 0, false, now_ns) == Admission::kPasses);
  CHECK(streams.streams() == 1);
}

TEST_CASE(
    "streams and the bytes of their skeletons are bounded, and those that have gone are "
    "forgotten") {
  RelayedStreams streams(1);
  const std::string large(kMaxSkeletonBytes / 4, 'x');
  for (std::size_t i = 0; i < kMaxStreams; ++i) {
    const std::string name = "s" + std::to_string(i);
    REQUIRE(streams.admit(name, 0, true, kNow_ns) == Admission::kPasses);
    streams.keep_skeleton(name, large, kNow_ns);
  }
  CHECK(streams.skeleton_bytes(0) == kMaxSkeletonBytes);
  CHECK(streams.admit("one-more", 0, true, kNow_ns) == Admission::kTooMany);
  streams.keep_skeleton("s1", "small", kNow_ns);  // it replaces the large one
  CHECK(streams.skeleton_bytes(0) == kMaxSkeletonBytes - large.size() + 5);
  const std::int64_t later_ns = kNow_ns + 11 * kNanosPerSecond;
  REQUIRE(streams.admit("one-more", 0, true, later_ns) == Admission::kPasses);
  CHECK(streams.streams() == 1);
  CHECK(streams.skeleton_bytes(0) == 0);
  streams.keep_skeleton("unknown", "x", later_ns);
  CHECK(streams.skeleton_bytes(0) == 0);
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

// The merged stats of an upstream of these, and of the honest "ann" at `honest`.
v1::Stats beside_ann(MergedStats& relay, const v1::Stats& hostile, std::size_t honest) {
  bool valid = false;
  static_cast<void>(relay.accept(1 - honest, hostile.SerializeAsString(), kNow_ns, valid));
  REQUIRE(valid);
  auto bytes = relay.accept(honest, toy_stats("ann", 5), kNow_ns, valid);
  if (honest == 1) bytes = relay.accept(0, hostile.SerializeAsString(), kNow_ns, valid);
  REQUIRE(bytes);
  CHECK(bytes->size() <= static_cast<std::size_t>(net::kMaxReceivedPart));
  v1::Stats merged;  // as a client does
  REQUIRE(message::parse_bounded(merged, std::as_bytes(std::span(*bytes))));
  CHECK(std::ranges::count(merged.stream(), "ann", &v1::StreamStats::stream) == 1);
  CHECK(std::ranges::count(merged.source(), "ann-source", &v1::SourceStats::name) == 1);
  return merged;
}

TEST_CASE("no upstream makes the merged stats more than a client takes, or hides another's") {
  const std::size_t honest = GENERATE(0, 1);
  v1::Stats bytes;
  bytes.add_stream()->set_device_info(std::string(1'048'560, 'd'));
  v1::Stats parts;
  v1::StageStats& stage = *parts.add_stream()->add_stage();
  for (int i = 0; i < 32'764; ++i) stage.add_word("");
  v1::Stats names;
  for (int i = 0; i < 10'000; ++i) names.add_stream()->set_stream(std::to_string(i));
  v1::Stats head;
  head.set_time_ns(7);
  head.set_recorder_file(std::string(1'048'560, 'r'));
  for (const v1::Stats& hostile : {bytes, parts, names, head}) {
    MergedStats relay(2);
    const v1::Stats merged = beside_ann(relay, hostile, honest);
    CHECK(merged.time_ns() == (honest == 0 ? 5 : hostile.time_ns()));
    CHECK(relay.left_out(honest) == 0);
  }
  // What one does not need is the other's.
  MergedStats relay(2);
  v1::Stats many;
  for (int i = 0; i < 1000; ++i) {
    many.add_stream()->set_stream(std::to_string(i));
    many.mutable_stream(i)->set_device_info(std::string(900, 'd'));
  }
  CHECK(beside_ann(relay, many, honest).stream().size() == 1001);
  CHECK(relay.left_out(1 - honest) == 0);
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
