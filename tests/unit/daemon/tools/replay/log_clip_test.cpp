// A log's stream as a clip: the frames that were published, and what is missing from the clip.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/log/writer.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/virtual_daemon.hpp"
#include "tests/unit/daemon/tools/replay/staged_run.hpp"

namespace posed::test {
namespace {

constexpr std::size_t kFrames = 120;

std::vector<Frame> published(const std::filesystem::path& log, std::uint32_t stream) {
  auto reader = log::Reader::open(log);
  REQUIRE(reader);
  const auto replay = replay::Replay::open(*reader);
  REQUIRE(replay);
  std::vector<Frame> frames;
  const auto done = (*replay)->run(
      [&](const pipeline::Item& item) {
        if (item.kind != pipeline::Item::Kind::kFrame || item.frame.header.stream != stream) return;
        const bool again =
            !frames.empty() && item.frame.header.sequence <= frames.back().header.sequence;
        if (!again) frames.push_back(item.frame);
      },
      [](const log::ChunkRow&) { return true; });
  REQUIRE(done);
  return frames;
}

void check_same(const clip::Clip& clip, const std::vector<Frame>& frames) {
  REQUIRE(clip.frames() == std::ssize(frames));
  for (int i = 0; i < clip.frames(); ++i) {
    const Frame made = clip.frame(i);
    const Frame& given = frames[static_cast<std::size_t>(i)];
    REQUIRE(made.joint_count == given.joint_count);
    for (std::size_t j = 0; j < given.joint_count; ++j) {
      const double off_rad = angle_between_rad(to_eigen_double(made.rotation_xyzw[j]),
                                               to_eigen_double(given.rotation_xyzw[j]));
      CHECK(off_rad < 1e-5);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(made.root_position_m[c] == Approx(given.root_position_m[c]).margin(1e-6));
    }
  }
}

bool says(const std::vector<std::string>& warnings, const std::string& text) {
  return std::ranges::any_of(
      warnings, [&](const auto& warning) { return warning.find(text) != std::string::npos; });
}

// A skeleton whose root stays in place while the hips below it move: each joint of `movers` has
// position channels.
Skeleton standing_above(const std::vector<std::uint16_t>& movers) {
  Skeleton skeleton;
  for (const char* name : {"reference", "hips", "chest"}) {
    Joint joint;
    joint.name = name;
    joint.parent = static_cast<int>(skeleton.joints.size()) - 1;
    joint.offset_m = Eigen::Vector3d(0.1, 0.2, -0.3) * (joint.parent + 2);
    skeleton.joints.push_back(joint);
  }
  skeleton.root_joint = 1;
  for (std::uint16_t j = 0; j < 3; ++j) {
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      if (std::ranges::find(movers, j) == movers.end()) continue;
      skeleton.channels.push_back({.joint = j, .axis = axis, .translation = true});
    }
    for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
      skeleton.channels.push_back({.joint = j, .axis = axis});
    }
  }
  REQUIRE(skeleton.finish());
  return skeleton;
}

}  // namespace

TEST_CASE("a log's stream becomes a clip of its published frames") {
  const TempFolder folder;
  const auto log = folder.path() / "take.plog";
  write_staged_log(log, kFrames);
  for (const std::uint32_t id : {0U, 1U}) {
    const auto clip = tools::clip_of_log(log, id == 0 ? "a" : "b");
    if (!clip) FAIL(clip.error().text());
    const auto frames = published(log, id);
    check_same(*clip, frames);
    CHECK(clip->frame_rate_hz == Approx(60.0));
    const bool all = frames.size() == kFrames;
    CHECK(all == (id == 1));  // the other stream shed some
    CHECK(says(clip->warnings, "frames were skipped") == !all);
    // Written to a file and read back, to the precision of its text.
    const auto out = folder.path() / "out.bvh";
    REQUIRE(clip::write_bvh(*clip, out));
    const auto back = clip::read_clip(out, {.metres_per_unit = 0.01});
    REQUIRE(back);
    check_same(*back, frames);
  }
}

