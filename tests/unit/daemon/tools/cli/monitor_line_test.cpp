#include "daemon/tools/live/monitor_line.hpp"

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"
#include "tests/support/has.hpp"

namespace posed::tools {
namespace {

using test::has;

TEST_CASE("every kind of event has a line with its name, also one from a newer posed") {
  v1::Event event;
  event.set_stream("right");
  event.set_sequence(61);
  event.set_text("the \x1b[2Jlink is gone");
  for (int kind = v1::Event::Kind_MIN; kind <= v1::Event::Kind_MAX + 3; ++kind) {
    event.set_kind(static_cast<v1::Event::Kind>(kind));
    const std::string line = monitor_line(event);
    CHECK(line.starts_with("right                  61 "));
    CHECK(has(line, "link is gone"));
    CHECK(line.find('\x1b') == std::string::npos);
  }
  event.set_kind(v1::Event::KIND_LOST);
  CHECK(has(monitor_line(event), "61 lost      the"));
  event.set_kind(v1::Event::KIND_RECORDING_GAP);
  CHECK(has(monitor_line(event), "61 recording_gap the"));
  event.set_kind(static_cast<v1::Event::Kind>(99));
  CHECK(has(monitor_line(event), "61 unknown   the"));
}

TEST_CASE("a performed pose is distinguished from a recognised one") {
  v1::Frame frame;
  frame.set_stream("hand");
  frame.set_label("g");
  frame.set_label_probability(1.0F);
  frame.set_source(v1::SOURCE_DEVICE);
  CHECK(has(monitor_line(frame), "measured"));
  CHECK(has(monitor_line(frame), "recognised g 100 %"));
  frame.set_source(v1::SOURCE_LABELS);
  CHECK(has(monitor_line(frame), "performed"));
  CHECK_FALSE(has(monitor_line(frame), "measured"));
  CHECK(has(monitor_line(frame), "plays g"));
  CHECK_FALSE(has(monitor_line(frame), "%"));
  frame.set_quality(v1::QUALITY_HELD);
  CHECK(has(monitor_line(frame), "held"));
}

TEST_CASE("a latency has a readable unit, and a dash if it is unknown") {
  v1::Frame frame;
  frame.set_arrival_ns(1'000'000'000);
  frame.set_published_ns(frame.arrival_ns() + 57'000);
  CHECK(has(monitor_line(frame), "    57 us"));
  frame.set_published_ns(frame.arrival_ns() + 33'160'000);
  CHECK(has(monitor_line(frame), "    33 ms"));
  frame.set_published_ns(frame.arrival_ns() + 33'160'663'000);
  CHECK(has(monitor_line(frame), "  33.2 s"));
  frame.clear_published_ns();
  CHECK(has(monitor_line(frame), "         -"));
}

TEST_CASE("values of a sample have units, and a replay is marked as one") {
  v1::Sample sample;
  sample.add_name("index");
  sample.add_value(0.5F);
  sample.add_unit("rad");
  sample.add_name("button");
  sample.add_value(1.0F);
  CHECK(has(monitor_line(sample), " index=0.500 rad button=1.000"));
  v1::Stats stats;
  CHECK_FALSE(has(monitor_line(stats), "replay"));
  stats.set_replay_file("take1.plog");
  stats.set_replay_speed(0.5);
  CHECK(has(monitor_line(stats), "a replay of take1.plog, 0.5 x its pace; all times are"));
  stats.set_replay_speed(0.0);
  CHECK(has(monitor_line(stats), "a replay of take1.plog, as fast as possible"));
}

}  // namespace
}  // namespace posed::tools
