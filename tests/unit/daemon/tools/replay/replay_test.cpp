// Replay: the same log gives the same bits as the live run; and what a log lacks is reported.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdlib>
#include <set>

#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "posed/v1/log.pb.h"
#include "tests/support/has.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/daemon/tools/replay/staged_run.hpp"

using namespace posed;
using namespace posed::test;

namespace {

// The difference found in a log after `sql` has changed it as if its writer had written that.
std::string difference_after(const std::string& sql) {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  write_staged_log(path, 60);
  forge(path, sql);
  const Replayed result = replayed(path);
  REQUIRE(result.difference);
  CHECK(result.difference->file == path.string());
  return result.difference->message;
}

// Bytes as SQL's x'...'.
std::string blob(const std::string& bytes) {
  std::string sql = "x'";
  for (const char byte : bytes) {
    sql += "0123456789abcdef"[(byte >> 4) & 15];
    sql += "0123456789abcdef"[byte & 15];
  }
  return sql + "'";
}

// The value of an alpha decision.
std::string number_value(double number) {
  v1::DecisionValue value;
  value.set_number(number);
  return blob(value.SerializeAsString());
}

double furthest(const google::protobuf::RepeatedField<float>& a,
                const google::protobuf::RepeatedField<float>& b) {
  REQUIRE(a.size() == b.size());
  double most = 0.0;
  for (int i = 0; i < a.size(); ++i) most = std::max(most, std::abs(double{a[i]} - double{b[i]}));
  return most;
}

// The bound of the goldens that stand in the repository.
void check_near(const v1::Frame& frame, const v1::Frame& expected) {
  CHECK(frame.sequence() == expected.sequence());
  CHECK(frame.quality() == expected.quality());
  CHECK(furthest(frame.rotation_xyzw(), expected.rotation_xyzw()) < 0.5e-5);  // 1e-5 rad
  CHECK(furthest(frame.angle_rad(), expected.angle_rad()) < 1e-5);
  CHECK(furthest(frame.root_position_m(), expected.root_position_m()) < 1e-6);
}

}  // namespace

TEST_CASE("two replays give the same bits, and those of the live run", "[replay]") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  write_staged_log(path, 120);
  auto reader = log::Reader::open(path);
  REQUIRE(reader);
  std::set<std::string> kinds;
  const auto decisions = reader->decisions();
  REQUIRE(decisions);
  for (const auto& decision : *decisions) kinds.insert(decision.stage + "/" + decision.name);
  CHECK(kinds == std::set<std::string>{"style/alpha", "style/model", "/shed", "/tick"});
  const Replayed first = replayed(path);
  INFO((first.difference ? first.difference->text() : ""));
  CHECK(!first.difference);
  CHECK(first.counts.compared == first.frames.size());
  CHECK(first.counts.lost + first.counts.after_gap + first.counts.past_end == 0);
  // Raw and styled frames of two streams, without those that were shed, and with the poses repeated
  // by ticks.
  CHECK(first.frames.size() == 4 * 120 - 2 * 5 + 4);
  CHECK(replayed(path, false).frames == first.frames);
}

TEST_CASE("the first difference is named by stream, sequence and field", "[replay]") {
  // An alpha decision that never happened: the pose differs from the live one at the next frame.
  CHECK(has(
      difference_after("UPDATE decision SET value=" + number_value(0.75) + " WHERE name='alpha'"),
      "stream a, sequence 11, rotation_xyzw["));
  CHECK(has(difference_after("DELETE FROM decision WHERE name='shed'"),
            "stream a-raw, sequence 42, replayed, but not published live"));
  CHECK(has(difference_after("DELETE FROM decision WHERE name='tick' AND stream=1"),
            "stream b, sequence 30, published live, but not replayed"));
  CHECK(has(difference_after("DELETE FROM chunk WHERE id > 170 AND source=1"),
            "published live, but not replayed"));
}

TEST_CASE("an invalid log is refused before anything is replayed", "[replay]") {
  CHECK(has(difference_after("UPDATE decision SET name='beta' WHERE name='alpha'"),
            "makes no sense"));
  CHECK(has(
      difference_after("UPDATE decision SET value=" + number_value(1e300) + " WHERE name='alpha'"),
      "table decision makes no sense"));
  CHECK(has(difference_after("UPDATE source SET driver='no such'"), "which this posed does not"));
  CHECK(has(difference_after("UPDATE stream SET stages_json='{}'"), "settings"));
  CHECK(has(difference_after("UPDATE stream SET stages_json=replace(stages_json,'0.5','1e99')"),
            "invalid"));
  CHECK(has(difference_after("UPDATE stream SET stages_json=replace(stages_json,'style','feet')"),
            "update posed"));
  CHECK(has(difference_after("UPDATE stream SET source=0"), "several bodies"));
  CHECK(has(difference_after("DELETE FROM blob"), "lacks the file with SHA-256"));
  CHECK(has(difference_after("UPDATE blob SET bytes=x'00'"), "does not match its hash"));
}