TEST_CASE("takes are cut out of a log's stream by number or name, each frame once") {
  const TempFolder folder;
  const auto path = folder.path() / "take.plog";
  write_staged_log(path, kFrames);
  forge(path, "INSERT INTO take VALUES(1,'walk',1,60,'',0),(2,'walk',61,130,'',0),(3,'late',131," +
                  std::to_string(log::kToTheEnd) + ",'',0),(4,'none',131,130,'',0)");
  std::vector<Frame> cut;
  for (const char* take : {"1", "2", "late"}) {
    const auto clip = tools::clip_of_log(path, "b", take);
    if (!clip) FAIL(clip.error().text());
    CHECK(clip->frames() > 10);
    for (int i = 0; i < clip->frames(); ++i) cut.push_back(clip->frame(i));
  }
  const auto whole = tools::clip_of_log(path, "b");
  REQUIRE(whole);
  check_same(*whole, cut);
  const auto refusal = [&](const std::string& take) {
    const auto clip = tools::clip_of_log(path, "b", take);
    return clip ? "" : clip.error().message;
  };
  CHECK(refusal("walk") ==
        "has several takes named 'walk'; give the number of one: take 1 'walk', take 2 'walk'");
  CHECK(refusal("5") ==
        "has no take '5', but take 1 'walk', take 2 'walk', take 3 'late', take 4 'none'");
  CHECK(refusal("none") == "take 4 has 0 frames of stream 'b', and a clip needs two");
  forge(path, "INSERT INTO take VALUES(100000,'one too many',1,60,'',0)");
  CHECK(refusal("1").contains("no recording gives"));
}

TEST_CASE("all clips of a take come from one replay of its log, and are those of each stream") {
  const TempFolder folder;
  const auto path = folder.path() / "take.plog";
  write_staged_log(path, kFrames);
  const log::TakeRow take{.id = 1, .name = "walk", .first_item = 31, .last_item = 130};
  const auto replayed = [&](const log::TakeRow& row, bool goes_on) {
    std::map<std::string, clip::Clip> clips;
    const auto done = tools::each_clip_of_take(
        path, row,
        [&](const std::string& stream, Result<clip::Clip> clip) {
          REQUIRE(clip);
          CHECK(clips.try_emplace(stream, std::move(*clip)).second);
        },
        [=] { return goes_on; });
    return std::pair(done ? "" : done.error().message, std::move(clips));
  };
  CHECK(replayed(take, true).first.contains("does not have the end of take 1 yet"));
  forge(path, "INSERT INTO take VALUES(1,'walk',31,130,'',0),(2,'none',131,130,'',0)");
  const auto [error, clips] = replayed(take, true);
  CHECK(error.empty());
  REQUIRE(clips.size() == 2);
  for (const auto& [stream, made] : clips) {
    const auto single = tools::clip_of_log(path, stream, "1");
    REQUIRE(single);
    REQUIRE(made.frames() == single->frames());
    CHECK(made.frames() > 30);
    std::vector<Frame> frames;
    for (int i = 0; i < single->frames(); ++i) frames.push_back(single->frame(i));
    check_same(made, frames);
  }
  const log::TakeRow none{.id = 2, .name = "none", .first_item = 131, .last_item = 130};
  CHECK(replayed(none, true).second.empty());
  CHECK(replayed(take, false).first.starts_with("interrupted"));
}

TEST_CASE("a clip has every frame that was performed while the glove was unplugged", "[virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "performed.plog";
  VirtualDaemon daemon({.seed = 1, .log = path, .holdups = false});
  VirtualStream hand = glove_stream("hand", 1.0);
  hand.links[0].until_s = 1.0;
  daemon.add(std::move(hand));
  daemon.command({.at_s = 0.5, .kind = VirtualCommand::Kind::kPlay, .labels = "g p", .loop = true});
  daemon.run(3.0);
  const auto numbers = daemon.published(0).numbers;
  CHECK(numbers > 180);  // 100 of the glove
  const auto clip = tools::clip_of_log(path, "hand");
  if (!clip) FAIL(clip.error().text());
  CHECK(static_cast<std::uint64_t>(clip->frames()) == numbers);
}

TEST_CASE("the stream of a log must be named if there are several, and must exist") {
  const TempFolder folder;
  const auto log = folder.path() / "take.plog";
  write_staged_log(log, 30);
  const auto unclear = tools::clip_of_log(log, "");
  REQUIRE_FALSE(unclear);
  CHECK(unclear.error().message.find("a, b") != std::string::npos);
  CHECK(unclear.error().message.find("--stream") != std::string::npos);
  const auto missing = tools::clip_of_log(log, "c");
  REQUIRE_FALSE(missing);
  CHECK(missing.error().message.find("'c'") != std::string::npos);
  CHECK_FALSE(tools::clip_of_log(folder.write("no.plog", "no log"), ""));
  CHECK_FALSE(tools::clip_of_log(folder.path() / "none.plog", ""));
}

