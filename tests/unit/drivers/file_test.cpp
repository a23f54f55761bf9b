// The file driver: it plays exactly the clip's poses, and refuses bad clips and bytes.
#include <catch2/catch.hpp>

#include <span>
#include <string>

#include "drivers/transport/transport_factory.hpp"
#include "proto/clip/clip.hpp"
#include "tests/support/replaced.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::drivers {
namespace {

using test::CollectSink;
using test::replaced;

Result<Device> open_file(const std::filesystem::path& path, Options options = {}) {
  options["path"] = path.string();
  options.try_emplace("pace", 0.0);
  TransportFactory ports;
  return find_driver("file")->open(options, ports);
}

Device must_open(const std::filesystem::path& path, const Options& options = {}) {
  auto device = open_file(path, options);
  if (!device) FAIL(device.error().text());
  return std::move(*device);
}

Device small_amc_device() {
  return must_open(test::scratch_file("small.amc", test::small_amc()),
                   {{"skeleton", test::scratch_file("small.asf", test::small_asf()).string()}});
}

void feed(Device& device, const std::string& text, Sink& sink) {
  device.decoder->feed(std::as_bytes(std::span(text)), 0, sink);
}

// Plays the clip once and compares every frame with the clip read offline.
void check_plays_like_clip(const std::filesystem::path& path, const Options& options,
                           const clip::ReadOptions& read) {
  INFO(path);
  const auto clip = clip::read_clip(path, read);
  if (!clip) FAIL(clip.error().text());
  Options once = options;
  once["loop"] = false;
  Device device = must_open(path, once);
  CHECK(device.description.skeleton->id == clip->skeleton->id);
  CHECK(device.description.rate_hz == clip->frame_rate_hz);
  REQUIRE(device.transport->start(0));
  CollectSink sink(static_cast<std::size_t>(clip->frames()) + 1);
  for (;;) {
    const Chunk chunk = device.transport->read(0);
    if (chunk.end) break;
    device.decoder->feed(chunk.bytes, 0, sink);
  }
  REQUIRE(static_cast<int>(sink.frames.size()) == clip->frames());
  int different = 0;
  for (int i = 0; i < clip->frames(); ++i) {
    const Frame expected = clip->frame(i);
    const bool same =
        test::same_pose(sink.frames[static_cast<std::size_t>(i)], expected) &&
        sink.frames[static_cast<std::size_t>(i)].header.device_ns == expected.header.device_ns &&
        sink.frames[static_cast<std::size_t>(i)].timecode == expected.timecode;
    different += same ? 0 : 1;
  }
  CHECK(different == 0);
}

}  // namespace

TEST_CASE("a clip played live is the clip read offline, to the last bit") {
  check_plays_like_clip(test::scratch_file("small.bvh", test::small_bvh()), {}, {});
  const auto asf = test::scratch_file("small.asf", test::small_asf());
  const auto amc = test::scratch_file("small.amc", test::small_amc());
  check_plays_like_clip(amc, {{"skeleton", asf.string()}, {"rate_hz", 60.0}},
                        {.skeleton = asf, .rate_hz = 60.0});
  check_plays_like_clip(test::scratch_file("hand.csv", test::small_hand_csv()),
                        {{"hand", std::string("left")}}, {.hand = Side::kLeft});
}

TEST_CASE("a rest pose in front of the motion is played once, however often the clip is") {
  auto clip = clip::read_clip(test::scratch_file("small.bvh", test::small_bvh())).value();
  constexpr int kFrames = 6;
  const Eigen::RowVectorXd row = clip.channels.row(0);
  clip.channels = row.replicate(kFrames, 1);
  for (int t = 1; t < kFrames; ++t) clip.channels.row(t).array() += 1.0 + 0.01 * t;
  const auto path = test::scratch_file("rest.glb", "");
  REQUIRE(clip::write_clip(clip, path));
  const auto read = clip::read_clip(path);
  REQUIRE(read);
  Device device = must_open(path, {});
  REQUIRE(device.transport->start(0));
  CollectSink sink(20);
  for (int i = 0; i < 12; ++i) {
    device.decoder->feed(device.transport->read(device.transport->next_due_ns()).bytes, 0, sink);
  }
  REQUIRE(sink.frames.size() == 12);
  for (const auto& [played, frame] : {std::pair{0, 0}, {5, 5}, {6, 1}, {10, 5}, {11, 1}}) {
    CHECK(test::same_pose(sink.frames[played], read->frame(frame)));
    const double time_s = played / read->frame_rate_hz;
    CHECK(seconds(sink.frames[played].header.device_ns) == Approx(time_s).margin(1e-6));
  }
}

