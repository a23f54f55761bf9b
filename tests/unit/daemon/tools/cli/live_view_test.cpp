#include "daemon/tools/live/live_view.hpp"

#include <algorithm>

#include <catch2/catch.hpp>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/live/monitor_line.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::tools {
namespace {

v1::Stats stats_of(int streams) {
  v1::Stats stats;
  stats.set_cpu_percent(12.34F);
  stats.set_rss_bytes(45'600'000);
  for (int i = 0; i < streams; ++i) {
    auto& stream = *stats.add_stream();
    stream.set_stream("walker" + std::to_string(i));
    stream.set_state("live");
    stream.set_rate_hz(120.0F);
    stream.set_alpha(-0.5F);
    stream.set_alpha_target(-0.5F);
    stream.set_model("march-to-sway.style");
    v1::StageStats& style = *stream.add_stage();
    style.set_name("style");
    style.add_parameter()->set_name("alpha");
    stream.mutable_publish()->set_p50_us(231.4F);
    stream.mutable_publish()->set_p99_us(1234.0F);
  }
  return stats;
}

TEST_CASE("the live view fits every terminal whatever the daemon sends") {
  v1::Stats stats = stats_of(32);
  auto& wild = *stats.mutable_stream(0);
  wild.set_stream(std::string(32, 'x'));
  wild.set_model("\x1b[2Jevil");
  wild.set_rate_hz(1e9F);
  wild.set_dropped(123'456'789'012);
  wild.set_shed(99'999);
  wild.mutable_publish()->set_p99_us(3e12F);
  LiveViewOptions options{.title = "posed tcp://127.0.0.1:5570"};
  options.notes.assign(40, "walker0 something happened");
  options.panel = [&](int rows) {
    return std::vector<std::string>(static_cast<std::size_t>(std::max(rows, 0)), "figure");
  };
  for (const int width : {200, 80, 60, 20}) {
    for (const int height : {24, 10, 3, 1}) {
      options.width = width;
      options.height = height;
      options.chosen = height == 10 ? "walker9" : "";
      const auto lines = live_view(stats, options);
      CHECK(lines.size() <= static_cast<std::size_t>(height));
      for (const std::string& line : lines) {
        INFO(line);
        CHECK(line.size() <= static_cast<std::size_t>(width));
        CHECK(line.find('\x1b') == std::string::npos);
      }
    }
  }
}

TEST_CASE("the live view names the daemon, and leaves out what does not fit") {
  v1::Stats stats = stats_of(2);
  LiveViewOptions options{.title = "posed", .width = 60};
  CHECK(live_view(stats, options)[0] == "posed   2 streams   cpu 12.3 %   45.6 MB");
  stats.set_recorder_file("a.plog");
  stats.mutable_take()->set_number(3);
  CHECK(live_view(stats, options)[0] == "posed   take 3   rec a.plog   2 streams   cpu 12.3 %");
  stats.set_recorder_lost_chunks(2);
  options.width = 0;
  CHECK(live_view(stats, options)[0].contains("rec a.plog lost 2   2 streams   cpu 12.3 %   45.6"));
  stats.set_recorder_trouble("/rec/a.plog: the disk is full");
  const auto lines = live_view(stats, options);
  CHECK(std::ranges::count(
            lines, "  nothing can be written to the log: /rec/a.plog: the disk is full") == 1);
}

TEST_CASE("the live view shows unplugged gloves, since when, and how a glove's clock runs") {
  v1::Stats stats = stats_of(4);
  stats.set_time_ns(1'000'000'000'000);
  for (auto& stream : *stats.mutable_stream()) {
    stream.set_device_info("cyberglove hand=right");
    stream.set_link_ns(stats.time_ns() - 180'000'000'000);
    stream.set_connections(1);
    stream.set_identity("0403:6001 A9XYZ");
  }
  auto& late = *stats.mutable_stream(0);
  late.set_away(true);
  late.set_connections(0);
  auto& lost = *stats.mutable_stream(1);
  lost.set_away(true);
  lost.set_state("stale");
  lost.set_connections(3);
  lost.set_link_ns(stats.time_ns() - 12'000'000'000);
  auto& back = *stats.mutable_stream(2);
  back.set_connections(4);
  back.set_clock_offset_ns(-2'500'000'000);
  back.set_clock_drift_ppm(7.26F);
  back.set_identity("/dev/\x1b[2J");
  const auto lines = live_view(stats, {.title = "posed", .width = 100, .height = 0});
  REQUIRE(lines.size() == 10);
  CHECK(lines[2].starts_with("walker0 away "));
  CHECK(lines[3].starts_with("walker1 away "));
  CHECK(lines[4].starts_with("walker2 live "));
  CHECK(lines[6] == "  walker0: not there yet; posed has looked for it for 3 min");
  CHECK(lines[7] == "  walker1: away for 12 s; connected 3 times before");
  CHECK(lines[8] ==
        "  walker2: back for 3 min, reconnected 3 times, clock drift +7.3 ppm, /dev/\\x1b[2J");
  CHECK(lines[9] == "  walker3: 0403:6001 A9XYZ");
  const auto narrow = live_view(stats, {.title = "posed", .width = 60, .height = 0});
  CHECK(narrow[8] == "  walker2: back for 3 min, reconnected 3 times, clock drift");
  CHECK(narrow[9] == "    +7.3 ppm, /dev/\\x1b[2J");
  stats.mutable_stream(2)->set_clock_drift_ppm(-0.02F);
  CHECK(live_view(stats, {.height = 0})[8].contains("drift +0.0 ppm"));
}

TEST_CASE("the live view says whose body a stream is, and why one is refused") {
  v1::Stats stats = stats_of(3);
  auto& ann = *stats.mutable_stream(1);
  ann.set_source_name("optitrack");
  ann.set_body("A\x1b[2Jnn");
  auto& bob = *stats.mutable_stream(2);
  bob.set_source_name("optitrack");
  bob.set_body("Bob");
  bob.set_state("refused");
  bob.set_refusal("walk.style needs a joint Hips; leave the body out");
  for (const char* stage : {"style", "constrain"}) bob.add_stage()->set_name(stage);  // never run
  LiveViewOptions options{.title = "posed", .width = 0, .height = 0};
  const auto lines = live_view(stats, options);
  REQUIRE(lines.size() == 7);
  CHECK(lines[4].starts_with("walker2 refused "));
  CHECK(lines[5] == "  walker1: body 'A\\x1b[2Jnn' of optitrack");
  CHECK(lines[6] ==
        "  walker2: body 'Bob' of optitrack: walk.style needs a joint Hips; leave the body out");
  options.chosen = "walker0";  // of the others only what is wrong is shown
  const auto of_chosen = live_view(stats, options);
  REQUIRE(of_chosen.size() == 6);
  CHECK(of_chosen[5] == lines[6]);
  options.colour = true;
  CHECK(live_view(stats, options)[5].starts_with("  \x1b[31m"));
  CHECK(monitor_line(stats).ends_with("shed: walk.style needs a joint Hips; leave the body out"));
}

TEST_CASE("the live view shows what the kernel dropped of a device's datagrams") {
  v1::Stats stats = stats_of(2);
  stats.mutable_stream(0)->set_kernel_dropped(7);
  stats.mutable_stream(1)->set_kernel_dropped(12);
  stats.mutable_stream(1)->set_source_name("optitrack");
  stats.mutable_stream(1)->set_body("Ann");
  v1::SourceStats& busy = *stats.add_source();
  busy.set_name("optitrack");
  busy.set_streams(1);
  busy.set_kernel_dropped(12);
  v1::SourceStats& empty = *stats.add_source();
  empty.set_name("vicon");
  empty.set_away(true);
  empty.set_kernel_dropped(3);
  const auto lines = live_view(stats, {.title = "posed", .width = 0, .height = 0});
  REQUIRE(lines.size() == 8);
  CHECK(lines[4] == "  optitrack: the kernel dropped 12 datagrams (machine too slow)");
  CHECK(lines[5] ==
        "  vicon: the device is away, the kernel dropped 3 datagrams (machine too slow)");
  CHECK(lines[6] == "  walker0: the kernel dropped 7 datagrams (machine too slow)");
  CHECK(lines[7] == "  walker1: body 'Ann' of optitrack");
}

TEST_CASE("a camera that nobody switched on is not spoken of, one that is off is no fault") {
  v1::Stats stats = stats_of(1);
  v1::SourceStats& camera = *stats.add_source();
  camera.set_name("camera");
  camera.set_driver("landmarks");
  camera.add_outcome(0);
  const LiveViewOptions options{.title = "posed", .width = 0, .height = 0};
  const auto before = live_view(stats, options);
  camera.set_outcome(0, 90);
  const auto after = live_view(stats, options);
  REQUIRE(after.size() == before.size() + 1);
  CHECK(std::ranges::find(after, "  camera: no hand: its camera is off, or sees none") !=
        after.end());
  // What was refused may have been so long ago.
  for (const int count : {3, 0, 0, 7}) camera.add_outcome(count);
  const std::string refused =
      "  camera: no hand: its camera is off, or sees none; refused of 100 messages so far: ";
  CHECK(std::ranges::any_of(live_view(stats, options),
                            [&](const auto& line) { return line.starts_with(refused); }));
}

TEST_CASE("the live view has a line for each output, with what went wrong if anything did") {
  v1::Stats stats = stats_of(1);
  v1::OutputStats& vmc = *stats.add_output();
  vmc.set_name("vmc");
  vmc.set_kind("vmc");
  vmc.set_receivers(1);
  vmc.set_frames(10);
  vmc.set_sent(30);
  v1::OutputStats& bvh = *stats.add_output();
  bvh.set_name("bvh");
  bvh.set_kind("bvh");
  bvh.set_receivers(2);
  bvh.set_dropped(3);
  bvh.set_failures(4);
  const auto lines = live_view(stats, {.title = "posed", .width = 0, .height = 0});
  REQUIRE(lines.size() == 5);
  CHECK(lines[3] == "  vmc: vmc output, 1 receiver, 10 frames, 30 sent");
  CHECK(lines[4] == "  bvh: bvh output, 2 receivers, 0 frames, 0 sent, 3 dropped, 4 failed");
}

TEST_CASE("a daemon that does not answer is not shown as live") {
  v1::Stats stats = stats_of(2);
  stats.mutable_stream(0)->set_label("g");
  LiveViewOptions options{.title = "posed tcp://a:1", .height = 0, .colour = true};
  options.silence = "no answer for 20 s: the daemon has ended, or cannot be reached";
  const auto lines = live_view(stats, options);
  CHECK(lines[0].starts_with("\x1b[31mno answer for 20 s: the daemon has ended"));
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  INFO(all);
  CHECK_FALSE(all.contains("live"));
  CHECK_FALSE(all.contains("120.0"));
  CHECK_FALSE(all.contains(" ms"));
  CHECK_FALSE(all.contains("cpu"));
  CHECK_FALSE(all.contains("recognised"));
  CHECK(all.contains("walker1"));
}

TEST_CASE("without a terminal names are not cut and lines are not padded") {
  v1::Stats stats = stats_of(2);
  const std::string name = "a-model-with-quite-a-long-name-indeed-yes.style";
  stats.mutable_stream(0)->set_model(name);
  stats.mutable_stream(1)->set_stream(std::string(32, 'w'));
  stats.mutable_stream(1)->clear_model();
  stats.mutable_stream(1)->set_label("g");
  const auto lines = live_view(stats, {.title = "posed", .width = 0, .height = 0});
  CHECK(lines[2].ends_with(" " + name));
  CHECK(lines[3].starts_with(std::string(32, 'w') + " "));
  CHECK(lines[4] == "  " + std::string(32, 'w') + ": recognised g 0 %");
  for (const std::string& line : lines) CHECK_FALSE(line.ends_with(' '));
}

TEST_CASE("the live view shows performed and recognised gestures, a moving alpha and a replay") {
  v1::Stats stats = stats_of(1);
  auto& stream = *stats.mutable_stream(0);
  stream.set_alpha_target(-0.5F);
  stream.set_label("g");
  stream.set_label_probability(0.83F);
  const auto below = [&] {
    return live_view(stats, {.title = "posed", .width = 0, .height = 0})[3];
  };
  CHECK(below() == "  walker0: recognised g 83 %");
  stream.set_source(v1::SOURCE_LABELS);
  CHECK(below() == "  walker0: plays g");
  stream.set_alpha_target(1.0F);
  CHECK(below() == "  walker0: plays g, alpha slides to 1.00");
  v1::StageStats& style = *stream.mutable_stage(0);
  v1::ParameterStats& parameter = *style.add_parameter();
  parameter.set_name("gate_fallback");
  parameter.set_value(0.0);
  CHECK_FALSE(below().contains("gate_fallback"));  // as usual
  parameter.set_value(0.25);
  CHECK_FALSE(below().contains("gate_fallback"));  // no frame has come
  stream.set_frames(1);
  CHECK(below() == "  walker0: plays g, style.gate_fallback 0.25, alpha slides to 1.00");
  v1::ParameterStats& text = *style.add_parameter();
  text.set_name("weights");
  CHECK_FALSE(below().contains("weights"));  // the first style alone
  text.set_text("sway=0.75,\x1b[2Jsad=0.25");
  CHECK(below() ==
        "  walker0: plays g, style.gate_fallback 0.25, style.weights sway=0.75,"
        "\\x1b[2Jsad=0.25, alpha slides to 1.00");
  text.clear_text();
  stream.set_style_gate(0.0F);
  stream.set_style_estimate(0.4F);
  CHECK(
      below().ends_with("gate_fallback 0.25, knows the motion to 0 %, has 40 % of the style before "
                        "it, alpha slides to 1.00"));
  stream.set_style_gate(1.0F);
  stream.set_style_estimate(-0.01F);  // within the error
  CHECK(below().ends_with("gate_fallback 0.25, alpha slides to 1.00"));
  stream.clear_style_gate();
  stream.clear_style_estimate();
  stream.set_gate_dropped(0.03F);
  stream.set_gate_joint("rightIndexIntermediate");
  CHECK(below().contains(", rightIndexIntermediate: 3.0 % dropped, alpha"));
  stream.set_gate_dropped(0.0004F);
  CHECK_FALSE(below().contains("dropped"));
  stream.set_robot_stops(2);
  stream.set_robot_hard_stops(1);
  stream.set_robot_stop_joint("thumb_far");
  stream.set_robot_stop_other("index_far");
  CHECK(
      below().contains(", robot: stops 3 (hard 1), holds 0, limited commands 0, stopped by "
                       "thumb_far and index_far"));
  stats.set_replay_file("take1.plog");
  stats.set_replay_speed(1.0);
  CHECK(below() == "  a replay of take1.plog, 1 x its pace; all times are the recording's");
}

TEST_CASE("the live view shows the time of a stage that works, and the lag in milliseconds") {
  v1::Stats stats = stats_of(1);
  auto& stream = *stats.mutable_stream(0);
  stream.mutable_stage(0)->mutable_time()->set_p99_us(490.0F);
  v1::StageStats& constrain = *stream.add_stage();
  constrain.set_name("constrain");  // processed no frame
  stream.set_lag_frames(1);
  stream.set_lag_ms(10.0F);
  CHECK(live_view(stats, {.height = 0})[3] == "  walker0: style 0.5 ms, lag 1 frame (10.0 ms)");
  constrain.mutable_time()->set_p99_us(40.0F);
  CHECK(
      live_view(stats, {.height = 0})[3].contains("style 0.5 ms, keep fingers apart 0.0 ms, lag"));
}

TEST_CASE("the live view says in words what was lost") {
  v1::Stats stats = stats_of(1);
  stats.mutable_stream(0)->set_dropped(12);
  stats.mutable_stream(0)->set_shed(3);
  LiveViewOptions options{.width = 120, .height = 0};
  CHECK(live_view(stats, options)[2].starts_with("walker0 live "));
  CHECK(live_view(stats, options)[3] ==
        "  walker0: frames: 12 dropped because a queue was full, 3 skipped for newer ones, so far "
        "(machine too slow)");
  options.colour = true;
  CHECK(live_view(stats, options)[3].starts_with("  walker0"));
  stats.mutable_stream(0)->set_lossy(true);
  CHECK(live_view(stats, options)[3].starts_with("  \x1b[31mwalker0"));
}

TEST_CASE("the live view leaves the panel its room and fills the rest with the newest notes") {
  LiveViewOptions options{.title = "posed", .width = 60, .height = 12};
  options.notes = {"first", "second " + std::string(30, 'a') + " " + std::string(30, 'b'), "new"};
  const auto few = live_view(stats_of(6), options);
  REQUIRE(few.size() == 12);
  CHECK(few[8] == "first");
  CHECK(few[10].starts_with("  bbb"));  // a long note takes two lines
  CHECK(few[11] == "new");
  int given = 0;
  options.panel = [&](int rows) {
    given = rows;
    return std::vector<std::string>{"figure"};
  };
  const auto drawn = live_view(stats_of(2), options);
  CHECK(given == 12 - 4 - 3);
  CHECK(drawn[4] == "figure");
  CHECK(drawn.back() == "new");
}

TEST_CASE("a note is an answer, so neither streams nor what is wrong nor the panel push it out") {
  v1::Stats stats = stats_of(32);
  for (auto& stream : *stats.mutable_stream()) stream.set_shed(7);
  LiveViewOptions options{.title = "posed", .height = 24};
  options.notes = {"old", "alpha stays: " + std::string(60, 'a') + " " + std::string(60, 'b')};
  options.panel = [](int rows) {
    return std::vector<std::string>(static_cast<std::size_t>(std::max(rows, 0)), "figure");
  };
  for (const int streams : {1, 2, 17, 32}) {
    v1::Stats some = stats;
    some.mutable_stream()->DeleteSubrange(streams, 32 - streams);
    const auto lines = live_view(some, options);
    INFO(streams);
    REQUIRE(lines.size() == 24);
    CHECK(lines[22].starts_with("alpha stays: aaa"));
    CHECK(lines[23].starts_with("  bbb"));
  }
  options.height = 4;  // room for its beginning
  CHECK(live_view(stats, options).back().starts_with("alpha stays: aaa"));
}

TEST_CASE("JSON is canonical proto3, with every plain field") {
  v1::Frame frame;
  frame.set_stream("walker");
  frame.set_sequence(7);
  frame.add_rotation_xyzw(1.0F);
  const std::string json = to_json(frame);
  CHECK(json.find("\"sequence\":\"7\"") != std::string::npos);
  CHECK(json.find("\"rotationXyzw\":[1]") != std::string::npos);
  CHECK(json.find("\"quality\":\"QUALITY_MEASURED\"") != std::string::npos);
  CHECK(json.find("\"lagFrames\":0") != std::string::npos);
  CHECK(json.find("deviceNs") == std::string::npos);
  CHECK(json.find('\n') == std::string::npos);
}

}  // namespace
}  // namespace posed::tools