TEST_CASE("the position goes to the channels that move the figure, wherever they are") {
  for (const std::vector<std::uint16_t>& movers :
       {std::vector<std::uint16_t>{0}, std::vector<std::uint16_t>{1}}) {
    const auto skeleton = std::make_shared<const Skeleton>(standing_above(movers));
    clip::Clip source;
    source.skeleton = skeleton;
    source.frame_rate_hz = 50.0;
    source.channels.resize(20, std::ssize(skeleton->channels));
    for (int i = 0; i < 20; ++i) {
      for (int c = 0; c < source.channels.cols(); ++c)
        source.channels(i, c) = std::sin(i + 3.0 * c);
    }
    clip::FramesClip made(skeleton);
    std::vector<double> times_s;
    for (int i = 0; i < 20; ++i) {
      made.add(source.frame(i));
      times_s.push_back(i / 50.0);
    }
    const auto clip = made.finish("made", 0.0, times_s);
    REQUIRE(clip);
    CHECK(clip->frame_rate_hz == Approx(50.0));
    CHECK((clip->channels - source.channels).cwiseAbs().maxCoeff() < 1e-5);
  }
}

TEST_CASE("a recording at another pace than the nominal rate keeps its own") {
  const auto skeleton = std::make_shared<const Skeleton>(standing_above({0}));
  Frame frame;
  frame.joint_count = static_cast<std::uint16_t>(skeleton->joints.size());
  clip::FramesClip made(skeleton);
  std::vector<double> times_s;
  for (int i = 0; i < 20; ++i) {
    made.add(frame);
    times_s.push_back(i / 60.0 + (i % 3) * 0.001);  // as they arrived
  }
  const auto rate_hz = [&](double nominal_hz) {
    return made.finish("made", nominal_hz, times_s).value().frame_rate_hz;
  };
  CHECK(rate_hz(120.0) == Approx(60.0).epsilon(0.1));
  CHECK(rate_hz(59.94) == 59.94);
}

TEST_CASE("values that a frame lacks keep their last value, with a warning") {
  const auto skeleton = std::make_shared<const Skeleton>(standing_above({}));
  clip::Clip clip;
  clip.skeleton = skeleton;
  clip.channels.resize(4, 9);
  for (int i = 0; i < 4; ++i) clip.channels.row(i).setConstant(i);
  clip.channels(0, 2) = clip.channels(2, 3) = NAN;
  clip.channels.col(5).setConstant(NAN);
  clip::hold_missing(clip);
  CHECK(clip.channels(0, 2) == 1.0);
  CHECK(clip.channels(2, 3) == 1.0);
  CHECK(clip.channels(3, 3) == 3.0);
  CHECK(clip.channels.col(5).isZero());
  REQUIRE(clip.warnings.size() == 1);
  CHECK(clip.warnings.front().find("6 of 36") != std::string::npos);
}

TEST_CASE("missing frames are held so that the time stays, and are told; bursts are not missing") {
  clip::Clip clip;
  clip.frame_rate_hz = 10.0;
  clip.time_s = {0.0, 0.1, 0.5, 0.6, 100.6, 100.7, 100.9, 100.91, 101.0};
  clip.channels.resize(9, 1);
  for (int i = 0; i < 9; ++i) clip.channels(i, 0) = i;
  clip::Clip bursts = clip;
  clip::hold_gaps(clip);
  REQUIRE(clip.frames() == 12);  // one at 100.9 s was only late
  CHECK(clip.channels.col(0).segment(1, 5).transpose() ==
        Eigen::RowVectorXd{{1.0, 1.0, 1.0, 1.0, 2.0}});
  CHECK(clip.time_s[4] == Approx(0.4));
  REQUIRE(clip.warnings.size() == 1);
  CHECK(says(clip.warnings, "1002 frames are missing: 3 at 0.10 s, 999 at 0.60 s (cut out);"));
  bursts.time_s = {0.0, 0.1, 0.4, 0.41, 0.42, 0.7, 0.71, 0.72, 1.0};
  clip::hold_gaps(bursts);
  CHECK(bursts.frames() == 11);  // it came late once
  // Whoever sends says the times: what is held is limited.
  clip::Clip forged;
  forged.frame_rate_hz = 100.0;
  for (int i = 0; i < 2000; ++i) forged.time_s.push_back(i / 2 * 59.0 + i % 2 * 0.01);
  forged.channels.setZero(2000, 1);
  clip::hold_gaps(forged);
  CHECK(forged.frames() < 9000);
}

}  // namespace posed::test