TEST_CASE("a clip's timecodes are sent with its frames") {
  auto clip = clip::read_clip(test::scratch_file("small.bvh", test::small_bvh())).value();
  clip.timecode.assign(static_cast<std::size_t>(clip.frames()), to_timecode("10:20:30:04"));
  clip.timecode.back() = to_timecode("10:20:30:05");
  const auto path = test::scratch_file("coded.glb", "");
  REQUIRE(clip::write_clip(clip, path));
  const auto read = clip::read_clip(path);
  REQUIRE(read);
  CHECK(view_of(read->frame(read->frames() - 1).timecode) == "10:20:30:05");
  check_plays_like_clip(path, {}, {});
}

TEST_CASE("a hand CSV is played by its own uneven times, round after round") {
  std::string text = test::small_hand_csv();
  for (const auto& [from, to] : {std::pair("0.020000", "0.013"), {"0.060000", "0.07"}}) {
    text = replaced(text, std::string("\n") + from, std::string("\n") + to);
  }
  const auto path = test::scratch_file("uneven.csv", text);
  const auto clip = clip::read_clip(path);
  REQUIRE(clip);
  Device device = must_open(path, {{"pace", 2.0}});
  const double step_s = 1.0 / device.description.rate_hz;
  REQUIRE(device.transport->start(1000));
  CollectSink sink;
  for (int i = 0; i < 10; ++i) {
    const double time_s = clip->time_s[static_cast<std::size_t>(i % 5)] +
                          (i < 5 ? 0.0 : clip->time_s.back() + step_s);
    const std::int64_t due_ns = device.transport->next_due_ns();
    CHECK(seconds(due_ns - 1000) == Approx(time_s / 2.0).margin(2e-9));
    CHECK(device.transport->read(due_ns - 1).bytes.empty());
    device.decoder->feed(device.transport->read(due_ns).bytes, 0, sink);
    CHECK(seconds(sink.frames.back().header.device_ns) == Approx(time_s).margin(2e-9));
  }
  CHECK(open_file(path, {{"hand", std::string("both")}}).error().text() == "hand is left or right");
  CHECK(open_file(path, {{"hand_shape", std::string("paw")}}).error().text() ==
        "there is no hand 'paw'; there are adult");
}

TEST_CASE("a real walk played live is the walk read offline, to the last bit") {
  const auto amc = test::shared("data/cmu/07_01.amc");
  const auto bvh = test::shared("data/cmu/07_01.bvh");
  if (!amc || !bvh) SKIP_WITHOUT_SHARED();
  check_plays_like_clip(*amc, {}, {});
  check_plays_like_clip(*bvh, {}, {});
}

TEST_CASE("other line ends, a byte order mark and blank lines change nothing") {
  CollectSink expected;
  Device plain = must_open(test::scratch_file("small.bvh", test::small_bvh()));
  for (const auto& chunk : test::read_chunks(*plain.transport, 5)) {
    plain.decoder->feed(chunk, 0, expected);
  }
  for (const std::string& end : {std::string("\r\n"), std::string("\r"), std::string("\n\n \n")}) {
    std::string text = "\xEF\xBB\xBF";
    for (const char c : test::small_bvh()) text += c == '\n' ? end : std::string(1, c);
    Device device = must_open(test::scratch_file("other.bvh", text));
    CollectSink sink;
    for (const auto& chunk : test::read_chunks(*device.transport, 5)) {
      device.decoder->feed(chunk, 0, sink);
    }
    CHECK(device.description.skeleton->id == plain.description.skeleton->id);
    REQUIRE(sink.frames.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) {
      CHECK(test::same_pose(sink.frames[i], expected.frames[i]));
    }
  }
}

