#include "daemon/tools/live/live_view.hpp"

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"

namespace posed::tools {
namespace {

v1::StreamStats& add_row(v1::Stats& stats, const std::string& name) {
  v1::StreamStats& stream = *stats.add_stream();
  stream.set_stream(name);
  stream.set_state("live");
  stream.set_rate_hz(120.0F);
  return stream;
}

void with_alpha(v1::StreamStats& stream, float alpha) {
  stream.add_stage()->add_parameter()->set_name("alpha");
  stream.set_alpha(alpha);
}

TEST_CASE("the table of streams has only columns that a stream needs", "[live_table]") {
  v1::Stats stats;
  v1::StreamStats& walker = add_row(stats, "walker");
  add_row(stats, "hand");
  using Lines = std::vector<std::string>;
  CHECK(live_table(stats, {.width = 0}) == Lines{"STREAM STATE       HZ",  //
                                                 "walker live     120.0",  //
                                                 "hand   live     120.0"});
  with_alpha(walker, -0.5F);
  walker.set_model("march-to-sway.style");
  walker.mutable_publish()->set_p50_us(231.4F);
  walker.mutable_publish()->set_p99_us(33'160'663.0F);
  CHECK(live_table(stats, {.width = 0}) ==
        Lines{"STREAM STATE       HZ  LATENCY     99 % ALPHA MODEL",
              "walker live     120.0   0.2 ms     33 s -0.50 march-to-sway.style",
              "hand   live     120.0        -        -     -"});
}

TEST_CASE("the table of streams fits 60 columns, and gives a wide terminal the names",
          "[live_table]") {
  v1::Stats stats;
  v1::StreamStats& walker = add_row(stats, "a-performer-with-a-long-name");
  with_alpha(walker, 1.0F);
  walker.set_model("march-to-sway.style");
  walker.mutable_publish()->set_p99_us(1e18F);
  walker.set_rate_hz(1e9F);
  const auto narrow = live_table(stats, {.width = 60, .chosen = walker.stream()});
  CHECK(narrow[1] == "> a-performe~ live    9999.9   0.0 ms 9999.9 h  1.00 march-~");
  CHECK(narrow[1].size() == 60);
  CHECK(live_table(stats, {.width = 100})[1].contains("a-performer-with-a-long-name live"));
  CHECK(live_table(stats, {.width = 100})[1].contains(" march-to-sway.style"));
  CHECK(live_table(stats, {.width = 28})[0] == "STREAM      STATE       HZ");
}

TEST_CASE("the health of a stream has a word and a colour", "[live_table]") {
  const auto row = [](const v1::StreamStats& stream, bool silent = false) {
    v1::Stats stats;
    *stats.add_stream() = stream;
    return live_table(stats, {.width = 0, .colour = true, .silent = silent})[1];
  };
  v1::Stats stats;
  v1::StreamStats& stream = add_row(stats, "walker");
  CHECK(row(stream).contains("\x1b[32mlive"));
  CHECK(row(stream, true).contains("\x1b[2m?"));
  CHECK_FALSE(row(stream, true).contains("120.0"));
  stream.set_shed(1);
  CHECK(row(stream).contains("\x1b[32mlive"));
  stream.set_lossy(true);
  CHECK(row(stream).contains("\x1b[31mlossy"));
  for (const char* state : {"waiting", "stale"}) {
    stream.set_state(state);
    CHECK(row(stream).contains(std::string("\x1b[33m") + state));
  }
  stream.set_away(true);
  CHECK(row(stream).contains("\x1b[33maway"));
  stream.set_away(false);
  stream.set_state("ended");
  CHECK(row(stream).contains("\x1b[2mended"));
  stream.set_state("refused");
  stream.set_refusal("no hips");
  CHECK(row(stream).contains("\x1b[31mrefused"));
}

TEST_CASE("streams that do not fit are counted, the chosen one is visible", "[live_table]") {
  v1::Stats stats;
  for (int i = 0; i < 32; ++i) add_row(stats, "walker" + std::to_string(i));
  const auto lines = live_table(stats, {.rows = 8});
  REQUIRE(lines.size() == 8);
  CHECK(lines[6].starts_with("walker5 "));
  CHECK(lines[7] == "... and 26 more");
  const auto moved = live_table(stats, {.rows = 8, .chosen = "walker20"});
  REQUIRE(moved.size() == 8);
  CHECK(moved[1].starts_with("  walker15 "));
  CHECK(moved[6].starts_with("> walker20 "));
  CHECK(live_table(stats, {.rows = 1}).size() == 2);
}

TEST_CASE("durations are in milliseconds with one decimal", "[live_table]") {
  CHECK(display_duration(0.0) == "0.0 ms");
  CHECK(display_duration(231.4e-6) == "0.2 ms");
  CHECK(display_duration(0.99994) == "999.9 ms");
  CHECK(display_duration(0.99996) == "1.0 s");
  CHECK(display_duration(12.4) == "12 s");
  CHECK(display_duration(300.0) == "5 min");
  CHECK(display_duration(9000.0) == "2.5 h");
  CHECK(display_duration(1e18) == "9999.9 h");
}

}  // namespace
}  // namespace posed::tools