TEST_CASE("what is missing in a log is counted, and nothing after it is compared", "[replay]") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  write_staged_log(path, 60);
  // Removes chunks of source 0 in the middle, as an overflow would: those of frames 21 to 23.
  const std::string frame = "substr(sequences, 5, 1)";  // the lowest byte of next_frame
  forge(path,
        "INSERT INTO gap(kind,owner,after_chunk,lost,time_ns,crc)"
        " SELECT 0, 0, max(id), 3, 0, 0 FROM chunk WHERE source=0 AND " +
            frame +
            "=x'14';"
            "DELETE FROM chunk WHERE source=0 AND " +
            frame +
            " IN (x'15', x'16', x'17');"
            "INSERT INTO gap(kind,owner,after_chunk,lost,time_ns,crc) VALUES(2,1,0,1,0,0);"
            "DELETE FROM frame WHERE stream=1 AND raw=0 AND sequence=7;");
  const Replayed result = replayed(path);
  INFO((result.difference ? result.difference->text() : ""));
  CHECK(!result.difference);
  CHECK(result.counts.lost == 1);
  CHECK(result.counts.after_gap > 0);
  CHECK(result.counts.past_end == 0);
  // Each frame counts once, though both the log and the replay have it. Only the log has the three
  // of the missing chunks, styled and raw.
  const auto& counts = result.counts;
  CHECK(counts.compared + counts.lost + counts.after_gap == result.frames.size() + 2 * 3);
}

TEST_CASE("a take during which the log lacks chunks is said to have gaps", "[replay]") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  write_staged_log(path, 60);
  const std::string frame = "substr(sequences, 5, 1)";  // the lowest byte of next_frame
  const auto item_at = [&](const std::string& byte) {
    return "(SELECT min(first_item) FROM chunk WHERE source=0 AND " + frame + "=x'" + byte + "')";
  };
  const auto take = [&](int id, const std::string& first, const std::string& last) {
    return "INSERT INTO take(id,name,first_item,last_item,timecode,crc) SELECT " +
           std::to_string(id) + ",'walk'," + first + "," + last + ",'',0;";
  };
  forge(path, take(1, item_at("02"), item_at("10")) + take(2, item_at("12"), item_at("1a")) +
                  take(3, item_at("1c"), item_at("20")) +
                  "INSERT INTO gap(kind,owner,after_chunk,lost,time_ns,crc)"
                  " SELECT 0, 0, max(id), 3, 0, 0 FROM chunk WHERE source=0 AND " +
                  frame + "=x'14';DELETE FROM chunk WHERE source=0 AND " + frame +
                  " IN (x'15', x'16', x'17');");
  auto reader = log::Reader::open(path);
  REQUIRE(reader);
  const auto takes = tools::logged_takes(*reader);
  REQUIRE(takes);
  REQUIRE(takes->size() == 3);
  CHECK(!(*takes)[0].has_gaps);
  CHECK((*takes)[1].has_gaps);
  CHECK(!(*takes)[2].has_gaps);
}

// tests/golden/replay/staged.plog: 30 frames of the staged run, recorded with --frames. With
// POSED_MAKE_GOLDEN set this test writes it again. A new one needs its reason in the commit
// message.
TEST_CASE("the golden log's frames are reproduced on any machine", "[replay]") {
  const auto path = golden("replay/staged.plog");
  if (std::getenv("POSED_MAKE_GOLDEN") != nullptr) {
    std::filesystem::remove(path);
    write_staged_log(path, 30);
  }
  const TempFolder dir;  // opening a log may write to it, so use a copy
  const auto copy = dir.path() / "staged.plog";
  std::filesystem::copy_file(path, copy);
  const Replayed result = replayed(copy, false);
  auto reader = log::Reader::open(copy);
  REQUIRE(reader);
  std::array<std::optional<log::Reader::Frames>, 4> live;
  for (std::uint32_t i = 0; i < 4; ++i) live[i] = reader->frames(i / 2, i % 2 == 1).value();
  for (const std::string& bytes : result.frames) {
    v1::Frame frame, expected;
    REQUIRE(frame.ParseFromString(bytes));
    const bool raw = frame.stream().ends_with("-raw");
    const auto row = live[(frame.stream()[0] == 'b' ? 2 : 0) + (raw ? 1 : 0)]->next().value();
    REQUIRE(row);
    REQUIRE(expected.ParseFromArray(row->bytes.data(), static_cast<int>(row->bytes.size())));
    check_near(frame, expected);
  }
  CHECK(result.frames.size() == 4 * 30 - 2 * 5 + 4);
}

// tests/golden/replay/feet.plog: a synthetic walker of two seconds, styled, whose root stays on the
// performer; recorded with `posed record --frames`. With POSED_MAKE_GOLDEN set this test writes its
// frames again, for the next run; they need their reason in the commit message.
TEST_CASE("the golden log's feet stand where they stood, on any machine", "[replay]") {
  const TempFolder dir;
  const auto copy = dir.path() / "feet.plog";
  std::filesystem::copy_file(golden("replay/feet.plog"), copy);
  const Replayed result = replayed(copy, false);
  if (std::getenv("POSED_MAKE_GOLDEN") != nullptr) {
    std::string sql;
    for (std::size_t i = 0; i < result.frames.size(); ++i) {
      sql += "UPDATE frame SET bytes=" + blob(result.frames[i]) +
             " WHERE id=(SELECT id FROM frame ORDER BY id LIMIT 1 OFFSET " + std::to_string(i) +
             ");";
    }
    forge(golden("replay/feet.plog"), sql);
  }
  auto reader = log::Reader::open(copy);
  REQUIRE(reader);
  auto live = reader->frames(0, false).value();
  for (const std::string& bytes : result.frames) {
    v1::Frame frame, expected;
    REQUIRE(frame.ParseFromString(bytes));
    const auto row = live.next().value();
    REQUIRE(row);
    REQUIRE(expected.ParseFromArray(row->bytes.data(), static_cast<int>(row->bytes.size())));
    check_near(frame, expected);
  }
  CHECK(result.frames.size() == 60);
}
