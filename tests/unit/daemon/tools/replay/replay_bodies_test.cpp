// Replay of a source whose bodies come, go and change; and what is wrong in a log that says so.
#include <catch2/catch.hpp>

#include <algorithm>
#include <map>

#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/support/log_surgery.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/tools/replay/body_run.hpp"
#include "tests/unit/daemon/tools/replay/staged_run.hpp"

namespace posed::test {
namespace {

// The description rows: the first, the waver leaves, it is back, the walker has other joints.
std::string description_row(int which) {
  return "id=(SELECT id FROM chunk WHERE direction=4 ORDER BY id LIMIT 1 OFFSET " +
         std::to_string(which) + ")";
}

bool names(const std::string& text, const std::string& part) {
  INFO(text);
  return text.find(part) != std::string::npos;
}

// Why the log cannot be replayed after `sql` has changed it as if its writer had written that.
std::string refusal_after(const std::string& sql) {
  const TempFolder folder;
  const auto path = folder.path() / "bodies.plog";
  write_body_log(path);
  forge(path, sql);
  const Replayed result = replayed(path);
  REQUIRE(result.difference);
  CHECK(result.difference->file == path.string());
  return result.difference->message;
}

// The same after a change to the bytes of a description row.
std::string refusal_of(int which, const std::string& bytes) {
  return refusal_after("UPDATE chunk SET bytes=CAST(" + bytes + " AS BLOB) WHERE " +
                       description_row(which));
}

// The events of a replay by stream, in order, and where the streams' frames begin and end.
struct Seen {
  std::vector<std::pair<std::uint32_t, v1::Event::Kind>> events;
  std::map<std::uint32_t, std::uint64_t> first, last;
};

Seen seen_of(const std::filesystem::path& path, std::vector<std::size_t>* engines = nullptr) {
  auto reader = log::Reader::open(path).value();
  const auto replay = replay::Replay::open(reader).value();
  Seen seen;
  const auto out = [&](const pipeline::Item& item) {
    const std::uint32_t stream = pipeline::stream_of(item);
    if (item.kind == pipeline::Item::Kind::kEvent) {
      seen.events.emplace_back(stream, static_cast<v1::Event::Kind>(item.stream_event.kind));
    } else if (item.kind == pipeline::Item::Kind::kFrame) {
      seen.first.try_emplace(stream, item.frame.header.sequence);
      seen.last[stream] = item.frame.header.sequence;
    }
  };
  REQUIRE(replay->run(out, [&](const log::ChunkRow&) {
    std::size_t count = 0;
    for (std::uint32_t id = 0; id < replay->streams(); ++id) {
      count += replay->engine(id) != nullptr ? 1 : 0;
    }
    if (engines != nullptr) engines->push_back(count);
    return true;
  }));
  return seen;
}

}  // namespace

TEST_CASE("bodies that come, go and change replay bit for bit", "[replay]") {
  const TempFolder folder;
  const auto path = folder.path() / "bodies.plog";
  CHECK(write_body_log(path) == std::vector<std::uint32_t>{0, 1, 0x10001, 0x10000});
  const Replayed result = replayed(path);
  INFO((result.difference ? result.difference->text() : ""));
  CHECK_FALSE(result.difference);
  CHECK(result.frames.size() > 1100);
  CHECK(result.counts.compared == result.frames.size());
  CHECK(result.counts.lost + result.counts.after_gap + result.counts.past_end == 0);
  CHECK(replayed(path, false).frames == result.frames);
}

TEST_CASE("what the user said of a source's joints replays with it", "[replay]") {
  const TempFolder folder;
  const auto path = folder.path() / "mapped.plog";
  BodyRun run(path, "name = \"room\"\n[bones]\nhips = \"hips\"\nspine = \"leftUpperLeg\"\n");
  drivers::mocap::MocapEmulator room(100.0);
  run.follow(room, 1.0);
  run.finish();
  const Replayed result = replayed(path);
  INFO((result.difference ? result.difference->text() : ""));
  CHECK_FALSE(result.difference);
  CHECK(result.counts.compared == run.published());
  auto reader = log::Reader::open(path).value();
  const auto replay = replay::Replay::open(reader).value();
  const Skeleton& walker = *replay->stream(0).description.skeleton;
  REQUIRE(walker.joint_of(Bone::kSpine) >= 0);
  CHECK(walker.joints[walker.joint_of(Bone::kSpine)].name == "leftUpperLeg");
  CHECK(replay->stream(1).description.skeleton->joint_of(Bone::kSpine) >= 0);  // as it was
}

TEST_CASE("a body that comes back goes on with its numbers, and its first stream has ended",
          "[replay]") {
  const TempFolder folder;
  const auto path = folder.path() / "bodies.plog";
  write_body_log(path);
  std::vector<std::size_t> engines;
  const Seen seen = seen_of(path, &engines);
  // by the index in the log: walker, waver, walker with other joints, waver again
  CHECK(seen.first.at(0) == 1);
  CHECK(seen.first.at(1) == 1);
  CHECK(seen.first.at(2) == seen.last.at(0) + 1);
  CHECK(seen.first.at(3) == seen.last.at(1) + 1);
  using Kind = v1::Event;
  const std::vector<std::pair<std::uint32_t, v1::Event::Kind>> events{
      {0, Kind::KIND_STARTED}, {1, Kind::KIND_STARTED}, {1, Kind::KIND_ENDED},
      {0, Kind::KIND_SHED},    {3, Kind::KIND_STARTED}, {0, Kind::KIND_STALE},
      {3, Kind::KIND_STALE},   {0, Kind::KIND_ENDED},   {3, Kind::KIND_ENDED},
      {2, Kind::KIND_STARTED}};
  CHECK(seen.events == events);
  CHECK(engines.front() == 2);                     // those who come first have theirs already
  CHECK(*std::ranges::max_element(engines) == 2);  // those who left or come later use no memory
  CHECK(engines.back() == 1);
}

TEST_CASE("frames behind a gap that swallows a description are not compared", "[replay]") {
  const TempFolder folder;
  const auto path = folder.path() / "bodies.plog";
  const auto ids = write_body_log(path);
  // The third row goes, so the log never says which body the second stream of the waver is.
  const std::string lost = "SELECT id FROM chunk WHERE direction=4 ORDER BY id LIMIT 1 OFFSET 2";
  forge(path,
        "INSERT INTO gap(kind,owner,after_chunk,lost,time_ns,crc)"
        " SELECT 0, 0, id-1, 1, 0, 0 FROM (" +
            lost + "); DELETE FROM chunk WHERE id=(" + lost + ");");
  const Replayed result = replayed(path);
  INFO((result.difference ? result.difference->text() : ""));
  CHECK_FALSE(result.difference);
  CHECK(result.counts.compared > 500);
  CHECK(result.counts.after_gap > 500);
  CHECK(result.counts.lost + result.counts.past_end == 0);
  auto reader = log::Reader::open(path).value();
  const auto replay = replay::Replay::open(reader).value();
  for (std::uint32_t id = 0; id < replay->streams(); ++id) {
    const bool known = reader.streams()[id].id != ids[2];
    CHECK(replay->stream(id).described == known);
    if (!known) CHECK(replay->broken_at(id) == 0U);
  }
}

TEST_CASE("a gap in the decisions hides the end of a stream, but not that its body left",
          "[replay]") {
  const TempFolder folder;
  const auto path = folder.path() / "bodies.plog";
  write_body_log(path);
  forge(path, "DELETE FROM decision WHERE name='end' AND stream=1");
  const Seen seen = seen_of(path);
  CHECK(std::ranges::count(seen.events, std::pair{1U, v1::Event::KIND_ENDED}) == 1);
}

TEST_CASE("a log that describes bodies in an impossible way is refused with a sentence",
          "[replay]") {
  // u16 count, then the u32 ids of the streams, then the description
  const std::string first = "substr(bytes,3,4)", second = "substr(bytes,7,4)";
  const std::string rest = "substr(bytes,11)";
  CHECK(names(refusal_of(0, "x'02'"), "has a description that is cut short"));
  CHECK(names(refusal_of(0, "substr(bytes,1,30)"), "has a description that cannot be read ("));
  CHECK(names(refusal_of(0, "x'0100'||" + first + "||" + rest),
              "describes 2 bodies, but names streams for 1"));
  CHECK(names(refusal_of(0, "x'0200'||" + first + "||x'63000000'||" + rest),
              "describes stream 99, which its source lacks"));
  CHECK(names(refusal_of(0, "x'0200'||" + first + "||" + first + "||" + rest),
              "describes stream 0 twice"));
  CHECK(names(refusal_of(2, "x'0200'||" + second + "||" + first + "||" + rest),
              "describes stream 0 with another skeleton than before"));
  CHECK(names(refusal_after("UPDATE chunk SET sequences=x'' WHERE " + description_row(1)),
              "has an impossible time or place"));
  CHECK(names(refusal_after("UPDATE chunk SET arrival_ns=-1 WHERE " + description_row(1)),
              "has an impossible time or place"));
  // a description that is missing without a gap, and the stream of another source
  CHECK(names(refusal_after("DELETE FROM chunk WHERE " + description_row(1)),
              "has an impossible time or place"));
  CHECK(names(refusal_after("INSERT INTO source SELECT 1,'b',driver,text,identity,config,0"
                            " FROM source;"
                            "UPDATE stream SET source=1 WHERE id=1"),
              "describes stream 1, which its source lacks"));
}

TEST_CASE("a device with one body has no descriptions of bodies", "[replay]") {
  const TempFolder folder;
  const auto path = folder.path() / "staged.plog";
  write_staged_log(path, 30);
  forge(path, "UPDATE chunk SET direction=4 WHERE id=5");
  const Replayed result = replayed(path);
  REQUIRE(result.difference);
  CHECK(names(result.difference->message,
              "row 5 of table chunk describes bodies, but devices of driver 'file' have one"));
}

TEST_CASE("the parts of a body that came several times are one clip, if its skeleton stayed") {
  const TempFolder folder;
  const auto path = folder.path() / "bodies.plog";
  write_body_log(path);
  const Seen seen = seen_of(path);
  const auto waver = tools::clip_of_log(path, "Waver");
  if (!waver) FAIL(waver.error().text());
  CHECK(static_cast<std::uint64_t>(waver->frames()) == seen.last.at(3));
  REQUIRE(waver->warnings.size() == 1);
  CHECK(names(waver->warnings.front(), "the body came back 1 times"));
  CHECK(waver->channels.leftCols(3).row(0).isApprox(Eigen::RowVector3d(0.0, 0.95, 2.5), 1e-6));
  CHECK_FALSE(waver->channels.row(0).isApprox(waver->channels.row(30), 1e-3));

  const auto walker = tools::clip_of_log(path, "Walker");
  REQUIRE_FALSE(walker);
  CHECK(names(walker.error().message, "--stream: Walker#1 (11 joints), Walker#2 (5 joints)"));
  const auto second = tools::clip_of_log(path, "Walker#2");
  REQUIRE(second);
  CHECK(second->frames() == 100);
  CHECK(second->skeleton->joints.size() == 5);
  const auto missing = tools::clip_of_log(path, "Walker#3");
  REQUIRE_FALSE(missing);
  CHECK(names(missing.error().message, "Waver"));
}

}  // namespace posed::test