TEST_CASE("a clip that cannot be played is refused with one error message and its place") {
  const std::string bvh = test::small_bvh();
  const std::string last = "0 0 0 0 0 0 1 95 8 14 -24 34 1.9 2.1 3.1\n";
  struct Case {
    std::string file;
    std::string text;
    std::string expected;  // after the file's path
  };
  const std::vector<Case> cases{
      {"empty.bvh", "", ":1: does not begin with HIERARCHY"},
      {"foreign.bvh", "#!/bin/sh\necho\n", ":1: does not begin with HIERARCHY"},
      {"cut_header.bvh", bvh.substr(0, 200), ":"},
      {"no_frames.bvh", bvh.substr(0, bvh.find("0 0 0 0 0 0 1 95")), ": has no frames"},
      {"cut_frame.bvh", bvh.substr(0, bvh.size() - 12), ":28: frame 5: the frame has 12 values"},
      {"nan.bvh", replaced(bvh, last, replaced(last, "-24", "nan")),
       ":28: frame 5: 'nan' is not a number a pose can have"},
      {"infinite.bvh", replaced(bvh, last, replaced(last, "-24", "inf")),
       ":28: frame 5: 'inf' is not a number a pose can have"},
      {"letters.bvh", replaced(bvh, last, "hello\n"), ":28: frame 5: 'hello'"},
      {"clip.fbx", "Kaydara", ": is no clip posed can read; a clip is .bvh, .amc, a hand's .csv"},
  };
  for (const Case& bad : cases) {
    const auto path = test::scratch_file(bad.file, bad.text);
    const auto device = open_file(path);
    INFO(bad.file);
    REQUIRE_FALSE(device);
    INFO(device.error().text());
    CHECK(device.error().text().starts_with(path.string() + bad.expected));
    CHECK(device.error().text().find('\n') == std::string::npos);
    CHECK(device.error().exit_code == ExitCode::kFailed);
  }
  for (const std::string& path : {std::string("/nowhere/walk.bvh"), std::string("/tmp/.bvh/")}) {
    const auto device = open_file(path);
    REQUIRE_FALSE(device);
    CHECK(device.error().text().starts_with(path));
  }
}

TEST_CASE("an AMC without its skeleton, or with another's, is refused by name") {
  const auto asf = test::scratch_file("small.asf", test::small_asf());
  const auto lonely = open_file(test::scratch_file("77_01.amc", test::small_amc()));
  REQUIRE_FALSE(lonely);
  CHECK(lonely.error().text().find("77.asf") != std::string::npos);
  const auto foreign = test::scratch_file("x.amc", replaced(test::small_amc(), "ltibia", "tail"));
  const auto device = open_file(foreign, {{"skeleton", asf.string()}});
  REQUIRE_FALSE(device);
  CHECK(device.error().text().starts_with(foreign.string() + ":7: "));
  const auto cut = test::scratch_file("cut.amc", test::small_amc().substr(0, 170));
  const auto cut_device = open_file(cut, {{"skeleton", asf.string()}});
  REQUIRE_FALSE(cut_device);
  CHECK(cut_device.error().text().starts_with(cut.string() + ":"));
}

TEST_CASE("an invalid frame is counted, and the clip's clock continues") {
  Device device = must_open(test::scratch_file("small.bvh", test::small_bvh()));
  const std::string good = "0 0 0 0 0 0 1 95 8 14 -24 34 1.9 2.1 3.1\n";
  CollectSink sink;
  for (const std::string& line :
       {good, replaced(good, "-24", "nan"), replaced(good, "-24", "-inf"),
        replaced(good, "-24", "1e300"), std::string("1 2 3\n"), replaced(good, "3.1", "3.1 4.1"),
        replaced(good, "-24", "x"), good}) {
    feed(device, line, sink);
  }
  CHECK(sink.count(Outcome::kOk) == 2);
  CHECK(sink.count(Outcome::kOutOfRange) == 3);
  CHECK(sink.count(Outcome::kShort) == 1);
  CHECK(sink.count(Outcome::kForeign) == 2);
  REQUIRE(sink.frames.size() == 2);
  CHECK(test::same_pose(sink.frames[0], sink.frames[1]));
  CHECK(sink.frames[1].header.device_ns == nanoseconds(7.0 / 120.0));
}

