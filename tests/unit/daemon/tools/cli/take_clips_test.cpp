// The clips of takes, made of the frames as they left the stages, without the log.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/tools/run/take_clips.hpp"
#include "posed/v1/control.pb.h"
#include "proto/clip/clip.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/log/rows.hpp"
#include "tests/support/has.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/tools/replay/staged_run.hpp"

namespace posed::test {
namespace {

std::shared_ptr<const Skeleton> two_joints() {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->joints.resize(2);
  skeleton->joints[0].name = "root";
  skeleton->joints[1].name = "head";
  skeleton->joints[1].parent = 0;
  skeleton->joints[1].offset_m = {0, 1, 0};
  REQUIRE(skeleton->finish());
  return skeleton;
}

Frame frame_of(const Skeleton& skeleton, std::uint32_t stream, std::uint64_t item) {
  Frame frame;
  frame.header = {.stream = stream,
                  .sequence = item,
                  .arrival_ns = static_cast<std::int64_t>(item) * 16'666'667,
                  .clock = {}};
  frame.skeleton = skeleton.id;
  frame.joint_count = 2;
  frame.valid.set(0).set(1);
  frame.rotation_xyzw.fill(kIdentity);
  return frame;
}

// A recording whose log is nowhere: whoever would replay it fails.
struct Recording {
  TempFolder folder;
  std::shared_ptr<const Skeleton> skeleton = two_joints();
  tools::TakeClips clips{folder.path() / "stage.plog"};

  Recording() { clips.stream_comes(3, {.name = "ann", .skeleton = skeleton, .rate_hz = 60.0}); }
  // Of so many items, a frame each.
  void frames(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t item = from; item <= to; ++item) {
      clips.frame(frame_of(*skeleton, 3, item), item);
    }
  }
  void take(std::int64_t id, const std::string& name, std::uint64_t first, std::uint64_t last) {
    clips.take_changed({.id = id, .name = name, .first_item = first, .last_item = last});
  }
  [[nodiscard]] int frames_of(const std::string& file) const {
    const auto clip = clip::read_clip(folder.path() / file);
    return clip ? clip->frames() : 0;
  }
};

}  // namespace

TEST_CASE("a take's clip has the frames of its items, and no log is read for it") {
  Recording recording;
  recording.take(1, "walk", 5, log::kToTheEnd);
  recording.take(1, "walk", 5, 12);
  recording.take(2, "", 13, log::kToTheEnd);  // nobody ends it
  recording.frames(1, 20);
  recording.clips.stop();
  REQUIRE(recording.clips.finish());
  CHECK(recording.frames_of("stage-1-ann.walk.bvh") == 8);
  CHECK(recording.frames_of("stage-2-ann.bvh") == 8);
  v1::ControlReply list;
  recording.clips.add_to(list);
  CHECK(list.recording().empty());
}

TEST_CASE("a take's clip that cannot be written is listed with the reason") {
  Recording recording;
  recording.folder.write("stage-1-ann.walk.bvh", "mine");
  recording.take(1, "walk", 1, log::kToTheEnd);
  recording.take(1, "walk", 1, 9);
  recording.frames(1, 10);
  recording.clips.stop();
  REQUIRE(recording.clips.finish());
  v1::ControlReply list;
  recording.clips.add_to(list);
  REQUIRE(list.recording_size() == 1);
  CHECK(list.recording(0).name() == "stage-1-ann.walk.bvh");
  CHECK_FALSE(list.recording(0).being_made());
  CHECK(has(list.recording(0).problem(), "exists already"));
}

TEST_CASE("a take that is too long for memory is made from the log, and one that fits is not") {
  const TempFolder folder;
  const auto log = folder.path() / "stage.plog";
  write_staged_log(log, 60);
  forge(log, "INSERT INTO take VALUES(1,'long',1,60,'',0),(2,'short',61,66,'',0)");
  const auto skeleton = two_joints();
  constexpr std::size_t kSmall = 1000;  // bytes: some ten frames
  tools::TakeClips clips(log, kSmall);
  clips.stream_comes(1, {.name = "b", .skeleton = skeleton, .rate_hz = 60.0});
  for (std::uint64_t item = 1; item <= 66; ++item) clips.frame(frame_of(*skeleton, 1, item), item);
  clips.take_changed({.id = 1, .name = "long", .first_item = 1, .last_item = 60});
  clips.take_changed({.id = 2, .name = "short", .first_item = 61, .last_item = 66});
  clips.stop();
  REQUIRE(clips.finish());
  const auto frames = [&](const std::string& file) {
    const auto clip = clip::read_clip(folder.path() / file);
    return clip ? clip->frames() : 0;
  };
  const auto of_log = tools::clip_of_log(log, "b", "1");
  REQUIRE(of_log);
  CHECK(frames("stage-1-b.long.bvh") >= of_log->frames());  // a file's frames are evenly spaced
  CHECK(frames("stage-1-a.long.bvh") > 0);                  // the log has this stream, too
  CHECK(frames("stage-2-b.short.bvh") == 6);
  CHECK(frames("stage-2-a.short.bvh") == 0);
  v1::ControlReply list;
  clips.add_to(list);
  CHECK(list.recording().empty());
}

TEST_CASE("a take of which frames are missing is made from the log") {
  Recording recording;
  recording.frames(1, 4000);  // the keeping thread cannot be that fast, or it has let them go
  recording.take(1, "walk", 1, log::kToTheEnd);
  recording.clips.stop();
  const auto done = recording.clips.finish();
  const bool kept = recording.frames_of("stage-1-ann.walk.bvh") == 4000;
  CHECK((kept || !done));  // never a clip that silently lacks some: this log does not exist
  if (done) return;
  v1::ControlReply list;
  recording.clips.add_to(list);
  REQUIRE(list.recording_size() == 1);
  CHECK(list.recording(0).being_made());
}

}  // namespace posed::test