TEST_CASE("values beyond what a pose can have are counted as out of range and never published") {
  Device device = must_open(test::scratch_file("small.bvh", test::small_bvh()));
  const std::string good = "0 0 0 0 0 0 1 95 8 14 -24 34 1.9 2.1 3.1\n";
  CollectSink sink;
  // A position of 1,000,000 units and angles of 1e9 and 36,001 degrees; 36,000 are 100 turns.
  feed(device, replaced(good, "1 95 8", "1 1000000 8"), sink);
  feed(device, replaced(good, "-24", "1e9"), sink);
  feed(device, replaced(good, "-24", "-36001"), sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 3);
  CHECK(sink.frames.empty());
  feed(device, replaced(good, "-24", "-36000"), sink);
  CHECK(sink.count(Outcome::kOk) == 1);
  CHECK(sink.frames.size() == 1);

  Device amc = small_amc_device();
  feed(amc, "1\nroot 1 2 3 4 5 6\nlfemur 1 2 3\nltibia 1e9\n", sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 4);
  CHECK(sink.frames.size() == 1);

  const auto refused = open_file(
      test::scratch_file("far.bvh", replaced(test::small_bvh(), "1 95 8", "1 9500000 8")));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().text().find("'9500000' is beyond what a pose can have") !=
        std::string::npos);
}

TEST_CASE("an option without meaning for this kind of clip is refused") {
  const auto bvh = test::scratch_file("small.bvh", test::small_bvh());
  const auto said = [&](const char* option, const drivers::OptionValue& value) {
    const auto device = open_file(bvh, {{option, value}});
    REQUIRE_FALSE(device);
    CHECK(device.error().exit_code == ExitCode::kWrongUse);
    return device.error().message;
  };
  CHECK(said("rate_hz", 60.0) == "is a BVH, and only AMC accepts a rate; leave it out");
  CHECK(said("skeleton", std::string("a.asf")).contains("only AMC accepts a skeleton"));
  CHECK(said("hand", std::string("left")).contains("only hand CSV accepts a hand;"));
  CHECK(said("hand_shape", std::string("paw")).contains("only hand CSV accepts a hand shape"));
  CHECK(must_open(bvh, {{"hand", std::string("right")}}).description.rate_hz == Approx(120.0));
}

TEST_CASE("an AMC frame is complete with its last bone, not with the next frame's number") {
  Device device = small_amc_device();
  CollectSink sink;
  feed(device, "1\nroot 1 2 3 4 5 6\nlfemur 1 2 3\n", sink);
  CHECK(sink.frames.empty());
  feed(device, "ltibia 7\n", sink);
  CHECK(sink.frames.size() == 1);
  // Bones in another order, a bone on two lines, a comment, and no additional bones.
  feed(device, "2\nltibia 7\n# note\nlfemur 1\n2 3\nroot 1 2 3 4 5 6\n", sink);
  REQUIRE(sink.frames.size() == 2);
  CHECK(test::same_pose(sink.frames[0], sink.frames[1]));
  CHECK(sink.count(Outcome::kOk) == 2);
}

TEST_CASE("an AMC frame with a bone missing is short, and the next one is good") {
  Device device = small_amc_device();
  CollectSink sink;
  feed(device, "1\nroot 1 2 3 4 5 6\nltibia 7\n2\nroot 1 2 3 4 5 6\nlfemur 1 2 3\nltibia 7\n",
       sink);
  CHECK(sink.count(Outcome::kShort) == 1);
  CHECK(sink.frames.size() == 1);
  CHECK(sink.frames[0].header.device_ns == nanoseconds(1.0 / 120.0));
  feed(device, "3\nroot 1 2 3 4 nan 6\nlfemur 1 2 3\nltibia 7\n", sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
}

TEST_CASE("what a clip leaves undetermined is reported as a warning") {
  const Device device = must_open(
      test::scratch_file("warn.bvh", replaced(test::small_bvh(), "Frames: 5", "Frames: 500")));
  REQUIRE_FALSE(device.warnings.empty());
  bool reported = false;
  for (const std::string& warning : device.warnings) {
    reported = reported || warning.find("500") != std::string::npos;
  }
  CHECK(reported);
}

}  // namespace posed::drivers
